// Checks forces without a law: their derivatives, and what they predict of frames left out. Not
// checked here: the other corrections without physics (cross_validation_test.cpp).
#include "fit/diagnosis/free_forces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <vector>

#include "fit/diagnosis/cross_validation.h"
#include "fit/diagnosis/horizons.h"
#include "fit/diagnosis/refit.h"
#include "fit/diagnosis/search.h"
#include "tests/fit/diagnosis/true_model.h"
#include "tests/fit/hidden_effect.h"

namespace clothfit {
namespace {

constexpr double kFreeForcesSquares = std::numeric_limits<double>::infinity();
constexpr int kBlocks = 5, kStretches = 10;
const FitOptions kFreeForcesOptions = [] {
  FitOptions options;
  options.loss = Loss::squared;
  options.generations = 10;
  options.population = 40;
  options.refine_best = 1;
  return options;
}();

DiagnosisSetup setup_of(std::span<const FitInput> inputs, int mesh = 9) {
  return {.inputs = inputs, .options = kFreeForcesOptions, .columns = mesh, .rows = mesh};
}

/// Makes a push that is the same everywhere and always: gravity out of the vertical, a hundredth of
/// it and more.
DeclaredEffect hidden_tilt(double about_x_rad) {
  DeclaredEffect tilt{.name = "gravity_tilt", .parameters = {}};
  tilt.parameters = {{"about_x", {about_x_rad}}, {"about_y", {0.01}}};
  return tilt;
}

const Hypothesis kTilt{.effect = "gravity_tilt", .mode = "", .amplitudes = {"about_x", "about_y"}};

/// Fits the model without what is hidden to its own optimum.
FittedModel fitted(const DiagnosisSetup& setup) {
  FittedModel model = model_at(
      setup, {}, std::vector<NamedValues>(setup.inputs.size(), named(SyntheticCloth{}.fabric)));
  refine_model(model, setup, {}, {});
  EXPECT_TRUE(model.usable());
  return model;
}

CrossValidation with_forces(const DiagnosisSetup& setup, const FittedModel& model) {
  return cross_validate(setup, model, kBlocks, kFreeForcesSquares, false, &setup);
}

/// Differentiates a model's residuals by a push that is there in its runs, along one of the world's
/// axes. Differences are central.
Eigen::VectorXd by_push(const FittedModel& model, int waves_along_s, int waves_along_t,
                        double from_s, double until_s, size_t axis) {
  const PooledPart& part = model.parts.front();
  FitProblem pushed = *model.problems.front();
  pushed.cloth.effects.push_back(
      make_free_force(pushed.cloth, waves_along_s, waves_along_t, from_s, until_s));
  pushed.cloth.effect_descriptions.push_back(
      {.name = "push", .summary = "", .parameters = {{"x"}, {"y"}, {"z"}}});
  pushed.effects.emplace_back(3);
  const auto residual_at = [&](double push_m_per_s2) {
    pushed.effects.back()[axis].constant = push_m_per_s2;
    return TrajectoryObjective(pushed, part.frames, part.steps).residuals({part.values}).front();
  };
  constexpr double kStep = 1e-3;
  return (residual_at(kStep) - residual_at(-kStep)) / (2 * kStep);
}

/// The products of waves, in their order.
struct Product {
  int waves_along_s = 0, waves_along_t = 0;
};
constexpr Product kProducts[] = {{0, 0}, {0, 1}, {0, 2}, {1, 0}, {1, 1}, {2, 0}};

TEST(FreeForces, HaveTheDerivativesOfASimulationThatIsPushedLikeThat) {
  for (const StartKind start : {StartKind::released_flat, StartKind::at_rest}) {
    SCOPED_TRACE(start == StartKind::at_rest ? "at rest" : "released flat");
    FitInput input = synthetic_input({});
    input.recording.start = start;
    const DiagnosisSetup setup = setup_of({&input, 1});
    FittedModel model = model_at(setup, {}, {named(SyntheticCloth{}.fabric)});
    linearise_model(model);
    ASSERT_TRUE(model.usable());

    const FreeForces forces = free_forces(setup, model, kStretches);

    ASSERT_TRUE(forces.usable());
    ASSERT_EQ(forces.columns.size(), 1u);
    const Eigen::MatrixXd& columns = forces.columns.front();
    ASSERT_EQ(columns.cols(), kStretches * FreeForces::kInStretch);
    const auto column = [&](int stretch, size_t product, size_t axis) {
      return columns.col(stretch * FreeForces::kInStretch + static_cast<int>(3 * product + axis));
    };
    // A stretch begins to act on the way to its first frame.
    const auto begin_s = [&](int stretch) {
      const PooledPart& part = model.parts.front();
      int frame = 0;
      while (FreeForces::stretch_of(frame, part.frames, kStretches) < stretch) ++frame;
      return model.problems.front()->frame_time_s[static_cast<size_t>(frame - 1)];
    };
    for (size_t product = 0; product < std::size(kProducts); ++product) {
      SCOPED_TRACE(product);
      const auto [along_s, along_t] = kProducts[product];
      const size_t axis = product % 3;
      const auto expect_near = [&](const Eigen::VectorXd& found, double from_s, double until_s,
                                   double within) {
        const Eigen::VectorXd expected = by_push(model, along_s, along_t, from_s, until_s, axis);
        ASSERT_GT(expected.norm(), 0.1);
        EXPECT_LT((found - expected).norm(), within * expected.norm());
      };
      // An emerging force's beginning and end are known to a millisecond (kEmergingInterval_s). A
      // stretch lasts 43.
      constexpr double kNearEnds = 0.03;
      expect_near(column(0, product, axis), -kFreeForcesSquares, begin_s(1), kNearEnds);
      expect_near(column(5, product, axis), begin_s(5), begin_s(6), kNearEnds);
      expect_near(column(9, product, axis), begin_s(9), kFreeForcesSquares, kNearEnds);
      // All stretches together are a push that never begins nor ends. Differences err by the square
      // of the step.
      Eigen::VectorXd sum = Eigen::VectorXd::Zero(columns.rows());
      for (int stretch = 0; stretch < kStretches; ++stretch) sum += column(stretch, product, axis);
      expect_near(sum, -kFreeForcesSquares, kFreeForcesSquares, 1e-4);
    }
  }
}

// The residual is exactly what a force does that never changes. Held, it is predicted everywhere.
TEST(FreeForces, PredictAForceThatStaysAsItIs) {
  const FitInput input = synthetic_input({});
  const DiagnosisSetup setup = setup_of({&input, 1});
  FittedModel model = true_model(setup, {});
  const FreeForces forces = free_forces(setup, model, kStretches);
  ASSERT_TRUE(forces.usable());
  Eigen::VectorXd push_m_per_s2(FreeForces::kInStretch);
  for (Eigen::Index k = 0; k < push_m_per_s2.size(); ++k)
    push_m_per_s2[k] = 0.1 * std::cos(static_cast<double>(k));
  model.parts.front().linear.residual =
      forces.columns.front() * push_m_per_s2.replicate(kStretches, 1);

  const CrossValidation validated = with_forces(setup, model);

  EXPECT_GT(validated.mean, 1);
  EXPECT_LT(validated.free_forces, 1e-3 * validated.mean);
}

// A force begins only where the last block does. What came before says nothing of it, so nothing of
// what it does there is predicted. Where the other blocks are left out it is seen.
TEST(FreeForces, HoldTheLastValueBeforeABlockThroughoutIt) {
  const FitInput input = synthetic_input({});
  const DiagnosisSetup setup = setup_of({&input, 1});
  FittedModel model = true_model(setup, {});
  const FreeForces forces = free_forces(setup, model, kStretches);
  ASSERT_TRUE(forces.usable());
  Eigen::VectorXd push_m_per_s2 =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(kStretches) * FreeForces::kInStretch);
  push_m_per_s2.tail(2 * FreeForces::kInStretch).setConstant(5);
  const Eigen::VectorXd done = forces.columns.front() * push_m_per_s2;
  model.parts.front().linear.residual = done;

