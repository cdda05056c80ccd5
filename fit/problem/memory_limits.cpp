#include "fit/problem/memory_limits.h"

#include <fmt/format.h>

#include "data/input_error.h"

namespace clothfit {

void require_memory(double bytes, const std::string& where, const std::string& what,
                    const std::string& remedy) {
  if (bytes <= kMostBytes) return;
  throw InputError(where, fmt::format("{} would take {:.2g} GB of memory", what, bytes / 1e9),
                   fmt::format("at most {:.2g} GB", kMostBytes / 1e9), remedy);
}

}  // namespace clothfit
