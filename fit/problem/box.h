#pragma once

#include <Eigen/Core>
#include <vector>

namespace clothfit {

struct ParameterSpace;

/// The ranges of a fit's coordinates.
struct Box {
  Eigen::VectorXd lower, upper;

  Eigen::VectorXd clamped(const Eigen::VectorXd& x) const {
    return x.cwiseMax(lower).cwiseMin(upper);
  }
  /// Tells whether coordinate `p` stands at an end that keeps it from a lower cost.
  bool blocks(Eigen::Index p, double coordinate, double gradient) const {
    const double edge = 1e-12 * (upper[p] - lower[p]);
    return gradient > 0 ? coordinate - lower[p] <= edge : upper[p] - coordinate <= edge;
  }
  /// All coordinates that do.
  std::vector<bool> blocked(const Eigen::VectorXd& x, const Eigen::VectorXd& gradient) const;
};

Box box_of(const ParameterSpace& space);

}  // namespace clothfit
