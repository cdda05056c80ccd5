// Checks the derivatives of a model's residuals by the amplitudes of hypotheses, against
// differences of runs that have the effects. Not checked here: derivatives of runs along effects
// that a cloth does not have (tests/model/integrate/tangents_test.cpp), and scores
// (score_test.cpp).
#include "fit/diagnosis/hypothesis_derivatives.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "fit/diagnosis/catalogue.h"
#include "fit/measurement_effects/registry.h"
#include "fit/problem/effects_of.h"
#include "model/effects/registry.h"
#include "tests/fit/diagnosis/true_model.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

/// The cloth is small, so that it runs fast.
const SyntheticCloth kAskedCloth{.mesh = 5, .markers = 5, .frames = 16, .held_out_from = 16};

FitOptions asked_options(ObservationKind observations) {
  FitOptions options;
  options.loss = Loss::squared;
  options.observations = observations;
  return options;
}
const FitOptions kAskedInSpace = asked_options(ObservationKind::tracks3d);
const FitOptions kAskedInPixels = asked_options(ObservationKind::tracks2d);

DiagnosisSetup asked_setup(std::span<const FitInput> inputs,
                           const FitOptions& options = kAskedInSpace) {
  return {.inputs = inputs, .options = options, .columns = 5, .rows = 5};
}

/// Returns every hypothesis of the catalogue at a shape in the middle of its grid.
std::vector<Hypothesis> every_hypothesis(const FitInput& input, const FitOptions& options) {
  std::vector<Hypothesis> hypotheses;
  for (const ShapeCandidates& shapes : hypotheses_to_test(input, options, 0.25))
    hypotheses.push_back(shapes[shapes.size() / 2]);
  return hypotheses;
}

bool is_measured(const Hypothesis& hypothesis) {
  return measurement_effect_named(hypothesis.effect) != nullptr;
}

/// Returns whether an effect does nothing but add a force.
bool only_adds_force(const Hypothesis& hypothesis) {
  if (is_measured(hypothesis)) return false;
  const std::unique_ptr<Effect> effect = find_effect(hypothesis.effect, "test").make();
  return !effect->changes_force() && !effect->shifts_supports();
}

/// Returns the residuals of a model that has a hypothesis with one amplitude so far beyond neutral.
/// The run has the same time steps.
Eigen::VectorXd residual_with(const DiagnosisSetup& setup, const FittedModel& model,
                              const Hypothesis& hypothesis, const std::string& amplitude,
                              double more) {
  FittedModel with = model_at(setup, {hypothesis}, {model.values().front()});
  PooledPart& part = with.parts.front();
  part.values[with.problems.front()->space.index(hypothesis.effect + "." + amplitude)] += more;
  part.frames = model.parts.front().frames;
  part.steps = model.parts.front().steps;
  return with.objective(0).residuals({part.values}).front();
}

/// Compares a hypothesis' columns with central differences over a hundredth of a typical change.
void expect_differences(const DiagnosisSetup& setup, const FittedModel& model,
                        const Hypothesis& hypothesis, const Columns& columns) {
  SCOPED_TRACE(hypothesis.title());
  ASSERT_EQ(columns.size(), 1u);  // recordings
  ASSERT_EQ(columns.front().cols(), std::ssize(hypothesis.amplitudes));
  const EffectDescription effect = describe_effect(hypothesis.effect);
  // An added force is carried on from the beginning of a step to its end. Its error is of first
  // order in the step. All else errs as the differences do.
  const double within = only_adds_force(hypothesis) ? 2e-3 : 1e-4;
  for (size_t k = 0; k < hypothesis.amplitudes.size(); ++k) {
    const std::string& name = hypothesis.amplitudes[k];
    const double typical =
        std::ranges::find(effect.parameters, name, &EffectParameter::name)->typical;
    const double change = 0.01 * typical;
    const Eigen::VectorXd more = residual_with(setup, model, hypothesis, name, change);
    const Eigen::VectorXd less = residual_with(setup, model, hypothesis, name, -change);
    ASSERT_EQ(more.size(), model.residual_count()) << name;
    ASSERT_EQ(less.size(), model.residual_count()) << name;
    const Eigen::VectorXd expected = (more - less) / (2 * change);
    const Eigen::VectorXd found = columns.front().col(static_cast<Eigen::Index>(k));
    EXPECT_LE((found - expected).norm(), within * expected.norm()) << name;
    // The effect shows; but the cloth does not touch itself.
    if (hypothesis.effect != "self_contact") {
      EXPECT_GT(typical * expected.norm(), 0.01) << name;
    }
  }
}

