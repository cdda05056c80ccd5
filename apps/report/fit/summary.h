#pragma once

#include <string>

#include "fit/interface/fit_report.h"

namespace clothfit {

/// The meaning of a fit, for a reader who reads nothing else.
struct FitSummary {
  std::string verdict;        ///< one sentence, without the full stop
  std::string contradicting;  ///< markers that contradict all others; or empty
  std::string paragraph;      ///< plain text
};
FitSummary summarise(const FitReport& report);

}  // namespace clothfit
