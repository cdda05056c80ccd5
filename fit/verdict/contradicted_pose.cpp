#include "fit/verdict/contradicted_pose.h"

#include <fmt/format.h>

#include <numbers>

namespace clothfit {
namespace {

/// Standard deviations of the pose within which gravity may end. Of a true statement one in 270,000
/// lies beyond.
constexpr double kBeyondStated = 5;
/// A smaller tilt, rad, is no contradiction: mesh, time step and calibration tilt that much, and it
/// moves a free sheet by a hundredth of its way. A higher value passes what a level shows.
constexpr double kTiltOfModels = 0.01;

}  // namespace

void warn_of_contradicted_pose(const TiltAgainstPose& tilt, const std::string& file,
                               FitReport& report) {
  if (!(tilt.sigmas > kBeyondStated && tilt.tilt_rad > kTiltOfModels)) return;
  report.result.contradicts_pose = true;
  report.result.warnings.push_back(
      {.check = "gravity",
       .state = FindingState::warning,
       .found =
           fmt::format("the cloth moves as if gravity lay {:.1f} degrees from its declared "
                       "direction, {:.0f} standard deviations of {}",
                       tilt.tilt_rad * 180 / std::numbers::pi, tilt.sigmas,
                       tilt.is_stated ? "the camera's pose"
                                      : "what is assumed of a camera's pose without covariance"),
       .where = file,
       .expected = fmt::format("at most {:g} standard deviations", kBeyondStated),
       .remedy = "check gravity, and whether the reference points or the board that the pose comes "
                 "from were level; a steady wind that is not declared looks alike"});
}

}  // namespace clothfit
