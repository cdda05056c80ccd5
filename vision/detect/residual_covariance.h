#pragma once

#include <Eigen/Core>
#include <functional>
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
  /// Adds the part of the shift that the fit has taken up: residuals show what is left of it, and
  /// its smooth part is missing there. `places` are the weights of residuals in the coordinates of
  /// four points whose variance is the mean over the tag.
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
  static Variances shift_variance(const BlockSums& sums, double all,
                                  const std::function<double(double)>& at);
  double shift_at(double distance_px) const;
  double smooth_at(double distance_px) const;
  double noise_variance(const Map& weight) const;

  Eigen::Vector2i first_px_;   ///< of the smallest box that holds all samples
  Eigen::Vector2i size_px_;    ///< of the box
  Eigen::MatrixX2i place_px_;  ///< of each sample, in the box
  Eigen::MatrixX2f gradient_;  ///< of each sample
  double taken_up_ = 0;
  double noise_ = 0, shift_ = 0;     ///< variances, of shift per coordinate
  std::vector<double> noise_lag_;    ///< covariances, one per class of near lags
  std::vector<double> shift_class_;  ///< covariances, one per class of lags
};

}  // namespace clothfit
