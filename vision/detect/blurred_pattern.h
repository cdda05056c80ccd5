#pragma once

#include <Eigen/Core>

#include "vision/detect/picture_blur.h"
#include "vision/detect/tag_kernels.h"
#include "vision/detect/tag_pattern.h"

namespace clothfit {

/// A printed pattern under a blur, as a smooth function of tag coordinates: 0 black, 1 white.
///
/// It is a cubic B-spline on a grid finer than the lens's blur. Its coefficients are the pattern
/// under that part of the blur that the spline itself does not add: cells under a Gaussian along
/// the tag's axes in closed form, then a sum over the shifts that make up the motion and what of
/// the lens is not along the axes. Second moments of the whole are `covariance_px2`, and the kernel
/// is symmetric, so that no edge moves. That covariance is the blur's, but for a correlation
/// between the axes that is too small to be worth its shifts.
class BlurredPattern {
 public:
  using Coefficients = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// `pixel_by_tag` maps small steps from tag coordinates to pixels, at the middle of the tag.
  BlurredPattern(const TagPattern& pattern, const Eigen::Matrix2d& pixel_by_tag,
                 const PictureBlur& blur);

  /// Returns the covariance of the kernel.
  const Eigen::Matrix2d& covariance_px2() const { return covariance_px2_; }
  /// Returns the coefficients, which live as long as this does.
  SplineGrid grid() const {
    return {.coefficients = coefficients_.data(),
            .side = side_,
            .first = static_cast<float>(first_),
            .per_step = static_cast<float>(1 / step_)};
  }

 private:
  double first_;  ///< tag coordinate of the first column and row
  double step_;   ///< between columns and rows
  int side_;      ///< columns and rows
  Coefficients coefficients_;
  Eigen::Matrix2d covariance_px2_;
};

}  // namespace clothfit
