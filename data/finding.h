#pragma once

#include <string>
#include <vector>

namespace clothfit {

/// What holding a recording's declarations against its own data came to.
enum class FindingState { passed, warning, refused };
std::string to_string(FindingState state);

/// The outcome of one check (fit/preflight/preflight.h).
struct Finding {
  std::string check;  ///< its name, such as "units"
  FindingState state = FindingState::passed;
  std::string found;     ///< what the data show, with the number that shows it
  std::string where;     ///< FILE, or FILE:LINE, that declares otherwise; empty where it passed
  std::string expected;  ///< what is declared, or what would be right
  std::string remedy;    ///< what a person may do; may be empty
};

using Findings = std::vector<Finding>;

/// Returns "FILE:LINE: found; expected; remedy", or what it found where it passed.
std::string sentence(const Finding& finding);

/// Returns those in that state.
Findings with_state(const Findings& findings, FindingState state);

}  // namespace clothfit
