#pragma once

#include <string>

#include "fit/interface/fit_report.h"

namespace clothfit {

/// Gravity, fitted along with a camera's pose, ended this far from its declared direction.
struct TiltAgainstPose {
  double tilt_rad = 0;
  double sigmas = 0;       ///< in standard deviations of the pose
  bool is_stated = false;  ///< whether they are stated, or what is assumed of a pose without
};

/// Warns of a tilt that the camera's pose does not allow, and marks the result. The numbers of the
/// cloth may be right, but something stated of the scene is not. `file` declares gravity.
void warn_of_contradicted_pose(const TiltAgainstPose& tilt, const std::string& file,
                               FitReport& report);

}  // namespace clothfit
