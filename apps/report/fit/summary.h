#pragma once

#include <string>

#include "fit/interface/fit_report.h"

namespace clothfit {

/// The meaning of a fit, for a reader who reads nothing else.
struct FitSummary {
  std::string verdict;    ///< one short line
  std::string paragraph;  ///< plain text
};
FitSummary summarise(const FitReport& report);

}  // namespace clothfit
