// Checks effects by one of their modes, as additions to a recording. Not checked here: that every
// mode names parameters of its effect (tests/model/effects/registry_test.cpp).
#include "fit/diagnosis/catalogue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "data/input_error.h"
#include "fit/diagnosis/fitted_model.h"
#include "fit/problem/effects_of.h"
#include "fit/problem/problem.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Not;

const Hypothesis kDrag{.effect = "wind", .mode = "drag", .amplitudes = {"c"}};
const Hypothesis kPressure{
    .effect = "wind", .mode = "pressure", .amplitudes = {"q_x", "q_y", "q_z"}};
const Hypothesis kHem{.effect = "nonuniform_mass",
                      .mode = "hem",
                      .amplitudes = {"hem"},
                      .shape = {{"hem_width", 0.02}},
                      .shape_sigma = {{"hem_width", 0.01}}};

std::vector<std::string> fitted_names(const FitInput& input,
                                      const std::vector<Hypothesis>& hypotheses) {
  FitOptions options;
  options.hypotheses = hypotheses;
  std::vector<std::string> names;
  for (const FitParameter& parameter : make_problem(input, options, 9, 9).space.parameters)
    names.push_back(parameter.name);
  return names;
}

std::vector<std::string> tested(const FitInput& input, const FitOptions& options = {}) {
  std::vector<std::string> titles;
  for (const ShapeCandidates& mode : hypotheses_to_test(input, options, 0.5))
    titles.push_back(mode.front().title());
  return titles;
}

TEST(Hypothesis, FreesItsAmplitudesAndHoldsTheRestOfItsEffect) {
  const FitInput input = synthetic_input({});
  const std::vector<std::string> names = fitted_names(input, {kDrag});

  EXPECT_THAT(names, Contains("wind.c"));
  EXPECT_THAT(names, Not(Contains("wind.q_x")));
}

TEST(Hypothesis, OfTheSameEffectJoinsTheOther) {
  const FitInput input = synthetic_input({});
  const std::vector<Hypothesis> both{kDrag, kPressure};

  EXPECT_EQ(std::ranges::count(effects_of(input.recording, both), "wind", &DeclaredEffect::name),
            1);
  for (const char* name : {"wind.c", "wind.q_x", "wind.q_y", "wind.q_z"})
    EXPECT_THAT(fitted_names(input, both), Contains(name));
}

TEST(Hypothesis, FitsItsShapeOnlyWhereItSaysSo) {
  Hypothesis hem = kHem;
  EXPECT_THAT(fitted_names(synthetic_input({}), {hem}), Not(Contains("nonuniform_mass.hem_width")));
  hem.fits_shape = true;
  EXPECT_THAT(fitted_names(synthetic_input({}), {hem}), Contains("nonuniform_mass.hem_width"));
}

TEST(Hypothesis, FitsAShapeThatItsEffectsOtherModeFits) {
  Hypothesis edges = kHem, hem = kHem;
  edges.mode = "edges";
  edges.amplitudes = {"hem_left", "hem_right", "hem_top", "hem_bottom"};
  edges.fits_shape = true;
  const FitInput input = synthetic_input({});
  const std::vector<FitInput> inputs = {input};
  const FitOptions options;
  const DiagnosisSetup setup{.inputs = inputs, .options = options, .columns = 9, .rows = 9};
  for (const bool both : {false, true}) {
    hem.fits_shape = both;
    for (const std::vector<Hypothesis>& hypotheses :
         {std::vector{edges, hem}, std::vector{hem, edges}}) {
      const auto problems = problems_of(setup, hypotheses);

      EXPECT_GE(problems.front()->space.index("nonuniform_mass.hem_width"), 0);
      EXPECT_EQ(options_with(setup, hypotheses, 0).priors.size(), 1);
    }
  }
}

