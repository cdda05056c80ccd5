#include "fit/problem/turned.h"

#include <ceres/jet.h>
#include <ceres/rotation.h>

namespace clothfit {

Turned turned(const Eigen::Vector3d& turn, const Eigen::Vector3d& vector) {
  using Jet = ceres::Jet<double, 3>;
  const Jet angle_axis[3] = {{turn.x(), 0}, {turn.y(), 1}, {turn.z(), 2}};
  const Jet before[3] = {Jet(vector.x()), Jet(vector.y()), Jet(vector.z())};
  Jet after[3];
  ceres::AngleAxisRotatePoint(angle_axis, before, after);
  Turned result;
  for (int c = 0; c < 3; ++c) {
    result.value[c] = after[c].a;
    result.by_turn.row(c) = after[c].v;
  }
  return result;
}

}  // namespace clothfit
