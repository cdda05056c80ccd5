#pragma once

#include "fit/objective.h"

namespace clothfit {

struct Uncertainty {
  bool usable = false;
  Eigen::VectorXd sigma;        ///< of each parameter, in its unit
  Eigen::MatrixXd correlation;  ///< of the coordinates
  double chi_square_per_dof = 0;
};

/// Covariance from the Jacobian at the optimum, (J' W J + priors)^-1 with Huber's weights W, times
/// chi-square per degree of freedom where that exceeds one: residuals larger than the stated noise
/// widen the intervals. Residuals are taken as independent, which a model that lacks physics
/// violates: then the true scatter is larger.
Uncertainty estimate_uncertainty(const FitProblem& problem, const Objective& objective,
                                 const Eigen::VectorXd& values);

}  // namespace clothfit