  const CrossValidation validated = with_forces(setup, model);

  const double in_all = done.squaredNorm() / static_cast<double>(done.size());
  ASSERT_GT(in_all, 1);
  EXPECT_NEAR(validated.free_forces, in_all, 1e-3 * in_all);
}

TEST(FreeForces, PredictAPushThatTheModelLacksAndItsEffectPredictsItBetter) {
  const FitInput input = moved_by(hidden_tilt(0.02), synthetic_input({}));
  const DiagnosisSetup setup = setup_of({&input, 1});
  const FittedModel without = fitted(setup);
  FittedModel with_tilt = with_hypotheses(setup, without, {kTilt}, {});
  refine_model(with_tilt, setup, {}, {});
  ASSERT_TRUE(with_tilt.usable());

  const CrossValidation before = with_forces(setup, without), after = with_forces(setup, with_tilt);

  EXPECT_LT(before.free_forces, 0.5 * before.mean);
  EXPECT_LT(before.free_forces, std::min(before.constant_offset, before.last_residual));
  EXPECT_LT(after.mean, 0.95 * before.free_forces);
  EXPECT_LT(after.mean, 1.1);
}

// The best of their sizes gains by chance at most what a few of some thousand numbers are.
TEST(FreeForces, AreNoBetterThanNothingWhereNothingIsHidden) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    SCOPED_TRACE(seed);
    const FitInput input = synthetic_input({.seed = seed});
    const DiagnosisSetup setup = setup_of({&input, 1});

