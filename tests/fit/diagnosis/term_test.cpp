// Effects by one of their laws, as additions to a recording. Not checked here: that every law names
// parameters of its effect (tests/model/effects/registry_test.cpp).
#include "fit/diagnosis/term.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "data/input_error.h"
#include "fit/problem.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

using ::testing::Contains;
using ::testing::Not;

const Term kDrag{.effect = "wind", .law = "drag", .amplitudes = {"c"}};
const Term kPressure{.effect = "wind", .law = "pressure", .amplitudes = {"q_x", "q_y", "q_z"}};
const Term kHem{.effect = "nonuniform_mass",
                .law = "hem",
                .amplitudes = {"hem"},
                .shape = {{"hem_width", 0.02}},
                .shape_sigma = {{"hem_width", 0.01}}};

std::vector<std::string> fitted_names(const FitInput& input) {
  std::vector<std::string> names;
  for (const FitParameter& parameter : make_problem(input, {}, 9, 9).space.parameters)
    names.push_back(parameter.name);
  return names;
}

std::vector<std::string> tested(const FitInput& input, const FitOptions& options = {}) {
  std::vector<std::string> titles;
  for (const LawShapes& law : laws_to_test(input, options, 0.5))
    titles.push_back(law.front().title());
  return titles;
}

TEST(Term, FreesItsAmplitudesAndHoldsTheRestOfItsEffect) {
  const FitInput input = synthetic_input({});
  const std::vector<std::string> names = fitted_names(with_terms(input, {kDrag}));

  EXPECT_THAT(names, Contains("wind.c"));
  EXPECT_THAT(names, Not(Contains("wind.q_x")));
}

TEST(Term, OfTheSameEffectJoinsTheOther) {
  const FitInput input = with_terms(synthetic_input({}), {kDrag, kPressure});

  EXPECT_EQ(std::ranges::count(input.recording.declared, "wind", &DeclaredEffect::name), 1);
  for (const char* name : {"wind.c", "wind.q_x", "wind.q_y", "wind.q_z"})
    EXPECT_THAT(fitted_names(input), Contains(name));
}

TEST(Term, FitsItsShapeOnlyWhereItSaysSo) {
  Term hem = kHem;
  EXPECT_THAT(fitted_names(with_terms(synthetic_input({}), {hem})),
              Not(Contains("nonuniform_mass.hem_width")));
  hem.fits_shape = true;
  EXPECT_THAT(fitted_names(with_terms(synthetic_input({}), {hem})),
              Contains("nonuniform_mass.hem_width"));
}

TEST(LawsToTest, AreThoseOfEffectsThatAreNotThereAlready) {
  FitInput input = synthetic_input({});
  EXPECT_THAT(tested(input), Contains("wind (pressure)"));
  EXPECT_THAT(tested(input), Contains("scale"));
  EXPECT_THAT(tested(input), Not(Contains("contact_plane")));  // where would it be?

  input.recording.declared.push_back({.name = "wind", .parameters = {}});
  EXPECT_THAT(tested(input, {.effects = {"gravity_tilt"}}), Not(Contains("wind (pressure)")));
  EXPECT_THAT(tested(input, {.effects = {"gravity_tilt"}}), Not(Contains("gravity_tilt")));
}

TEST(LawsToTest, AreNoneOfThoseThatNameNoCause) {
  FitInput input = synthetic_input({});
  for (const LawShapes& law : laws_to_test(input, {}, 0.5))
    EXPECT_FALSE(is_empirical(law.front().effect)) << law.front().title();

  const auto proposed = [&] {
    std::vector<std::string> titles;
    for (const Term& term : empirical_laws(input, {})) titles.push_back(term.title());
    return titles;
  };
  EXPECT_THAT(proposed(), Contains("force_law (drag)"));
  EXPECT_THAT(proposed(), Contains("tension_law (shear_stretched)"));
  EXPECT_THAT(proposed(), Not(Contains("wind (drag)")));
  input.recording.declared.push_back({.name = "force_law", .parameters = {}});
  EXPECT_THAT(proposed(), Not(Contains("force_law (drag)")));
}

TEST(LawsToTest, TryEachCombinationOfShapesWithFrequenciesInTheDuration) {
  for (const LawShapes& law : laws_to_test(synthetic_input({}), {}, 0.5)) {
    if (law.front().effect == "nonuniform_mass" && law.front().law == "patch") {
      EXPECT_EQ(law.size(), 18u);
    }
    if (law.front().effect == "nonuniform_mass" && law.front().law == "edges") {
      EXPECT_EQ(law.size(), 4u);  // widths of the hem, of all four edges at once
      EXPECT_EQ(law.front().amplitudes.size(), 4u);
    }
    if (law.front().effect == "gust") {
      EXPECT_EQ(law.size(), 48u);                       // 12 frequencies, 4 phases
      EXPECT_EQ(law.front().shape.at("frequency"), 1);  // half a turn in half a second
    }
    if (law.front().effect == "relaxation") {
      EXPECT_GT(law.front().shape_sigma.at("time"), 0);
    }
  }
}

TEST(DescribeEffect, KnowsThoseOfMotionAndOfTheMeasurementAndRefusesOthers) {
  EXPECT_EQ(describe_effect("wind").name, "wind");
  EXPECT_EQ(describe_effect("clock_offset").name, "clock_offset");
  EXPECT_THROW(describe_effect("aether"), InputError);
}

}  // namespace
}  // namespace clothfit
