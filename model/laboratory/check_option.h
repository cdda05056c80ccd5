#pragma once

#include <fmt/format.h>

#include "data/input_error.h"

namespace clothfit {

/// Refuses the value of an option unless it is `good`. `member` is Options::member.
inline void check_option(bool good, const char* member, double value, const char* expected) {
  if (!good) throw InputError(member, fmt::format("it is {:g}", value), expected);
}

}  // namespace clothfit
