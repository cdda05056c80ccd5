#include "vision/detect/fixed_corner.h"

#include <algorithm>
#include <cmath>

#include "data/median.h"

namespace clothfit {

FixedCorner average_fixed_corner(const std::vector<Eigen::Vector2d>& pixels,
                                 const std::vector<double>& sigmas) {
  std::vector<double> u, v, distance;
  for (const Eigen::Vector2d& pixel : pixels) {
    u.push_back(pixel.x());
    v.push_back(pixel.y());
  }
  const Eigen::Vector2d centre(median(u), median(v));
  for (const Eigen::Vector2d& pixel : pixels) distance.push_back((pixel - centre).norm());

  // Something that passes in front shifts a corner for a few frames, so detections further off than
  // 5 sigma are left out. The median distance of a normal scatter is 1.18 sigma.
  const double reach = 5 * std::max(median(distance) / 1.18, median(sigmas));
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double square_sigma_sum = 0;
  int used = 0;
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (distance[i] > reach) continue;
    sum += pixels[i];
    square_sigma_sum += sigmas[i] * sigmas[i];
    ++used;
  }
  const Eigen::Vector2d mean = sum / used;
  double scatter = 0;  // variance per coordinate
  for (size_t i = 0; i < pixels.size(); ++i)
    if (distance[i] <= reach) scatter += (pixels[i] - mean).squaredNorm() / 2;
  const double stated = square_sigma_sum / used;
  scatter = used > 1 ? scatter / (used - 1) : stated;
  return {.pixel_px = mean, .sigma_px = std::sqrt(stated + scatter / used), .frames = used};
}

}  // namespace clothfit
