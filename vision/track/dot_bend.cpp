#include "vision/track/dot_bend.h"

#include <Eigen/LU>
#include <cmath>

namespace clothfit {

Eigen::Vector2d dot_bend_shift_px(const LocalMap& map, double radius) {
  constexpr double kFlat = 0.05;  // of the area that is seen head on
  const double determinant = map.jacobian_px.determinant();
  if (!(std::abs(determinant) > kFlat * map.scale_px * map.scale_px))
    return Eigen::Vector2d::Zero();
  // Columns: ss, st, tt of the picture's coordinates, taken back to the cloth's axes.
  Eigen::Matrix<double, 2, 3> second;
  for (Eigen::Index c = 0; c < 2; ++c) {
    const Eigen::Matrix2d& bend = map.bend_px[static_cast<size_t>(c)];
    second.row(c) << bend(0, 0), bend(0, 1), bend(1, 1);
  }
  const Eigen::Matrix<double, 2, 3> k = map.jacobian_px.inverse() * second;
  const Eigen::Vector2d g(0.75 * k(0, 0) + 0.25 * k(0, 2) + 0.5 * k(1, 1),
                          0.75 * k(1, 2) + 0.25 * k(1, 0) + 0.5 * k(0, 1));
  return 0.5 * radius * radius * (map.jacobian_px * g);
}

}  // namespace clothfit
