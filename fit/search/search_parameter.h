#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

namespace clothfit {

/// A searched parameter and its range.
struct SearchParameter {
  std::string name;
  double lower = 0;
  double upper = 1;        ///< > lower
  bool log_scale = false;  ///< draws are uniform in the logarithm; needs lower > 0

  /// Returns the place of a value in the range: 0 at the lower end, 1 at the upper, never outside.
  /// value_at() is its inverse.
  double fraction(double value) const;
  double value_at(double fraction) const;
};

/// Throws InputError for a range that makes no sense, and for none at all.
void require_ranges(const std::vector<SearchParameter>& parameters);

/// Folds the real line onto [0, 1] as between two mirrors.
double reflected(double x);

/// Returns the costs of `individuals`, one per column: smaller is better. `individuals` is
/// parameters x individuals, one column each, within their ranges. Whole generations come at once
/// so that they can be simulated in lanes and threads. A cost that is not finite (the simulation
/// diverged) ranks last.
using GenerationCost = std::function<Eigen::VectorXd(const Eigen::MatrixXd& individuals)>;

}  // namespace clothfit
