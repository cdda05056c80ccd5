#pragma once

// Private to calib/.

#include "calib/bundle/camera_estimate.h"

namespace clothfit {

/// Estimates a camera without distortion and a pose for each view from closed forms. The focal
/// length is that of a few candidates which explains the corners best. Views without a pose are
/// left unused.
CameraEstimate start_estimate(const BoardObservations& observations, CameraModel model,
                              int distortion_count);

}  // namespace clothfit
