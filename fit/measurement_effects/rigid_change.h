#pragma once

#include <Eigen/Geometry>

#include "fit/measurement_effects/measurement_effect.h"

namespace clothfit {

/// Returns `offset` turned by a rotation vector (rad): by the rational rotation (Cayley's) of w =
/// turn / 2,
///
///   R v = v + 2 / (1 + w^2) [w x v + w x (w x v)],
///
/// which turns by 2 atan |w|, the angle itself up to its cube over 12. Without a turn the result is
/// `offset` to the last bit.
inline MeasuredPoint turned(const MeasuredPoint& turn_rad, const MeasuredPoint& offset) {
  const MeasuredPoint w = turn_rad * MeasuredNumber(0.5);
  const MeasuredPoint once = w.cross(offset);
  return offset + (once + w.cross(once)) * (MeasuredNumber(2.0) / (MeasuredNumber(1.0) + w.dot(w)));
}

/// Turns `position_m` about the middle of the placed sheet and then shifts it.
inline void move_rigidly(const Sighting& sighting, const MeasuredPoint& turn_rad,
                         const MeasuredPoint& shift_m, MeasuredPoint& position_m) {
  const MeasuredPoint middle_m = sighting.sheet_middle_m.cast<MeasuredNumber>();
  const MeasuredPoint offset_m = position_m - middle_m;
  // The change is added, so that no change leaves the place to the last bit.
  position_m += turned(turn_rad, offset_m) - offset_m + shift_m;
}

}  // namespace clothfit
