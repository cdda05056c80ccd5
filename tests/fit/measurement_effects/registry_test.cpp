// Checks the table of the effects of the measurement.
#include "fit/measurement_effects/registry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "data/input_error.h"
#include "model/effects/registry.h"

namespace clothfit {
namespace {

TEST(MeasurementEffectRegistry, IsSortedAndNamesWhatItDescribes) {
  EXPECT_TRUE(std::ranges::is_sorted(
      measurement_effect_registry(), {},
      [](const MeasurementEffectEntry& entry) { return std::string(entry.name); }));
  for (const MeasurementEffectEntry& entry : measurement_effect_registry()) {
    SCOPED_TRACE(entry.name);
    const EffectDescription description = entry.describe();
    EXPECT_EQ(description.name, entry.name);
    EXPECT_FALSE(description.summary.empty());
    for (const EffectParameter& parameter : description.parameters) {
      EXPECT_LE(parameter.lower, parameter.neutral);
      EXPECT_GT(parameter.upper, parameter.neutral);
      EXPECT_GT(parameter.typical, 0);
    }
  }
}

TEST(MeasurementEffectRegistry, MakesEveryModeOfItsEffectsParametersWithinTheirRanges) {
  for (const MeasurementEffectEntry& entry : measurement_effect_registry()) {
    const EffectDescription effect = entry.describe();
    std::set<std::string> in_no_mode;
    for (const EffectParameter& parameter : effect.parameters) in_no_mode.insert(parameter.name);
    bool has_shapes = false;
    for (const EffectMode& mode : effect.modes) {
      SCOPED_TRACE(effect.name + " " + mode.name);
      EXPECT_FALSE(mode.amplitudes.empty());
      for (const std::string& amplitude : mode.amplitudes)
        EXPECT_EQ(in_no_mode.erase(amplitude), 1u) << amplitude;
      for (const ShapeGrid& shape : mode.shapes) {
        has_shapes = true;
        const auto found =
            std::ranges::find(effect.parameters, shape.parameter, &EffectParameter::name);
        ASSERT_NE(found, effect.parameters.end()) << shape.parameter;
        EXPECT_FALSE(shape.values.empty());
        for (const double value : shape.values) {
          EXPECT_GE(value, shape.of_duration ? 0 : found->lower);
          EXPECT_LE(value, shape.of_duration ? 1 : found->upper);
        }
      }
    }
    for (const EffectMode& mode : effect.modes)
      for (const ShapeGrid& shape : mode.shapes) in_no_mode.erase(shape.parameter);
    EXPECT_TRUE(effect.modes.empty() || in_no_mode.empty()) << effect.name;
    EXPECT_EQ(effect.test == EffectTest::profiled, has_shapes) << effect.name;
  }
}

TEST(MeasurementEffectRegistry, SharesNoNameWithTheEffectsOfMotion) {
  std::set<std::string> names;
  for (const EffectEntry& entry : effect_registry()) names.insert(entry.name);
  for (const MeasurementEffectEntry& entry : measurement_effect_registry())
    EXPECT_TRUE(names.insert(entry.name).second) << entry.name;
}

TEST(MeasurementEffectRegistry, KnowsBothKindsAndRefusesOthers) {
  EXPECT_NO_THROW(require_effect("wind", "test"));
  EXPECT_NO_THROW(require_effect("scale", "test"));
  EXPECT_THROW(require_effect("winds", "test"), InputError);
  EXPECT_EQ(measurement_effect_named("wind"), nullptr);
}

}  // namespace
}  // namespace clothfit
