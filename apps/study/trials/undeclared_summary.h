#pragma once

#include <string>
#include <vector>

#include "apps/study/trials/undeclared.h"
#include "data/fit_result.h"

namespace clothfit {

/// A share of trials with Clopper and Pearson's exact 95 % bounds [clopper1934].
struct Rate {
  int hits = 0, trials = 0;
  double share() const;     ///< NaN without trials
  Interval bounds() const;  ///< 0 to 1 without trials
};

/// A mean over the trials that have a number.
struct Mean {
  double sum = 0;
  int count = 0;
  void add(double value);  ///< leaves out values that are not finite
  double value() const;    ///< NaN for none
};

/// The results for one hidden mode, or for all trials together.
struct UndeclaredSummary {
  std::string title;
  int refused = 0;   ///< not drawn, or without a diagnosis
  Rate right_first;  ///< for clean recordings: nothing accepted
  Rate all_named;    ///< each hidden effect by one of its own
  int explained = 0, partly = 0, unexplained = 0, adequate = 0;
  /// Share of trials with a withheld effect, seen as missing, whose proposed law leaves at most
  /// half of the held-out error.
  Rate law_halves;
  Mean class_size, sigmas;
  Mean amplitude_ratio;
  Rate covered;       ///< amplitudes within two of their own sigmas of the truth
  Mean over_truth;    ///< held-out error over that of the model told the truth
  Mean over_noise;    ///< held-out error over the noise
  Mean before_noise;  ///< and that of the model as declared
  Mean seconds;
};

/// Has a row for each hidden mode, in the order in which they first appear, then one for all. Of a
/// pair both modes have rows.
std::vector<UndeclaredSummary> undeclared_summaries(const UndeclaredResult& result);

/// Counts of effects accepted first, by the hidden one.
struct Confusion {
  std::vector<std::string> hidden;  ///< titles, rows
  std::vector<std::string> named;   ///< effects and "nothing", columns
  std::vector<std::vector<int>> count;
  std::vector<std::vector<int>> right;  ///< counts of these that are right
};
Confusion confusion_of(const UndeclaredResult& result);

}  // namespace clothfit
