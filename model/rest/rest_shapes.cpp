#include "model/rest/rest_shapes.h"

#include <Eigen/Geometry>
#include <cmath>

#include "data/parallel.h"
#include "model/rest/equilibrium.h"

namespace clothfit {
namespace {

constexpr double kTolerance = 1e-9;
constexpr int kMostIterations = 1000;

/// Turns a cloth whose held points lie above one another to where it is closest to `start_m`, by
/// its masses. Leaves others as they are.
void turn_towards(const Cloth& cloth, const Eigen::Vector3d& gravity,
                  const Eigen::Matrix3Xd& start_m, const Eigen::Matrix3Xd& held_m,
                  Eigen::Matrix3Xd& position_m) {
  const Eigen::Vector3d up = -gravity.normalized();
  const Eigen::Vector3d pivot = held_m.col(0);
  const double size_m = std::hypot(cloth.mesh.width_m, cloth.mesh.height_m);
  for (Eigen::Index h = 1; h < held_m.cols(); ++h)
    if (up.cross(held_m.col(h) - pivot).norm() > 1e-9 * size_m) return;
  // The angle that makes sum m x0 . R(angle) x largest.
  double along = 0, across = 0;
  for (Eigen::Index v = 0; v < position_m.cols(); ++v) {
    const Eigen::Vector3d from = position_m.col(v) - pivot, to = start_m.col(v) - pivot;
    along += cloth.mass_kg[v] * (from.dot(to) - from.dot(up) * to.dot(up));
    across += cloth.mass_kg[v] * up.dot(from.cross(to));
  }
  if (along == 0 && across == 0) return;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(std::atan2(across, along), up).toRotationMatrix();
  const Eigen::Matrix3Xd from_pivot = position_m.colwise() - pivot;
  position_m = (turn * from_pivot).colwise() + pivot;
}

}  // namespace

std::vector<Eigen::Matrix3Xd> rest_shapes(const Cloth& cloth,
                                          std::span<const ParameterSet> parameters, double time_s) {
  std::vector<Eigen::Matrix3Xd> shapes(parameters.size());
  for_each_index(parameters.size(), [&](size_t n) {
    const ParameterSet& set = parameters[n];
    EquilibriumResult result = find_equilibrium(
        cloth, set, {.tolerance = kTolerance, .most_iterations = kMostIterations}, time_s);
    turn_towards(cloth, set.gravity_m_per_s2, set.start_position_m,
                 held_targets_m(cloth, set, time_s), result.position_m);
    shapes[n] = std::move(result.position_m);
  });
  return shapes;
}

}  // namespace clothfit
