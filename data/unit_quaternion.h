#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <optional>

namespace clothfit {

/// Returns the rotation that (w, x, y, z) of a file means, normalised. Nothing if its norm is off
/// by more than 1e-3, which no rounding explains. One that is unit to rounding is left as it is, so
/// that what was written reads back to the last bit.
inline std::optional<Eigen::Quaterniond> unit_quaternion(double w, double x, double y, double z) {
  const Eigen::Quaterniond given(w, x, y, z);
  const double excess = given.norm() - 1;
  if (!(std::abs(excess) <= 1e-3)) return std::nullopt;
  if (std::abs(excess) <= 4 * std::numeric_limits<double>::epsilon()) return given;
  return given.normalized();
}

}  // namespace clothfit
