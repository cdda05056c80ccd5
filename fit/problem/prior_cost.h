#pragma once

#include "fit/problem/problem.h"

namespace clothfit {

/// Half the sum of squares of a problem's priors, to second order in the coordinates.
struct PriorCost {
  double cost = 0;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd information;
};
PriorCost prior_cost(const FitProblem& problem, const Eigen::VectorXd& values);

}  // namespace clothfit
