// Checks what the effects of the measurement say of fitted values in quantities of people. Not
// checked here: those of motion (tests/model/effects/effect_words_test.cpp).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "fit/measurement_effects/registry.h"
#include "model/cloth/fitted_effect.h"

namespace clothfit {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Says an effect's values, the others neutral, of a recording of 1.2 s at 60 Hz.
std::string measured_words(const std::string& effect, const std::string& mode,
                           const std::map<std::string, double>& values) {
  const EffectDescription description = measurement_effect_named(effect)->describe();
  FittedEffect found;
  found.mode = mode;
  for (const EffectParameter& parameter : description.parameters)
    found.values[parameter.name] = parameter.neutral;
  for (const auto& [name, value] : values) found.values.at(name) = value;
  found.begin_s = 0.3;
  found.end_s = 1.5;
  return description.in_words(found);
}

TEST(MeasurementEffectWords, AreNothingAtNeutralAndNumbersAwayFromItInEveryMode) {
  for (const MeasurementEffectEntry& entry : measurement_effect_registry()) {
    const EffectDescription effect = entry.describe();
    ASSERT_NE(effect.in_words, nullptr) << effect.name;
    std::vector<EffectMode> modes = effect.modes;
    if (modes.empty()) modes.push_back({.name = "", .amplitudes = {}, .shapes = {}});
    for (const EffectMode& mode : modes) {
      SCOPED_TRACE(effect.name + " " + mode.name);
      EXPECT_EQ(measured_words(effect.name, mode.name, {}), "");
      std::map<std::string, double> typical;
      for (const EffectParameter& parameter : effect.parameters)
        if (mode.amplitudes.empty() ||
            std::ranges::find(mode.amplitudes, parameter.name) != mode.amplitudes.end())
          typical[parameter.name] = parameter.neutral + parameter.typical;
      const std::string text = measured_words(effect.name, mode.name, typical);
      EXPECT_NE(text, "");
      EXPECT_THAT(text, Not(HasSubstr("nan")));
      EXPECT_THAT(text, Not(HasSubstr("inf")));
    }
  }
}

TEST(MeasurementEffectWords, TellHowTheCameraMoves) {
  EXPECT_EQ(measured_words("camera_drift", "shift", {{"velocity_x", 0.003}, {"velocity_y", 0.004}}),
            "6.00 mm towards (0.60, 0.80, 0.00) by the end");
  // 2 atan(0.012)
  EXPECT_EQ(measured_words("camera_drift", "turn", {{"turn_rate_z", 0.02}}),
            "1.38 degrees about (0.00, 0.00, 1.00) by the end");
  EXPECT_EQ(measured_words("camera_shake", "shift", {{"shift_x", -0.0012}, {"frequency", 12.5}}),
            "1.20 mm to either side along (-1.00, 0.00, 0.00), 12.5 times a second");
  EXPECT_EQ(measured_words("camera_shake", "turn", {{"turn_y", 0.01}, {"frequency", 12.5}}),
            "0.573 degrees to either side about (0.00, 1.00, 0.00), 12.5 times a second");
  EXPECT_EQ(measured_words("world_tilt", "", {{"about_x", 0.03}, {"about_y", 0.04}}),
            "what is measured is turned by 2.86 degrees about (0.60, 0.80, 0.00)");
}

TEST(MeasurementEffectWords, TellTimesInMillisecondsAndFrames) {
  EXPECT_EQ(measured_words("clock_offset", "", {{"time", 0.0125}}),
            "frames show the cloth 12.5 ms (0.750 frames) later than their times say");
  EXPECT_EQ(measured_words("clock_offset", "", {{"time", -0.0125}}),
            "frames show the cloth 12.5 ms (0.750 frames) earlier than their times say");
  EXPECT_EQ(measured_words("dropped_frames", "", {{"lost", 0.05}, {"from", 0.43}}),
            "3.00 frames lost 0.430 s after the first one");
  // A frame of 1/60 s shows the cloth of 1.014/60 s.
  EXPECT_EQ(measured_words("frame_rate_error", "", {{"excess", 0.014}}),
            "frames are 1.40 % longer than stated: 59.2 a second, stated 60.0");
  EXPECT_EQ(measured_words("rolling_shutter", "", {{"readout", 0.012}}),
            "12.0 ms from the top row to the bottom row");
  EXPECT_EQ(measured_words("rolling_shutter", "", {{"readout", -0.012}}),
            "12.0 ms from the bottom row to the top row");
  // A running mean of three frames has w = 1/3 and a variance of 2/3.
  EXPECT_EQ(measured_words("temporal_smoothing", "", {{"w", 1.0 / 3}}),
            "averaged over time with a standard deviation of 13.6 ms (0.816 frames)");
}

TEST(MeasurementEffectWords, TellSizesOfTheCamera) {
  EXPECT_EQ(measured_words("focal_error", "", {{"excess", -0.012}}),
            "the focal length is 1.20 % shorter than calibrated");
  EXPECT_EQ(measured_words("lens_distortion", "", {{"k1", 0.02}}),
            "half a focal length from the middle, pixels are 0.500 % further out");
  EXPECT_EQ(measured_words("scale", "", {{"factor", 0.985}}),
            "everything is measured 1.50 % smaller than it is");
}

TEST(MeasurementEffectWords, TellWhereThePatternLies) {
  EXPECT_EQ(measured_words("marker_placement", "shift", {{"shift_s", 0.003}, {"shift_t", -0.001}}),
            "the pattern lies 3.00 mm to the right and 1.00 mm up");
  EXPECT_EQ(
      measured_words("marker_placement", "stretch", {{"stretch_s", 0.005}, {"stretch_t", -0.002}}),
      "the pattern is 0.500 % wider, 0.200 % shorter than stated");
  EXPECT_EQ(measured_words("marker_placement", "turn", {{"turn", 0.01}}),
            "the pattern is turned by 0.573 degrees clockwise");
  EXPECT_EQ(measured_words("in_surface_sliding", "", {{"velocity_s", 0.005}}),
            "the pattern slides 6.00 mm to the right by the end");
}

}  // namespace
}  // namespace clothfit
