#pragma once

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <opencv2/core.hpp>
#include <random>
#include <string>

namespace clothfit {

/// A printed tag before a pinhole camera. Tag axes: x right and y down on the upright tag, z away
/// from its reader; the unit is half the border's width.
struct SyntheticTag {
  std::string family = "tag36h11";
  int id = 0;
  Eigen::Isometry3d camera_from_tag = Eigen::Isometry3d::Identity();
  /// Radius of the cylinder that the tag is bent around, its axis along y; infinite: flat.
  double radius = std::numeric_limits<double>::infinity();
};

struct SyntheticCamera {
  double focal_px = 900;
  int width = 110;
  int height = 100;
  double blur_px = 0.6;     ///< standard deviation
  double noise_levels = 1;  ///< standard deviation
};

/// Returns pixels of the border's corners: 0 bottom left, 1 bottom right, 2 top right, 3 top left.
std::array<Eigen::Vector2d, 4> true_corners(const SyntheticTag& tag, const SyntheticCamera& camera);

/// Renders the picture: 6 x 6 rays per pixel, blurred, with noise; black is 40, white and all
/// around 210.
cv::Mat render(const SyntheticTag& tag, const SyntheticCamera& camera, std::mt19937_64& rng);

/// Places a tag of about `width_px` before the camera's middle. It is turned by `roll` (about the
/// line of sight) and `tilt` (about its own vertical), off the middle by `shift_px`.
SyntheticTag place_tag(const SyntheticCamera& camera, double width_px, double roll, double tilt,
                       const Eigen::Vector2d& shift_px = Eigen::Vector2d::Zero());

}  // namespace clothfit