TEST(HypothesisDerivatives, AreDifferencesOfRunsThatHaveTheEffect) {
  SCOPED_TRACE("seed " + std::to_string(kAskedCloth.seed));
  const FitInput input = synthetic_input(kAskedCloth);
  const DiagnosisSetup setup = asked_setup({&input, 1});
  const FittedModel model = true_model(setup, kAskedCloth);
  std::vector<Hypothesis> hypotheses = every_hypothesis(input, kAskedInSpace);
  ASSERT_GT(std::ranges::count_if(hypotheses, only_adds_force), 10);
  ASSERT_GT(std::ranges::count_if(hypotheses, is_measured), 8);
  ASSERT_GT(std::ssize(hypotheses), std::ranges::count_if(hypotheses, only_adds_force) +
                                        std::ranges::count_if(hypotheses, is_measured) + 6);

  const std::vector<Columns> columns = hypothesis_derivatives(model, hypotheses);

  ASSERT_EQ(columns.size(), hypotheses.size());
  std::set<std::string> without;
  for (size_t k = 0; k < hypotheses.size(); ++k)
    if (columns[k].empty())
      without.insert(hypotheses[k].effect);
    else
      expect_differences(setup, model, hypotheses[k], columns[k]);
  EXPECT_EQ(without, (std::set<std::string>{"focal_error", "lens_distortion", "rolling_shutter"}));
}

TEST(HypothesisDerivatives, OfTheMeasurementAreDifferencesOfPixels) {
  SCOPED_TRACE("seed " + std::to_string(kAskedCloth.seed));
  const FitInput input = synthetic_input(kAskedCloth);
  const DiagnosisSetup setup = asked_setup({&input, 1}, kAskedInPixels);
  const FittedModel model = true_model(setup, kAskedCloth);
  std::vector<Hypothesis> hypotheses = every_hypothesis(input, kAskedInPixels);
  std::erase_if(hypotheses, [](const Hypothesis& hypothesis) { return !is_measured(hypothesis); });

  const std::vector<Columns> columns = hypothesis_derivatives(model, hypotheses);

  ASSERT_EQ(columns.size(), hypotheses.size());
  int found = 0;
  for (size_t k = 0; k < hypotheses.size(); ++k) {
    if (columns[k].empty()) continue;
    ++found;
    expect_differences(setup, model, hypotheses[k], columns[k]);
  }
  EXPECT_GT(found, 10);
}

// The shape of a cloth at rest depends on what pulls at it.
TEST(HypothesisDerivatives, OfAStartAtRestShowInItsFirstFrame) {
  SCOPED_TRACE("seed " + std::to_string(kAskedCloth.seed));
  FitInput input = synthetic_input(kAskedCloth);
  input.recording.start = StartKind::at_rest;
  const DiagnosisSetup setup = asked_setup({&input, 1});
  const FittedModel model = true_model(setup, kAskedCloth);
  const std::vector<Hypothesis> hypotheses{
      {.effect = "gravity_tilt", .mode = "", .amplitudes = {"about_x", "about_y"}},
      {.effect = "wind", .mode = "pressure", .amplitudes = {"q_x", "q_y", "q_z"}}};

  const std::vector<Columns> columns = hypothesis_derivatives(model, hypotheses);

  for (size_t k = 0; k < hypotheses.size(); ++k) {
    expect_differences(setup, model, hypotheses[k], columns[k]);
    EXPECT_GT(columns[k].front().topRows(3 * 25).norm(), 0.1 * columns[k].front().norm() / 16);
  }
}

