#include "data/finding.h"

#include <algorithm>
#include <iterator>

namespace clothfit {

std::string to_string(FindingState state) {
  switch (state) {
    case FindingState::passed:
      return "passed";
    case FindingState::warning:
      return "warning";
    case FindingState::refused:
      return "refused";
  }
  return "";
}

std::string sentence(const Finding& finding) {
  std::string text = finding.found;
  if (!finding.where.empty()) text = finding.where + ": " + text;
  if (!finding.expected.empty()) text += "; " + finding.expected;
  if (!finding.remedy.empty()) text += "; " + finding.remedy;
  return text;
}

Findings with_state(const Findings& findings, FindingState state) {
  Findings result;
  std::ranges::copy_if(findings, std::back_inserter(result),
                       [&](const Finding& finding) { return finding.state == state; });
  return result;
}

}  // namespace clothfit
