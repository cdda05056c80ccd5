#pragma once

#include "model/rest/minimise.h"

namespace clothfit {

/// A place on the line that is searched.
struct LinePlace {
  double step = 0;
  double energy_j = 0;
  double slope_n = 0;  ///< derivative of the energy by the step
};

/// Searches from `at` along `direction`, where `start` has a negative slope, for a flatter place no
/// higher. Its slope is at most `enough_slope` of that at the start in size. The search goes by
/// secants, inside bounds once there are some. The place found is left in `position_m` and its
/// gradient in `gradient_n`. A step of zero says that nothing lower was found.
LinePlace search_line(HeldEnergy& energy, const MeshField& at, const MeshField& direction,
                      const LinePlace& start, double first_step, double enough_slope,
                      MeshField& position_m, MeshField& gradient_n);

}  // namespace clothfit
