#pragma once

#include <Eigen/Core>
#include <vector>

#include "vision/detect/tag_fit.h"

namespace clothfit {

/// The samples of a fit where the picture has a slope. Others place next to nothing: their weights
/// in the corners have 1 % of all squares. Codecs leave flat places cleaner, too.
struct EdgeSamples {
  explicit EdgeSamples(const TagFit& fit);

  TagSamples samples;
  TagRows rows;
};

/// How the residuals of neighbouring pixels of a tag hang together, estimated from the tag itself:
///
///   cov(r_i, r_j) = noise(i - j) + g_i . g_j shift(|i - j|),  g: slope of the picture, levels per
///   px
///
/// Noise is the sensor's; interpolation and codecs correlate it between next neighbours. Shift is
/// that of edges against where the pattern puts them (px^2): rough print, weave, and a codec's
/// blocks, which move a little as wholes. Both are moments over all pairs of pixels at some lags.
class ResidualCovariance {
 public:
  /// Keeps a reference to the samples.
  explicit ResidualCovariance(const EdgeSamples& edges);

  using Variances = Eigen::Array<double, 8, 1>;
  /// Returns the variances of the last 8 of these sums of residuals. The first 8 are the
  /// coordinates of four points that stand for the tag: they tell what of noise and shift the fit
  /// has taken up, which residuals lack. Places that err by some variance take a smooth shift of
  /// that variance out of the residuals.
  Variances variance(const ResidualSums& sums);

 private:
  using AllVariances = Eigen::Array<double, 16, 1>;
  static constexpr int kMostAcross = 8;  ///< blocks

  void estimate();
  void add_blocks(const ResidualSums& weights);
  AllVariances shift_variances() const;
  AllVariances noise_variances(const ResidualSums& weights) const;
  void set_taken_up(double taken_up_px2);
  double shift_at(double distance_px) const;

  const EdgeSamples* edges_;
  double noise_ = 0;               ///< variance, grey levels^2
  std::vector<double> noise_lag_;  ///< covariances, one per lag of the near classes
  // Covariances of the shift, px^2 per coordinate: at the same pixel, then one per class of lags.
  std::vector<double> seen_shift_;  ///< of the residuals
  std::vector<double> shift_;       ///< with what the fit has taken up
  std::vector<int> place_;          ///< of each sample in the maps
  // Sums of slopes times weights over square blocks of pixels: products of those of pairs of
  // blocks, one row per offset down and across, and squares of single pixels.
  int block_px_ = 0;  ///< side
  ResidualSums by_offset_;
  AllVariances alone_;
};

}  // namespace clothfit
