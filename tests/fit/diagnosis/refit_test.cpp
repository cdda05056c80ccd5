// Checks models that are fitted again in a diagnosis. How well hypotheses race each other is
// checked in search_test.cpp and tests/fit/diagnosis/diagnose_test.cpp.
#include "fit/diagnosis/refit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/fit/diagnosis/true_model.h"

namespace clothfit {
namespace {

const FitOptions kRefitOptions = [] {
  FitOptions options;
  options.loss = Loss::squared;
  options.generations = 10;
  options.population = 40;
  options.refine_best = 1;
  return options;
}();

/// Expects a model to leave no more than a fit with drag that begins at the truth.
void expect_optimum(const FittedModel& found, const DiagnosisSetup& setup,
                    const SyntheticCloth& cloth) {
  ASSERT_TRUE(found.usable());
  FittedModel near = true_model(setup, cloth, {drag_hypothesis()});
  refine_model(near, setup, {}, {});
  ASSERT_TRUE(near.usable());
  // Time steps are chosen again, and change chi-square by a little of its scatter.
  const auto count = static_cast<double>(near.residual_count());
  EXPECT_LT(found.residual().squaredNorm(),
            near.residual().squaredNorm() + 0.2 * std::sqrt(2 * count));
}

TEST(IdentifiedFromScratch, IsTheOptimumWhateverIsKnown) {
  const SyntheticCloth cloth{.drag_rate_per_s = 1.2, .mesh = 7};
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup{
      .inputs = {&input, 1}, .options = kRefitOptions, .columns = 7, .rows = 7};

  const FittedModel identified = identified_from_scratch(setup, {drag_hypothesis()}, {});

  ASSERT_NO_FATAL_FAILURE(expect_optimum(identified, setup, cloth));
  ASSERT_EQ(identified.hypotheses.size(), 1u);
  EXPECT_NEAR(identified.values().front().at("viscous_damping.rate"), 1.2, 0.05);
}

TEST(IdentifiedFromScratch, IsOfAllRecordings) {
  SyntheticCloth cloth{.drag_rate_per_s = 1.2, .mesh = 7};
  std::vector<FitInput> inputs{synthetic_input(cloth)};
  cloth.seed = 2;
  inputs.push_back(synthetic_input(cloth));
  const DiagnosisSetup setup{.inputs = inputs, .options = kRefitOptions, .columns = 7, .rows = 7};

  const FittedModel identified = identified_from_scratch(setup, {drag_hypothesis()}, {});

  ASSERT_NO_FATAL_FAILURE(expect_optimum(identified, setup, cloth));
  const std::vector<NamedValues> values = identified.values();
  EXPECT_NEAR(values[0].at("viscous_damping.rate"), 1.2, 0.04);
  EXPECT_EQ(values[0].at("viscous_damping.rate"), values[1].at("viscous_damping.rate"));
}

TEST(IdentifiedFromScratch, IsOfAKnownStart) {
  FitInput input = synthetic_input({});
  input.recording.start = StartKind::unknown;
  const DiagnosisSetup setup{
      .inputs = {&input, 1}, .options = kRefitOptions, .columns = 9, .rows = 9};

  EXPECT_FALSE(identified_from_scratch(setup, {}, {}).usable());
}

TEST(WithHypotheses, HandsOnWhatTheModelIsExpectedToErrBy) {
  const SyntheticCloth cloth;
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup{
      .inputs = {&input, 1}, .options = kRefitOptions, .columns = 9, .rows = 9};
  FittedModel model = true_model(setup, cloth);
  PooledPart& part = model.parts.front();
  part.correction = Eigen::VectorXd::LinSpaced(part.linear.residual.size(), 0, 1);

  const FittedModel with_drag = with_hypotheses(setup, model, {drag_hypothesis()}, {});
  EXPECT_EQ(with_drag.parts.front().correction, part.correction);
  // A hypothesis at neutral changes nothing.
  EXPECT_LT((with_drag.residual() - model.residual()).norm(), 1e-9 * model.residual().norm());

  const FittedModel early = shortened(model, 0.5);
  const Eigen::Index rows = early.residual_count();
  ASSERT_LT(rows, model.residual_count());
  EXPECT_EQ(early.residual(), model.residual().head(rows));
}

TEST(WithHypotheses, WithoutTheOnlyOneIsTheModelBeforeIt) {
  const SyntheticCloth cloth{.drag_rate_per_s = 0.1};
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup{
      .inputs = {&input, 1}, .options = kRefitOptions, .columns = 9, .rows = 9};
  const FittedModel with_drag = true_model(setup, cloth, {drag_hypothesis()});

  FittedModel without = with_hypotheses(setup, with_drag, {}, {});
  EXPECT_TRUE(without.hypotheses.empty());
  // Its derivatives are of another run.
  EXPECT_FALSE(without.parts.front().linear.usable);
  refine_model(without, setup, {}, {});
  FittedModel base = true_model(setup, cloth);
  refine_model(base, setup, {}, {});
  ASSERT_TRUE(without.usable() && base.usable());
  const auto count = static_cast<double>(base.residual_count());
  const double scatter = std::sqrt(2 * count);
  // Time steps are chosen again.
  EXPECT_NEAR(without.residual().squaredNorm(), base.residual().squaredNorm(), 0.05 * count);
  EXPECT_GT(without.residual().squaredNorm(), with_drag.residual().squaredNorm() + 5 * scatter);
}

}  // namespace
}  // namespace clothfit
