#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>

#include "vision/detect/tag_pattern.h"

namespace clothfit {

/// A tag's four corners as the whole printed pattern places them.
struct RefinedTag {
  bool usable = false;  ///< false: the pattern does not explain the picture; corners are then unset
  std::array<Eigen::Vector2d, 4> corner_px{};  ///< order and pixels as in TagDetection
  std::array<double, 4> sigma_px{};            ///< one standard deviation per coordinate
  /// Mean robust weight of the pixels; about 0.9 where the pattern and noise explain all of them.
  double explained = 0;
};

/// Places a printed tag on a picture by least squares on the grey levels of all its pixels. The map
/// to the picture is smoothly bent. Fitting straight lines to the border instead is biased where
/// cloth bends, and uses a fraction of the tag's edges.
///
///   grey(p) = a(q) + c(q) T(q'),   q = homography^-1(p),   q' = q + d(q)
///
/// T is the pattern, blurred by a Gaussian whose widths along the tag's two axes (optics, pixel
/// size and motion) are estimated too. a and c are linear (light). d holds all polynomials up to
/// degree 3 with a normal prior: place, size and shear nearly free, the higher degrees small. Noise
/// grows with the slope of the picture, as ragged edges make it; both parts are estimated. Pixels
/// that the pattern does not explain (something in front, a fold) lose their weight (Cauchy loss).
/// A hidden corner is therefore placed by the rest of the tag, with the sigma that this implies.
///
/// Sigma is the posterior's plus the size that the next degree of bending may have by the last
/// one's.
///
/// `pixel_from_tag` maps tag coordinates to pixels (pixel (0, 0) is the centre of the top left one)
/// and must be right to a third of a cell.
RefinedTag refine_tag(const cv::Mat& grey, const TagPattern& pattern,
                      const Eigen::Matrix3d& pixel_from_tag);

}  // namespace clothfit
