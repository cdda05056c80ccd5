#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

namespace clothfit {

/// A round dot on curved cloth as a picture maps it to second order: a place u of the print, in
/// radii from the centre, appears at centre + A u + (u^T H_x u, u^T H_y u) / 2.
struct SyntheticDot {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d px_per_radius = Eigen::Matrix2d::Identity();
  std::array<Eigen::Matrix2d, 2> bend_px{Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Zero()};
  double hole = 0;  ///< radius of a white hole in its middle, in radii
};

/// Something in front: all places with normal . (p - point) > 0.
struct SyntheticCover {
  Eigen::Vector2d point_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();
  double level = 60;
};

struct SyntheticDotPicture {
  int width = 64;
  int height = 64;
  double paper_levels = 200;
  double ink = 0.1;                                       ///< share of the paper's light
  Eigen::Vector2d light_slope = Eigen::Vector2d::Zero();  ///< relative change per px
  double blur_px = 0.6;                                   ///< Gaussian, besides the pixel's area
  Eigen::Vector2d motion_px = Eigen::Vector2d::Zero();    ///< way during the exposure
  double noise_levels = 1;
  int jpeg_quality = 0;  ///< 0: not compressed
  std::vector<SyntheticDot> dots;
  std::vector<SyntheticCover> covers;
};

/// Renders with 8 x 8 places per pixel, blurred by lens and motion, with noise.
cv::Mat render(const SyntheticDotPicture& picture, std::mt19937_64& rng);

/// Makes a dot of `radius_px` seen at `tilt` in direction `turn` (radians).
SyntheticDot tilted_dot(const Eigen::Vector2d& centre_px, double radius_px, double tilt,
                        double turn);

}  // namespace clothfit
