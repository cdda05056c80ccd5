#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <utility>

#include "data/shown_text.h"

namespace clothfit {

/// Prints to standard output as fmt::print does, without what a terminal takes for commands: names
/// and paths of the user's may hold it.
template <class... Args>
void say(fmt::format_string<Args...> format, Args&&... args) {
  fmt::print("{}", without_controls(fmt::format(format, std::forward<Args>(args)...), true));
}

}  // namespace clothfit