TEST(AtShapesOf, AreThoseOfTheEffectsOtherMode) {
  ShapeCandidates hem(3, kHem);
  for (size_t k = 0; k < hem.size(); ++k) hem[k].shape["hem_width"] = 0.01 * static_cast<double>(k);
  Hypothesis edges = kHem;
  edges.mode = "edges";
  const auto widths = [&](const std::vector<Hypothesis>& hypotheses,
                          const std::map<std::string, double>& values) {
    std::vector<double> result;
    for (const Hypothesis& shape : at_shapes_of(hypotheses, values, hem))
      result.push_back(shape.shape.at("hem_width"));
    return result;
  };

  EXPECT_THAT(widths({kDrag}, {}), ElementsAre(0, 0.01, 0.02));
  edges.shape["hem_width"] = 0.004;
  EXPECT_THAT(widths({kDrag, edges}, {}), ElementsAre(0.004));
  edges.fits_shape = true;
  EXPECT_THAT(widths({edges}, {{"nonuniform_mass.hem_width", 0.003}}), ElementsAre(0.003));
}

TEST(Hypothesis, NeverFitsWhatPicks) {
  const Hypothesis single{.effect = "support_drift",
                          .mode = "single",
                          .amplitudes = {"velocity_x"},
                          .shape = {},
                          .shape_sigma = {},
                          .fits_shape = true,
                          .picked = {{"point", 2}}};
  EXPECT_EQ(single.title(), "support_drift (single, held point 2)");
  const FitInput input = synthetic_input({});
  FitOptions options;
  options.hypotheses = {single};
  const FitProblem problem = make_problem(input, options, 9, 9);

  EXPECT_GE(problem.space.index("support_drift.velocity_x"), 0);
  EXPECT_EQ(problem.space.index("support_drift.point"), -1);
  EXPECT_EQ(problem.effects.back().back().constant, 2);

  options = {.effects = {"support_drift"}};
  EXPECT_EQ(make_problem(input, options, 9, 9).space.index("support_drift.point"), -1);
}

TEST(ShapesAround, LeaveWhatPicksAsItIs) {
  for (const ShapeCandidates& mode : hypotheses_to_test(synthetic_input({}), {}, 0.5)) {
    if (mode.front().mode != "single") continue;
    SCOPED_TRACE(mode.front().effect);
    const ShapeCandidates around = shapes_around(mode.back(), 0.5);
    EXPECT_EQ(around.empty(), mode.back().shape.empty());
    for (const Hypothesis& moved : around) EXPECT_EQ(moved.picked, mode.back().picked);
  }
}

TEST(AtShapesOf, KeepEachHeldPoint) {
  const std::vector<ShapeCandidates> modes = hypotheses_to_test(synthetic_input({}), {}, 0.5);
  const auto single = std::ranges::find_if(modes, [](const ShapeCandidates& mode) {
    return mode.front().effect == "support_drift" && mode.front().mode == "single";
  });
  ASSERT_NE(single, modes.end());
  EXPECT_EQ(at_shapes_of({kDrag}, {}, *single).size(), 2u);
}

TEST(HypothesesToTest, AskSingleHeldPointsWhereThereAreTwoThatAnEffectActsOn) {
  FitInput input = synthetic_input({});
  const auto points = [&](const std::string& effect) {
    std::set<int> numbers;
    for (const ShapeCandidates& mode : hypotheses_to_test(input, {}, 0.5))
      if (mode.front().effect == effect && mode.front().mode == "single")
        for (const Hypothesis& shape : mode) numbers.insert(shape.picked.at("point"));
    return std::vector<int>(numbers.begin(), numbers.end());
  };
  const std::vector<HeldPoint> two = input.recording.held;
  ASSERT_EQ(two.size(), 2u);

  for (const char* effect :
       {"support_drift", "support_motion", "support_move", "support_path", "support_slip"})
    EXPECT_THAT(points(effect), ElementsAre(1, 2)) << effect;
  EXPECT_TRUE(points("support_offset").empty());  // no point is driven

  input.recording.held[1].motion = HeldMotion::path;
  EXPECT_TRUE(points("support_offset").empty());
  input.recording.held.push_back(input.recording.held[1]);
  EXPECT_THAT(points("support_offset"), ElementsAre(2, 3));

  input.recording.held = {two[0]};
  EXPECT_TRUE(points("support_drift").empty());
  input.recording.held = {two[0], {.at_m = {}, .edge = ClothEdge::bottom, .file = {}}, two[1]};
  EXPECT_TRUE(points("support_drift").empty());
}

