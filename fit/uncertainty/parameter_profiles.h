#pragma once

#include "data/progress.h"
#include "fit/uncertainty/profile_likelihood.h"
#include "fit/uncertainty/uncertainty.h"

namespace clothfit {

/// One parameter's cost, least over all others, around its optimum.
struct ParameterProfile {
  int parameter = -1;
  /// The cost's rise at the ends of the stated interval over the parabola's. Other parameters are
  /// moved along as the Hessian has them. 1 where the cost is a parabola; infinite where there is
  /// none.
  double rise_below = 1, rise_above = 1;
  bool profiled = false;        ///< one of the rises is off by more than a fifth
  ProfileInterval profile;      ///< in coordinates; where profiled
  double lower = 0, upper = 0;  ///< its ends, in the parameter's unit
};

/// Profiles the parameters of the physics whose cost is no parabola. The ends lie where the cost
/// has risen by what the parabola would at the ends of the stated interval. So likelihood gives the
/// shape and `uncertainty` the scale, and an interval that blocks have made wider stays wider.
/// Where the cost ends before it has risen so far, the range's end counts. Other parameters are
/// minimised again at each point by Levenberg and Marquardt's method with exact derivatives. All
/// are at the objective's time step and under one threshold of Huber's loss, so that costs compare.
/// A cancelled call returns what there is.
std::vector<ParameterProfile> parameter_profiles(const TrajectoryObjective& objective,
                                                 const Eigen::VectorXd& values,
                                                 const Uncertainty& uncertainty, Loss loss,
                                                 const ProgressCallback& progress);

}  // namespace clothfit
