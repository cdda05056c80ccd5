#pragma once

#include <Eigen/Core>
#include <vector>

#include "vision/detect/tag_fit.h"

namespace clothfit {

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
  explicit ResidualCovariance(const TagFit& fit);

  /// One column per sum of residuals, with the weight of each sample in it.
  using Sums = Eigen::Matrix<float, Eigen::Dynamic, 8>;
  using Variances = Eigen::Matrix<double, 8, 1>;
  /// Returns the variance of each of these sums.
  Variances variance(const Sums& weights) const;
  /// Adds what the fit has taken up of noise and shift, since residuals lack it: places that err
  /// by some variance take a smooth shift of that variance out of the residuals.
  /// `places` are the weights of residuals in the coordinates of four points that stand for
  /// the tag.
  void complete(const Sums& places);

 private:
  using Map = Eigen::Array<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// Sums of slopes times weights over square blocks of pixels.
  struct BlockSums {
    int side_px = 0;
    int across = 0;  ///< blocks in a row
    Sums along_u, along_v;
    Variances alone;  ///< sums of squares over single pixels
  };

  Map to_map(const Eigen::VectorXf& values) const;
  void estimate(const TagFit& fit);
  BlockSums block_sums(const Sums& weights) const;
  Variances shift_variance(const BlockSums& sums) const;
  Variances noise_variances(const Sums& weights) const;
  double noise_variance(const Map& weight) const;
  void set_taken_up(double taken_up_px2);
  double shift_at(double distance_px) const;

  Eigen::Vector2i first_px_;       ///< of the smallest box that holds all samples
  Eigen::Vector2i size_px_;        ///< of the box
  Eigen::MatrixX2i place_px_;      ///< of each sample, in the box
  Eigen::MatrixX2f gradient_;      ///< of each sample
  double noise_ = 0;               ///< variance, grey levels^2
  std::vector<double> noise_lag_;  ///< covariances, one per class of near lags
  // Covariances of the shift, px^2 per coordinate: at the same pixel, then one per class of lags.
  std::vector<double> seen_shift_;  ///< of the residuals
  std::vector<double> shift_;       ///< completed
};

}  // namespace clothfit