// A single phase is differentiated by itself. Among more than two of one frequency it is a sum of
// the derivatives at phase 0 and at a quarter turn.
TEST(HypothesisDerivatives, OfAHarmonicAtAnyPhaseAreCombinationsOfTwo) {
  SCOPED_TRACE("seed " + std::to_string(kAskedCloth.seed));
  const FitInput input = synthetic_input(kAskedCloth);
  const FittedModel model = true_model(asked_setup({&input, 1}), kAskedCloth);
  struct Kind {
    std::string effect, mode;
    std::vector<std::string> amplitudes;
  };
  const auto vector = [](const std::string& name) {
    return std::vector{name + "_x", name + "_y", name + "_z"};
  };
  std::vector<Hypothesis> hypotheses;
  for (const Kind& kind :
       {Kind{"gust", "", vector("q")}, Kind{"support_motion", "", vector("amplitude")},
        Kind{"camera_shake", "shift", vector("shift")},
        Kind{"wind_field", "harmonic", {"h", "h_s", "h_t"}}})
    for (const double frequency_hz : {3.0, 5.0})
      for (const double phase : {-0.2, 0.05, 0.3})
        hypotheses.push_back({.effect = kind.effect,
                              .mode = kind.mode,
                              .amplitudes = kind.amplitudes,
                              .shape = {{"frequency", frequency_hz}, {"phase", phase}}});

  const std::vector<Columns> together = hypothesis_derivatives(model, hypotheses);

  ASSERT_EQ(together.size(), hypotheses.size());
  for (size_t k = 0; k < hypotheses.size(); ++k) {
    SCOPED_TRACE(hypotheses[k].title());
    ASSERT_TRUE(is_harmonic(hypotheses[k]));
    const Eigen::MatrixXd alone =
        hypothesis_derivatives(model, {&hypotheses[k], 1}).front().front();
    ASSERT_GT(alone.norm(), 0);
    // Each derivative is a difference over 1e-5 of a typical change.
    EXPECT_LT((together[k].front() - alone).norm(), 1e-4 * alone.norm());
    // Another phase is another hypothesis.
    const size_t next = k / 3 * 3 + (k + 1) % 3;
    EXPECT_GT((together[next].front() - alone).norm(), 0.1 * alone.norm());
  }
}

TEST(HypothesisDerivatives, AreNoneOfAnEffectThatCannotAct) {
  const FitInput input = synthetic_input(kAskedCloth);
  const Hypothesis focal{.effect = "focal_error", .mode = "", .amplitudes = {"excess"}};

  const std::vector<Columns> in_space = hypothesis_derivatives(
      true_model(asked_setup({&input, 1}), kAskedCloth), std::vector{drag_hypothesis(), focal});
  const std::vector<Columns> in_pixels = hypothesis_derivatives(
      true_model(asked_setup({&input, 1}, kAskedInPixels), kAskedCloth), {&focal, 1});

  ASSERT_EQ(in_space.size(), 2u);
  EXPECT_FALSE(in_space[0].empty());
  EXPECT_TRUE(in_space[1].empty());
  EXPECT_FALSE(in_pixels[0].empty());
}

// A predictor has room for nine parameters of the measurement, of which the model fits eight.
TEST(HypothesisDerivatives, AreNoneWhereThePredictorHasNoRoom) {
  FitOptions options = kAskedInSpace;
  options.effects = {"camera_drift", "world_tilt"};
  const FitInput input = synthetic_input(kAskedCloth);
  const FittedModel model = true_model(asked_setup({&input, 1}, options), kAskedCloth);
  const std::vector<Hypothesis> hypotheses{
      {.effect = "scale", .mode = "", .amplitudes = {"factor"}},
      {.effect = "in_surface_sliding", .mode = "", .amplitudes = {"velocity_s", "velocity_t"}},
      {.effect = "clock_offset", .mode = "", .amplitudes = {"time"}}};
  ASSERT_EQ(std::ranges::count(model.problems.front()->space.parameters, ParameterRole::measurement,
                               &FitParameter::role),
            kMeasurementParameters - 1);

  const std::vector<Columns> columns = hypothesis_derivatives(model, hypotheses);

  EXPECT_FALSE(columns[0].empty());
  EXPECT_TRUE(columns[1].empty());
  EXPECT_FALSE(columns[2].empty());
}

