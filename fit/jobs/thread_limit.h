#pragma once

#include <tbb/global_control.h>

#include <cstddef>
#include <string>

#include "data/input_error.h"
#include "fit/interface/option_limits.h"

namespace clothfit {

/// Throws InputError for a number of threads that no machine has; 0 means all of them.
inline void require_threads(int threads) {
  if (threads < 0 || threads > kMostThreads)
    throw InputError("--threads", "is out of range", "0 (all) to " + std::to_string(kMostThreads));
}

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
