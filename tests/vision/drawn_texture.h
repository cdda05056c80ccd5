#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>

namespace clothfit {

/// A picture of waves of random directions, 5 to 25 px long, whose level is known everywhere.
class DrawnTexture {
 public:
  explicit DrawnTexture(std::uint64_t seed);
  /// Returns the grey level at a place of the first picture, 50 to 210.
  double level(const Eigen::Vector2d& place_px) const;

  /// Draws the picture whose pixel y shows the place `first_from_picture`(y) of the first one, with
  /// `light`(y, level) instead of each level, and noise.
  cv::Mat draw(const cv::Size& size,
               const std::function<Eigen::Vector2d(const Eigen::Vector2d&)>& first_from_picture,
               double noise_levels = 0, std::uint64_t noise_seed = 1,
               const std::function<double(const Eigen::Vector2d&, double)>& light = {}) const;

 private:
  static constexpr int kWaves = 40;
  // Single precision, whose sines are computed four at a time, is off by a thousandth of a level.
  Eigen::Array<float, kWaves, 1> per_px_u_, per_px_v_, phase_;  ///< radians
};

}  // namespace clothfit