TEST(HypothesisDerivatives, OfTheMeasurementAreEachRecordingsOwn) {
  SCOPED_TRACE("seeds 1 and 2");
  SyntheticCloth cloth = kAskedCloth;
  std::vector<FitInput> inputs{synthetic_input(cloth)};
  cloth.seed = 2;
  inputs.push_back(synthetic_input(cloth));
  const std::vector<Hypothesis> hypotheses{
      drag_hypothesis(), {.effect = "clock_offset", .mode = "", .amplitudes = {"time"}}};
  const auto columns_of = [&](std::span<const FitInput> some) {
    return hypothesis_derivatives(true_model(asked_setup(some), kAskedCloth), hypotheses);
  };

  const std::vector<Columns> both = columns_of(inputs);

  for (size_t n = 0; n < 2; ++n) {
    SCOPED_TRACE(n);
    const std::vector<Columns> alone = columns_of({&inputs[n], 1});
    ASSERT_EQ(both[0].size(), 2u);
    EXPECT_EQ(both[0][n], alone[0].front());
    ASSERT_EQ(both[1][n].cols(), 2);
    const auto own = static_cast<Eigen::Index>(n);
    EXPECT_EQ(both[1][n].col(own), alone[1].front().col(0));
    EXPECT_TRUE(both[1][n].col(1 - own).isZero(0));
  }
}

Eigen::VectorXd gaussian(Eigen::Index size, std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  return Eigen::VectorXd::NullaryExpr(size, [&] { return normal(rng); });
}

TEST(SquaredMultipleCorrelation, IsTheSquaredCosineOfTheAngle) {
  const Eigen::Vector3d along_x(2, 0, 0);
  for (const double angle : {0.0, 0.3, 1.0, 1.5})
    EXPECT_NEAR(squared_multiple_correlation(
                    Eigen::Vector3d(5 * std::cos(angle), 0, 5 * std::sin(angle)), along_x),
                std::cos(angle) * std::cos(angle), 1e-14);
}

TEST(SquaredMultipleCorrelation, IsTheShareThatLeastSquaresExplainInAnyUnits) {
  constexpr unsigned kSeed = 51;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 rng(kSeed);
  Eigen::MatrixXd columns(30, 4);
  for (int k = 0; k < 4; ++k) columns.col(k) = gaussian(30, rng);
  const Eigen::VectorXd of = columns * gaussian(4, rng) + 2 * gaussian(30, rng);
  const Eigen::VectorXd left = of - columns * columns.colPivHouseholderQr().solve(of);
  const double expected = 1 - left.squaredNorm() / of.squaredNorm();

  EXPECT_NEAR(squared_multiple_correlation(of, columns), expected, 1e-12);
  // Units do not count, nor does a column that is there twice, nor one that is zero.
  EXPECT_NEAR(squared_multiple_correlation(
                  1e6 * of, columns * Eigen::Vector4d(1e-9, 1, 1e4, 1e9).asDiagonal()),
              expected, 1e-12);
  Eigen::MatrixXd more(30, 6);
  more << columns, -7 * columns.col(2), Eigen::VectorXd::Zero(30);
  EXPECT_NEAR(squared_multiple_correlation(of, more), expected, 1e-12);
}

TEST(SquaredMultipleCorrelation, IsNoneOfNothingOrByNothing) {
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(5);
  EXPECT_EQ(squared_multiple_correlation(ones, Eigen::MatrixXd(5, 0)), 0);
  EXPECT_EQ(squared_multiple_correlation(ones, Eigen::VectorXd::Zero(5)), 0);
  EXPECT_EQ(squared_multiple_correlation(Eigen::VectorXd::Zero(5), ones), 0);
}

}  // namespace
}  // namespace clothfit
