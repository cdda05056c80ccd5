// Checks the table of effects. Not checked here: each effect by itself (a file of its own in this
// folder, with the contract in effect_contract.h).

#include "model/effects/registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "data/input_error.h"
#include "model/cloth/cloth.h"
#include "tests/model/effect_contract.h"

namespace clothfit {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

TEST(EffectRegistry, ListsEffectsInAlphabeticalOrderEachOnce) {
  const auto effects = effect_registry();

  ASSERT_FALSE(effects.empty());
  for (size_t n = 1; n < effects.size(); ++n)
    EXPECT_LT(std::string(effects[n - 1].name), effects[n].name);
}

TEST(EffectRegistry, EveryEffectKeepsTheContract) {
  for (const EffectEntry& entry : effect_registry()) expect_effect_contract(entry.name, {});
}

TEST(EffectRegistry, EveryModeIsMadeOfItsEffectsParametersWithinTheirRanges) {
  for (const EffectEntry& entry : effect_registry()) {
    const EffectDescription effect = entry.describe();
    const auto parameter = [&](const std::string& name) {
      return std::ranges::find(effect.parameters, name, &EffectParameter::name);
    };
    for (const EffectMode& mode : effect.modes) {
      SCOPED_TRACE(effect.name + " " + mode.name);
      EXPECT_FALSE(mode.amplitudes.empty());
      for (const std::string& amplitude : mode.amplitudes)
        EXPECT_NE(parameter(amplitude), effect.parameters.end()) << amplitude;
      for (const ShapeGrid& shape : mode.shapes) {
        const auto found = parameter(shape.parameter);
        ASSERT_NE(found, effect.parameters.end()) << shape.parameter;
        EXPECT_THAT(mode.amplitudes, Not(Contains(shape.parameter)));
        EXPECT_EQ(shape.per_held_point, found->picks);
        EXPECT_EQ(shape.values.empty(), shape.per_held_point || shape.from_pushes);
        if (shape.per_duration) continue;
        for (const double value : shape.values) {
          EXPECT_GE(value, found->lower);
          EXPECT_LE(value, found->upper);
        }
      }
    }
  }
}

// A coefficient without a place would be missing from the law that a diagnosis writes.
TEST(EffectRegistry, GivesCoefficientsOfEmpiricalEffectsAndNoOthersAPlaceInALaw) {
  for (const EffectEntry& entry : effect_registry()) {
    const EffectDescription effect = entry.describe();
    for (const EffectParameter& parameter : effect.parameters) {
      SCOPED_TRACE(effect.name + "." + parameter.name);
      EXPECT_EQ(parameter.law_side.empty(), !effect.empirical);
      EXPECT_EQ(parameter.law_factor.empty(), !effect.empirical);
    }
  }
}

TEST(EffectRegistry, FindsEveryEffectByItsName) {
  for (const EffectEntry& entry : effect_registry()) {
    EXPECT_EQ(find_effect(entry.name, "test").make, entry.make);
    Cloth cloth = touched_cloth(3);
    add_effect(cloth, entry.name, "test");
    EXPECT_EQ(cloth.effect_descriptions.at(0).name, entry.name);
    EXPECT_NE(cloth.effects.at(0), nullptr);
  }
}

TEST(EffectRegistry, RefusesAnUnknownNameAndListsTheKnownOnes) {
  Cloth cloth = square_cloth(3);
  for (const char* name : {"viscous", "Viscous_damping", ""}) {
    SCOPED_TRACE(name);
    try {
      add_effect(cloth, name, "recording.yaml:31");
      FAIL() << "accepted";
    } catch (const InputError& error) {
      const std::string text = error.what();
      EXPECT_THAT(text, HasSubstr("recording.yaml:31"));
      EXPECT_THAT(text, HasSubstr("'" + std::string(name) + "'"));
      for (const EffectEntry& entry : effect_registry()) EXPECT_THAT(text, HasSubstr(entry.name));
    }
    EXPECT_TRUE(cloth.effects.empty());
    EXPECT_TRUE(cloth.effect_descriptions.empty());
  }
}

TEST(EffectRegistry, ContactWithAMeshIsRefusedWithoutOne) {
  Cloth cloth = square_cloth(3);
  try {
    add_effect(cloth, "contact_mesh", "recording.yaml:7");
    FAIL() << "it would do nothing without a word";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("recording.yaml:7"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("`obstacle: FILE.obj`"), std::string::npos);
  }
  EXPECT_TRUE(cloth.effects.empty());
}

}  // namespace
}  // namespace clothfit
