#pragma once

#include <Eigen/Core>
#include <vector>

#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

/// The acceleration of one marker's residual in one frame, observed less predicted (world).
struct ResidualAcceleration {
  int marker = 0, frame = 0;
  Eigen::Vector3d observed_m;
  Eigen::Vector3d acceleration_m_per_s2;
  double sigma_m_per_s2 = 0;  ///< of each coordinate, from the noise
};

/// Differentiates a recording's residuals of 3D tracks twice: by least squares, a parabola over
/// each frame, the two before and the two after, of which one may be missing. A force that sets in
/// within a frame shows at once where it acts. Elsewhere the cloth answers later.
std::vector<ResidualAcceleration> residual_accelerations(const FittedModel& model,
                                                         size_t recording);

}  // namespace clothfit
