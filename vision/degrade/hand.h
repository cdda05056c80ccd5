#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>

namespace clothfit {

/// A hand that hides part of a picture: an opaque palm with four fingers and a forearm, whose edge
/// is soft over about 3 px. Its skin has a texture, so that no detector takes it for a flat tone.
struct Hand {
  Eigen::Vector2d palm_px = Eigen::Vector2d::Zero();  ///< middle of the palm
  double direction_rad = 0;                           ///< the fingers point there, from u to v
  double size_px = 0;                                 ///< radius of the palm

  /// Returns how opaque the hand is at a place, 0 to 1.
  double cover(const Eigen::Vector2d& place_px) const;
};

/// Places a hand over a share (0 to 1) of the points, to the nearest one that its size can reach:
/// the palm somewhere among the points, the direction drawn from `seed`.
Hand hand_over(std::span<const Eigen::Vector2d> points_px, double share, std::uint64_t seed);

/// Draws the hand over an 8-bit grey picture.
cv::Mat with_hand(const cv::Mat& grey, const Hand& hand, std::uint64_t seed);

}  // namespace clothfit
