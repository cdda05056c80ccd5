#pragma once

#include <Eigen/Core>

namespace clothfit {

struct Turned {
  Eigen::Vector3d value;
  Eigen::Matrix3d by_turn;
};

/// Returns a vector turned by a rotation vector, with its derivative by the latter.
Turned turned(const Eigen::Vector3d& turn, const Eigen::Vector3d& vector);

}  // namespace clothfit
