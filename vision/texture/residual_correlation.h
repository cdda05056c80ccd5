#pragma once

#include <Eigen/Core>
#include <vector>

#include "vision/texture/align_patch.h"

namespace clothfit {

/// How residuals of neighbouring samples hang together, from the fits of one picture. The smoothing
/// of pictures, codecs, weave and light that the model lacks make them err alike, and a place
/// averages over fewer samples than it has.
class ResidualCorrelation {
 public:
  static constexpr int kReach = 5;  ///< samples; further ones count as independent

  ResidualCorrelation() = default;
  /// Adds the products of residuals of one fit; `patch` is the one that was aligned.
  void add(const TexturePatch& patch, const PatchFit& fit);
  /// Returns the covariance of the fit's place, px^2.
  Eigen::Matrix2d place_covariance_px2(const TexturePatch& patch, const PatchFit& fit) const;
  /// Returns the correlation at a lag, 1 at none and 0 where nothing was added.
  double at(int columns, int rows) const;
  /// Returns how many samples err as one, >= 1: the sum of the correlation over all lags.
  double samples_alike() const;

 private:
  static constexpr int kAcross = 2 * kReach + 1;
  using Lags = Eigen::Matrix<double, kAcross, kAcross>;

  Lags products_ = Lags::Zero();
  Lags pairs_ = Lags::Zero();
};

}  // namespace clothfit
