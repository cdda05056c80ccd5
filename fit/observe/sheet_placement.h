#pragma once

#include <optional>
#include <vector>

#include "calib/camera/rigid3.h"
#include "fit/observe/observations.h"

namespace clothfit {

/// Places the flat, unstretched sheet: world_from_sheet (sheet axes: x along s, y along t). It
/// brings the markers' flat places closest to their places in the first `frames` frames, over all
/// sets and weighted by their sigma. `marker_m` holds (s, t) of every marker. Returns nothing when
/// every set shows fewer than four markers there, or markers on a line only.
std::optional<Rigid3> place_flat_sheet(const std::vector<ObservationSet>& sets,
                                       const Eigen::Matrix2Xd& marker_m, int frames);

}  // namespace clothfit
