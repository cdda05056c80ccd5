// The table of the effects of the measurement.
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
      EXPECT_LT(parameter.lower, parameter.neutral);
      EXPECT_GT(parameter.upper, parameter.neutral);
      EXPECT_GT(parameter.typical, 0);
    }
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
