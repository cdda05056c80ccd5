#include "vision/degrade/hand.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

namespace clothfit {
namespace {

/// Returns the distance of a place from the segment between `from` and `to`.
double distance_to(const Eigen::Vector2d& place, const Eigen::Vector2d& from,
                   const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = to - from;
  const double share = std::clamp((place - from).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (place - from - share * along).norm();
}

/// Returns the distance from the hand's outline, negative inside it, in radii of the palm. Axes: x
/// along the fingers.
double outline_distance(const Eigen::Vector2d& place) {
  double nearest = distance_to(place, {-0.3, 0}, {0.3, 0}) - 0.9;
  nearest = std::min(nearest, distance_to(place, {-1, 0}, {-40, 0}) - 0.6);  // forearm
  constexpr double kSpread = 0.55;                                           // between fingers
  for (int finger = 0; finger < 4; ++finger) {
    const double y = kSpread * (finger - 1.5);
    nearest =
        std::min(nearest, distance_to(place, {0.5, y}, {2.2 - 0.3 * std::abs(y), 1.3 * y}) - 0.22);
  }
  return nearest;
}

}  // namespace

double Hand::cover(const Eigen::Vector2d& place_px) const {
  assert(size_px > 0);
  const Eigen::Vector2d along(std::cos(direction_rad), std::sin(direction_rad));
  const Eigen::Vector2d from_palm = (place_px - palm_px) / size_px;
  const Eigen::Vector2d in_hand(from_palm.dot(along),
                                from_palm.y() * along.x() - from_palm.x() * along.y());
  constexpr double kSoft = 3;  // px over which the edge goes from clear to opaque
  const double share = std::clamp(0.5 - size_px * outline_distance(in_hand) / kSoft, 0.0, 1.0);
  return share * share * (3 - 2 * share);
}

Hand hand_over(std::span<const Eigen::Vector2d> points_px, double share, std::uint64_t seed) {
  assert(!points_px.empty());
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> turn(-M_PI, M_PI);
  const std::size_t centre =
      std::uniform_int_distribution<std::size_t>(0, points_px.size() - 1)(rng);
  Hand hand{.palm_px = points_px[centre], .direction_rad = turn(rng), .size_px = 1};
  const auto covered = [&](double size) {
    hand.size_px = size;
    const auto hidden = std::ranges::count_if(
        points_px, [&](const Eigen::Vector2d& point) { return hand.cover(point) > 0.5; });
    return static_cast<double>(hidden) / static_cast<double>(points_px.size());
  };
  double small = 1, large = 1;
  while (covered(large) < share && large < 1e5) large *= 2;
  constexpr int kHalvings = 20;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (small + large);
    (covered(middle) < share ? small : large) = middle;
  }
  hand.size_px = large;
  return hand;
}

cv::Mat with_hand(const cv::Mat& grey, const Hand& hand, std::uint64_t seed) {
  assert(grey.type() == CV_8UC1);
  // Blurred noise of two sizes stands for creases and pores.
  cv::Mat creases(grey.size(), CV_32FC1), pores(grey.size(), CV_32FC1);
  cv::RNG rng(seed);
  rng.fill(creases, cv::RNG::NORMAL, 0, 1);
  rng.fill(pores, cv::RNG::NORMAL, 0, 1);
  constexpr double kCrease = 6, kPore = 1.2;  // px
  cv::GaussianBlur(creases, creases, cv::Size(), kCrease);
  cv::GaussianBlur(pores, pores, cv::Size(), kPore);
  constexpr double kTone = 150;
  const cv::Mat skin = kTone + 200 * creases + 20 * pores;
  cv::Mat result(grey.size(), CV_8UC1);
  for (int v = 0; v < grey.rows; ++v)
    for (int u = 0; u < grey.cols; ++u) {
      const double cover = hand.cover(Eigen::Vector2d(u, v));
      const double level = (1 - cover) * grey.at<std::uint8_t>(v, u) + cover * skin.at<float>(v, u);
      result.at<std::uint8_t>(v, u) =
          static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L));
    }
  return result;
}

}  // namespace clothfit
