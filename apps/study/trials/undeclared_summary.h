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
  void add(double value);  ///< what is not finite is left out
  double value() const;    ///< NaN for none
};

/// What became of one hidden law, or of all trials together.
struct UndeclaredSummary {
  std::string title;
  int refused = 0;   ///< not drawn, or without a diagnosis
  Rate right_first;  ///< of clean recordings: nothing accepted
  Rate all_named;    ///< each hidden effect by one of its own
  int explained = 0, partly = 0, unexplained = 0, adequate = 0;
  /// Where an effect was withheld and something was seen to be missing: whether the law that was
  /// proposed leaves half of the held-out error at most.
  Rate law_halves;
  Mean class_size, sigmas;
  Mean amplitude_ratio;
  Rate covered;       ///< amplitudes within two of their own sigmas of the truth
  Mean over_truth;    ///< held-out error over that of the model told the truth
  Mean over_noise;    ///< held-out error over the noise
  Mean before_noise;  ///< and that of the model as declared
  Mean seconds;
};

/// A row for each hidden law, in the order in which they first appear (of a pair both laws), then
/// one of all.
std::vector<UndeclaredSummary> undeclared_summaries(const UndeclaredResult& result);

/// How often an effect was accepted first, by what was hidden.
struct Confusion {
  std::vector<std::string> hidden;  ///< titles, rows
  std::vector<std::string> named;   ///< effects and "nothing", columns
  std::vector<std::vector<int>> count;
  std::vector<std::vector<int>> right;  ///< of these, as many as count as right
};
Confusion confusion_of(const UndeclaredResult& result);

}  // namespace clothfit
