#pragma once

#include <Eigen/Core>
#include <array>

#include "vision/detect/tag_fit.h"

namespace clothfit {

/// A corner of a tag's border as a fit places it.
struct CornerPlace {
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  double sigma_px = 0;  ///< one standard deviation per coordinate
};

/// Returns the pixels of the four corners, in the order of TagDetection, of a fit.
std::array<Eigen::Vector2d, 4> corner_pixels(const TagFit& fit,
                                             const Eigen::Matrix3d& pixel_from_tag);

/// Returns the four corners, in the order of TagDetection, of a fit that has converged.
///
/// A corner solves q + d(q) = corner. Its variance is that of the unknowns, A^-1 (P + J' W C W J)
/// A^-1, with A the fit's normal matrix, P the prior's and C how residuals hang together
/// (residual_covariance.h). To the mean over both coordinates is added what bending of degree 4 and
/// more may do, by the size of the degrees found.
std::array<CornerPlace, 4> corner_places(const TagFit& fit, const Eigen::Matrix3d& pixel_from_tag,
                                         const Eigen::Matrix2d& pixel_by_tag);

}  // namespace clothfit