TEST(HypothesesToTest, AreThoseOfEffectsThatAreNotThereAlready) {
  FitInput input = synthetic_input({});
  EXPECT_THAT(tested(input), Contains("wind (pressure)"));
  EXPECT_THAT(tested(input), Contains("scale"));
  EXPECT_THAT(tested(input), Not(Contains("contact_plane")));  // where would it be?

  input.recording.declared.push_back({.name = "wind", .parameters = {}});
  EXPECT_THAT(tested(input, {.effects = {"gravity_tilt"}}), Not(Contains("wind (pressure)")));
  EXPECT_THAT(tested(input, {.effects = {"gravity_tilt"}}), Not(Contains("gravity_tilt")));
}

TEST(HypothesesToTest, AreNoneOfThoseThatNameNoCause) {
  FitInput input = synthetic_input({});
  for (const ShapeCandidates& mode : hypotheses_to_test(input, {}, 0.5))
    EXPECT_FALSE(describe_effect(mode.front().effect).empirical) << mode.front().title();

  const auto proposed = [&] {
    std::vector<std::string> titles;
    for (const Hypothesis& hypothesis : empirical_hypotheses(input, {}))
      titles.push_back(hypothesis.title());
    return titles;
  };
  EXPECT_THAT(proposed(), Contains("force_law (drag)"));
  EXPECT_THAT(proposed(), Contains("tension_law (shear_stretched)"));
  EXPECT_THAT(proposed(), Not(Contains("wind (drag)")));
  input.recording.declared.push_back({.name = "force_law", .parameters = {}});
  EXPECT_THAT(proposed(), Not(Contains("force_law (drag)")));
}

TEST(HypothesesToTest, TryEachCombinationOfShapesWithFrequenciesInTheDuration) {
  for (const ShapeCandidates& mode : hypotheses_to_test(synthetic_input({}), {}, 0.5)) {
    if (mode.front().effect == "nonuniform_mass" && mode.front().mode == "patch") {
      EXPECT_EQ(mode.size(), 18u);
    }
    if (mode.front().effect == "nonuniform_mass" && mode.front().mode == "edges") {
      EXPECT_EQ(mode.size(), 4u);  // widths of the hem, of all four edges at once
      EXPECT_EQ(mode.front().amplitudes.size(), 4u);
    }
    if (mode.front().effect == "gust") {
      EXPECT_EQ(mode.size(), 48u);                       // 12 frequencies, 4 phases
      EXPECT_EQ(mode.front().shape.at("frequency"), 1);  // half a turn in half a second
    }
    if (mode.front().effect == "wind_field" && mode.front().mode == "pulse") {
      EXPECT_EQ(mode.size(), 24u);  // 6 frequencies, 4 phases
    }
    if (mode.front().effect == "relaxation") {
      EXPECT_GT(mode.front().shape_sigma.at("time"), 0);
    }
  }
}

// Of a pulse at another phase a part stays as it is. It is no sum of those at two phases.
TEST(IsHarmonic, HoldsForAWindOfBothSignsAndNotForPulses) {
  std::set<std::string> harmonic, other;
  for (const ShapeCandidates& mode : hypotheses_to_test(synthetic_input({}), {}, 0.5))
    if (mode.front().effect == "wind_field")
      (is_harmonic(mode.front()) ? harmonic : other).insert(mode.front().mode);

  EXPECT_THAT(harmonic, ElementsAre("harmonic"));
  EXPECT_THAT(other, ElementsAre("cloth", "pulse", "world"));
}

TEST(DescribeEffect, KnowsThoseOfMotionAndOfTheMeasurementAndRefusesOthers) {
  EXPECT_EQ(describe_effect("wind").name, "wind");
  EXPECT_EQ(describe_effect("clock_offset").name, "clock_offset");
  EXPECT_THROW(describe_effect("aether"), InputError);
}

}  // namespace
}  // namespace clothfit
