// Checks searches on a coarser mesh and in another basin. The steps have files of their own, from
// beam_test.cpp to worth_test.cpp. Whole searches: planting_test.cpp, diagnose_test.cpp.
#include "fit/diagnosis/search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "fit/diagnosis/discretisation.h"
#include "tests/data/whole_runs.h"
#include "tests/fit/diagnosis/true_model.h"

namespace clothfit {
namespace {

constexpr double kSquares = std::numeric_limits<double>::infinity();

/// A cloth that bounces a few times, so that a stiffer one fits it in another basin.
const SyntheticCloth kBouncing{.mesh = 7, .markers = 5, .frames = 60, .held_out_from = 48};

FitOptions short_search() {
  FitOptions options;
  options.generations = 10;
  options.population = 40;
  options.refine_best = 1;
  return options;
}

/// Returns the model without hypotheses in that basin.
FittedModel stiffer(const DiagnosisSetup& setup, SyntheticCloth cloth) {
  constexpr double kStiffer = 6;
  for (double* stiffness : {&cloth.fabric.tension_warp_n_per_m, &cloth.fabric.tension_weft_n_per_m,
                            &cloth.fabric.shear_n_per_m})
    *stiffness *= kStiffer;
  FittedModel model = true_model(setup, cloth);
  refine_model(model, setup, {}, {});
  refine_with_discretisation(model, setup, {});
  return model;
}

SearchOptions only(const Hypothesis& hypothesis) {
  return {.hypotheses = {{hypothesis}}, .beam_width = 1, .most_effects = 1, .threshold = kSquares};
}

TEST(SearchHypotheses, LeavesABasinRatherThanNameAnEffectForIt) {
  CLOTHFIT_ONLY_IN_WHOLE_RUNS();
  const FitInput input = synthetic_input(kBouncing);
  const FitOptions options = short_search();
  const DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 7, .rows = 7};
  const FittedModel base = stiffer(setup, kBouncing);
  ASSERT_TRUE(base.usable());
  const auto count = static_cast<double>(base.residual_count());
  ASSERT_GT(base.chi_square(kSquares), 20 * count);

  const Hypothesis tilt{.effect = "gravity_tilt", .mode = "", .amplitudes = {"about_x", "about_y"}};
  const SearchResult found = search_hypotheses(setup, base, only(tilt), {});

  EXPECT_TRUE(found.accepted.empty());
  ASSERT_TRUE(found.base.usable());
  EXPECT_LT(found.base.chi_square(kSquares), 1.2 * count);
  EXPECT_LT(found.model.chi_square(kSquares), 1.2 * count);
}

/// Returns a cloth in thick air.
SyntheticCloth in_thick_air(int mesh, int markers) {
  return {
      .drag_rate_per_s = 3, .mesh = mesh, .markers = markers, .frames = 20, .held_out_from = 16};
}

/// Returns the values that a coarser mesh finds which knows nothing of the air.
std::vector<NamedValues> found_without_air(const DiagnosisSetup& setup,
                                           const SyntheticCloth& cloth) {
  FittedModel coarse = true_model(with_coarse_mesh(setup), cloth);
  refine_model(coarse, with_coarse_mesh(setup), {}, {});
  EXPECT_TRUE(coarse.usable());
  return coarse.values();
}

FittedModel grossly_misfitting(const DiagnosisSetup& setup,
                               const std::vector<NamedValues>& values) {
  FittedModel model = model_at(setup, {}, values);
  linearise_model(model);
  model.state = FitState::unrefined;
  EXPECT_TRUE(model.misfits_grossly());
  return model;
}

// The mesh of half the cells, on which this one's errors are estimated, has few vertices.
TEST(SearchHypotheses, ChoosesAHypothesisForAGrosslyMisfittingModelOnACoarserMesh) {
  const SyntheticCloth cloth = in_thick_air(13, 4);
  const FitInput input = synthetic_input(cloth);
  const FitOptions options = short_search();
  const DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 13, .rows = 13};
  const FittedModel base = grossly_misfitting(setup, found_without_air(setup, cloth));

  const SearchResult found = search_hypotheses(setup, base, only(drag_hypothesis()), {});

  ASSERT_EQ(found.accepted.size(), 1u);
  EXPECT_NEAR(found.model.values().front().at("viscous_damping.rate"), 3, 0.1);
  EXPECT_LT(found.model.chi_square(kSquares),
            1.2 * static_cast<double>(found.model.residual_count()));
  // The trial's decrease is from the model without the hypothesis, as that is reported.
  const FittedModel& without = found.base.usable() ? found.base : base;
  EXPECT_NEAR(found.accepted.front().trial.decrease,
              without.chi_square(kSquares) - found.model.chi_square(kSquares),
              0.01 * without.chi_square(kSquares));
}

TEST(SearchHypotheses, RefinesAGrosslyMisfittingModelOnItsOwnMeshWhereNoHypothesisIsFound) {
  const SyntheticCloth cloth = in_thick_air(7, 5);
  const FitInput input = synthetic_input(cloth);
  const FitOptions options = short_search();
  const DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 7, .rows = 7};
  std::vector<NamedValues> elsewhere = found_without_air(setup, cloth);
  elsewhere.front().at("shear") *= 0.7;
  const FittedModel off = grossly_misfitting(setup, elsewhere);

  const SearchResult refined =
      search_hypotheses(setup, off, {.beam_width = 1, .threshold = kSquares}, {});

  ASSERT_TRUE(refined.base.usable());
  EXPECT_FALSE(refined.base.is_unrefined());
  EXPECT_LT(refined.base.chi_square(kSquares), off.chi_square(kSquares));
}

TEST(SearchHypotheses, CreditsAHypothesisWithWhatItExplainsAndNotWithTheBasin) {
  SyntheticCloth cloth = kBouncing;
  cloth.drag_rate_per_s = 1.5;
  cloth.markers = 4;
  cloth.frames = 44;
  cloth.held_out_from = 36;
  const FitInput input = synthetic_input(cloth);
  const FitOptions options = short_search();
  const DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 7, .rows = 7};
  const FittedModel base = stiffer(setup, cloth);
  ASSERT_TRUE(base.usable());

  const SearchResult found = search_hypotheses(setup, base, only(drag_hypothesis()), {});

  ASSERT_EQ(found.accepted.size(), 1u);
  const Trial& drag = found.accepted.front().trial;
  EXPECT_EQ(drag.hypothesis.effect, "viscous_damping");
  EXPECT_NEAR(found.model.values().front().at("viscous_damping.rate"), 1.5, 0.1);
  ASSERT_TRUE(found.base.usable());
  const double without = found.base.chi_square(kSquares);
  EXPECT_LT(without, 0.5 * base.chi_square(kSquares));
  EXPECT_NEAR(drag.decrease, without - found.model.chi_square(kSquares), 0.05 * without);
}

}  // namespace
}  // namespace clothfit