    const CrossValidation validated = with_forces(setup, fitted(setup));

    EXPECT_GT(validated.free_forces, 0.995 * validated.mean);
    EXPECT_LT(validated.free_forces, 1.02 * validated.mean);  // they may be as small as that
  }
}

TEST(FreeForces, AreFoundWithTheDerivativesOfACoarserMesh) {
  const SyntheticCloth cloth{.drag_rate_per_s = 0.5, .mesh = 13};
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = setup_of({&input, 1}, 13), coarse = setup_of({&input, 1}, 7);
  const FittedModel model = fitted(setup);

  const double fine = with_forces(setup, model).free_forces,
               by_coarse = cross_validate(setup, model, kBlocks, kFreeForcesSquares, false, &coarse)
                               .free_forces;

  EXPECT_NEAR(by_coarse, fine, 0.2 * fine);
}

// Pushed in opposite ways the two recordings cannot be corrected by one force.
TEST(FreeForces, AreEachRecordingsOwn) {
  const std::vector<FitInput> inputs{moved_by(hidden_tilt(0.02), synthetic_input({})),
                                     moved_by(hidden_tilt(-0.02), synthetic_input({}))};
  const DiagnosisSetup setup = setup_of(inputs);
  const FittedModel model = fitted(setup);

  const CrossValidation validated = with_forces(setup, model);

  EXPECT_LT(validated.free_forces, 0.3 * validated.mean);
}

TEST(FreeForces, OfARecordingThatIsLeftOutAreNotKnown) {
  const std::vector<FitInput> inputs{synthetic_input({.seed = 1}), synthetic_input({.seed = 2})};
  const DiagnosisSetup setup = setup_of(inputs);
  const FittedModel model = true_model(setup, {});

  EXPECT_EQ(cross_validate(setup, model, kBlocks, kFreeForcesSquares, true, &setup).free_forces,
            kFreeForcesSquares);
  EXPECT_EQ(cross_validate(setup, model, kBlocks, kFreeForcesSquares).free_forces,
            kFreeForcesSquares);
}

// Either of two hidden effects alone leaves more than free forces do, which take much of both.
// Beside free forces it still helps.
TEST(FreeForces, DoNotKeepASearchFromTheFirstOfTwoHiddenEffects) {
  const SyntheticCloth cloth{.drag_rate_per_s = 0.15, .mesh = 5, .clock_offset_s = 2e-3};
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = setup_of({&input, 1}, 5);
  const Hypothesis clock{.effect = "clock_offset", .mode = "", .amplitudes = {"time"}};
  const SearchOptions options{.hypotheses = {{drag_hypothesis()}, {clock}},
                              .beam_width = 1,
                              .refits = 2,
                              .most_effects = 2,
                              .threshold = kFreeForcesSquares};

  const SearchResult search = search_hypotheses(setup, fitted(setup), options, {});

  ASSERT_EQ(search.accepted.size(), 2u);
  const Trial& first = search.accepted.front().trial;
  EXPECT_GT(first.cross_validated, first.best_trivial);
  EXPECT_LT(search.accepted.back().trial.cross_validated, first.best_trivial);
}

}  // namespace
}  // namespace clothfit
