#pragma once

#include <Eigen/Core>

#include "vision/detect/picture_blur.h"
#include "vision/detect/tag_pattern.h"

namespace clothfit {

/// A printed pattern under a blur, as a smooth function of tag coordinates: 0 black, 1 white.
///
/// It is a cubic B-spline on a grid of half a pixel or less. Its coefficients are the pattern under
/// that part of the blur that the spline itself does not add: cells under a Gaussian along the
/// tag's axes in closed form, then a sum over the shifts that make up the motion and what of the
/// lens is not along the axes. Second moments of the whole are those of the blur, and the kernel is
/// symmetric, so that no edge moves.
class BlurredPattern {
 public:
  /// `pixel_by_tag` maps small steps from tag coordinates to pixels, at the middle of the tag.
  BlurredPattern(const TagPattern& pattern, const Eigen::Matrix2d& pixel_by_tag,
                 const PictureBlur& blur);

  /// The pattern's value at a place and its derivatives in tag coordinates. By the heat equation,
  /// half of the second derivatives is how it changes with the blur's covariance.
  struct Value {
    float value = 0;
    float by_x = 0, by_y = 0;
    float by_xx = 0, by_xy = 0, by_yy = 0;
  };
  Value at(double x, double y) const;

 private:
  using Grid = Eigen::Array<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  double first_;  ///< tag coordinate of the first column and row
  double step_;   ///< between columns and rows
  Grid coefficients_;
};

}  // namespace clothfit
