// Checks which effects of the measurement apply to which recordings. That fits refuse the others:
// in problem_test.cpp and, effect by effect, in measurement_contract.cpp.
#include "fit/measurement_effects/applicability.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "fit/measurement_effects/registry.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::set<std::string> inapplicable(const FitInput& input, const FitOptions& options) {
  const FitProblem problem = make_problem(input, options, 5, 5);
  std::set<std::string> names;
  for (const MeasurementEffectEntry& entry : measurement_effect_registry())
    if (why_inapplicable(*entry.make(), measurement_setting(problem))) names.insert(entry.name);
  return names;
}

TEST(Applicability, OfEffectsOfCamerasIsToPixels) {
  const FitInput input = synthetic_input({});
  EXPECT_THAT(inapplicable(input, {.observations = ObservationKind::tracks2d}), IsEmpty());
  EXPECT_THAT(inapplicable(input, {.observations = ObservationKind::tracks3d}),
              ElementsAre("focal_error", "lens_distortion", "rolling_shutter"));
}

TEST(Applicability, OfWhatLooksBetweenFramesIsNotToThePapersStrainLimit) {
  EXPECT_THAT(inapplicable(synthetic_input({}), {.observations = ObservationKind::tracks2d,
                                                 .spring_set = SpringSet::louchet5}),
              ElementsAre("clock_offset", "dropped_frames", "frame_rate_error", "rolling_shutter",
                          "temporal_smoothing"));
}

TEST(Applicability, IsToNoTrackedHeldPoint) {
  FitInput tracked = synthetic_input({});
  for (HeldPoint& point : tracked.recording.held) point.motion = HeldMotion::tracked;
  EXPECT_EQ(inapplicable(tracked, {}).size(), measurement_effect_registry().size());
}

}  // namespace
}  // namespace clothfit
