#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fit/interface/fit_options.h"

namespace clothfit {

struct DiagnoseOptions {
  FitOptions fit;
  /// Effects that are not tested.
  std::vector<std::string> without;
  int beam_width = 3;  ///< beam entries that are followed side by side
  int refits = 6;      ///< hypotheses of each entry that are fitted in one round
  int most_effects = 4;
  int law_terms = 4;  ///< most terms of a law proposed for the residual; 0: none is proposed
  /// Number of hypotheses whose detection limits are confirmed by planting them on twins. One of
  /// each effect is planted, those first that are seen best.
  int plants = 0;
  bool reinject = false;  ///< whether what was found is simulated and searched again
  bool separate = true;   ///< whether recordings are sought that tell alike hypotheses apart
  /// Seconds after which the search ends and reports what it has; 0: it takes what it needs.
  double budget_s = 0;
  /// Says that the search is to end with what it has. Any thread may ask; or empty.
  std::function<bool()> is_enough;
  void validate() const;  ///< throws InputError
};

}  // namespace clothfit
