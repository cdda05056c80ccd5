#pragma once

#include "fit/problem/fit_problem.h"

namespace clothfit {

/// Gravity, fitted along with a camera's pose, lies this far from its declared direction.
struct FittedTilt {
  double angle_rad = 0;
  double sigmas = 0;       ///< in standard deviations of the pose
  bool is_stated = false;  ///< whether the pose comes with a covariance
};

/// Returns a tilt of 0 where gravity's direction is not fitted along.
FittedTilt fitted_tilt(const FitProblem& problem, const Eigen::VectorXd& values);

}  // namespace clothfit
