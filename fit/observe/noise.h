#pragma once

#include <Eigen/Core>
#include <vector>

namespace clothfit {

/// Noise of measured tracks, estimated from the tracks themselves.
struct NoiseEstimate {
  /// Standard deviation of one coordinate; NaN when `differences` is 0.
  double sigma = 0;
  /// Differences behind the estimate. Neighbouring ones share samples, so it is about as sure as
  /// one from a third as many independent numbers.
  int differences = 0;
};

struct NoiseOptions {
  /// Intervals of a run may differ by this share of their mean: jitter of a clock, not a gap.
  double interval_tolerance = 0.05;
};

/// Estimates the noise per coordinate of `tracks` over common `time_s` (one per frame, rising).
/// `tracks` is a matrix per marker: coordinates x frames, column f is frame f, NaN where it was not
/// observed.
///
/// The estimate uses third differences in time over four consecutive frames at nearly equal
/// intervals:
///
///   d = x_0 - 3 x_1 + 3 x_2 - x_3,   variance 20 sigma^2   (1 + 9 + 9 + 1).
///
/// They remove any motion that is a parabola over four frames. Of a smooth motion they keep the
/// jerk times the interval cubed. Their median absolute value is 0.6745 sqrt(20) sigma for normal
/// noise; differences beyond five standard deviations are left out of it (an outlier spoils four).
/// Of more than four million differences, those of evenly spaced frames are taken.
/// Noise that is correlated in time (a smoothed track) is underestimated: no difference in time can
/// see it.
NoiseEstimate estimate_noise(const std::vector<double>& time_s,
                             const std::vector<Eigen::MatrixXd>& tracks,
                             const NoiseOptions& options = {});

}  // namespace clothfit
