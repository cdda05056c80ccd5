#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "vision/detect/dot_refine.h"

namespace clothfit {

struct DotDetectorOptions {
  bool bright = false;  ///< look for bright dots on dark cloth instead
  /// px, > 0: radius of the smallest dot (of its shorter axis). Smaller values find more noise.
  double smallest_radius_px = 1.2;
  /// px: radius of the largest dot. Larger values cost a third more time per picture at most.
  double largest_radius_px = 40;
  /// 0 to 1: the least share of the paper's light that a dot lacks. Lower values find shadows.
  double least_contrast = 0.25;
  /// The least step from paper to dot, in standard deviations of the noise.
  double least_signal = 6;
  /// 0 to 1: a fit is doubted where its model explains less of the pixels; a clean dot has 0.9.
  double least_explained = 0.75;
  /// A fit is doubted where its rms residual is a larger share of the step from paper to dot, the
  /// noise's part taken off. Clean dots have 0.01, 6 px of motion blur makes 0.04, dots drawn by
  /// hand have 0.15 and squares 0.22.
  double largest_misfit = 0.25;
  /// A fit is doubted where its axes differ by a larger ratio, which is an angle of 7 degrees.
  double largest_axis_ratio = 8;
  void validate() const;  ///< throws InputError
};

/// Finds where dots may be: dark (or bright) spots by the determinant of the Hessian over scales,
/// measured by the area darker than half way to their surroundings. Sorted by strength, strongest
/// first; none lies within another.
std::vector<DotOutline> find_dot_candidates(const cv::Mat& grey, const DotDetectorOptions& options);

/// Fits a dot and says whether it is doubted.
Dot fit_dot(const cv::Mat& grey, const DotStart& start, const DotDetectorOptions& options);

/// Returns by how much the errors of the dots of one picture have a larger variance than if pixels
/// erred independently, as they do not where a codec or a lens mixed them, or print is ragged. The
/// centre is the outline's wave with one period around. Waves with 3 and 4 periods, which the fit
/// leaves over, err by nearly the same law. The factor is the larger of their median chi-squares
/// over that of the distribution; 1 with fewer than 10 dots.
double covariance_factor(const std::vector<const Dot*>& dots);

/// Finds all dots of an 8-bit grey picture, doubted ones included; sorted by row, then column. Two
/// fits that end in the same place are one dot.
std::vector<Dot> find_dots(const cv::Mat& grey, const DotDetectorOptions& options = {});

}  // namespace clothfit
