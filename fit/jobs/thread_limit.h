#pragma once

#include <tbb/global_control.h>

#include <cstddef>

namespace clothfit {

/// Limits the threads of this process while it lives. 0: as many as there were.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads)
      : control_(kParallelism, threads > 0 ? static_cast<size_t>(threads)
                                           : tbb::global_control::active_value(kParallelism)) {}

 private:
  static constexpr auto kParallelism = tbb::global_control::max_allowed_parallelism;
  tbb::global_control control_;
};

}  // namespace clothfit
