// Checks a model as plain data, and what it leaves. Its fits are checked in refit_test.cpp.
#include "fit/diagnosis/fitted_model.h"

#include <gtest/gtest.h>

#include "tests/fit/diagnosis/true_model.h"

namespace clothfit {
namespace {

const SyntheticCloth kSaved{
    .drag_rate_per_s = 1, .mesh = 5, .markers = 3, .frames = 12, .held_out_from = 10};

TEST(FittedModel, CanBeRestoredFromItsPlainData) {
  const FitInput input = synthetic_input(kSaved);
  const FitOptions options;
  const DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 5, .rows = 5};
  FittedModel model = shortened(true_model(setup, kSaved, {drag_hypothesis()}), 0.9);
  linearise_model(model);

  FittedModel again = restored(setup, model.fit());
  linearise_model(again);

  EXPECT_EQ(again.hypotheses.size(), 1u);
  EXPECT_EQ(again.parts.front().frames, model.parts.front().frames);
  EXPECT_EQ(again.residual(), model.residual());
  EXPECT_EQ(again.parts.front().linear.residual_by_coordinate,
            model.parts.front().linear.residual_by_coordinate);
}

TEST(FittedModel, CountsResidualsBeyondTheThresholdLinearly) {
  const FitInput input = synthetic_input(kSaved);
  const FitOptions options;
  const DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 5, .rows = 5};
  FittedModel model = true_model(setup, kSaved);
  Eigen::VectorXd& residual = model.parts.front().linear.residual;
  const auto count = static_cast<double>(residual.size());
  residual.setZero();
  const double prior = model.chi_square(1);
  residual.setConstant(2);

  EXPECT_DOUBLE_EQ(model.misfit(), 4);
  // The loss is Huber's, of lengths sqrt(12) in space.
  const double length = std::sqrt(12.0);
  EXPECT_NEAR(model.chi_square(10) - prior, 4 * count, 1e-9 * count);
  EXPECT_NEAR(model.chi_square(1) - prior, count / 3 * (2 * length - 1), 1e-9 * count);
}

TEST(LineariseModel, FailsWhereTheModelDoesNotRun) {
  const FitInput input = synthetic_input(kSaved);
  const FitOptions options;
  const DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 5, .rows = 5};
  FittedModel model = true_model(setup, kSaved);
  EXPECT_EQ(model.state, FitState::complete);
  model.parts.front().steps = 1.0;  // far beyond what is stable
  linearise_model(model);
  EXPECT_EQ(model.state, FitState::failed);
  EXPECT_FALSE(model.usable());
}

}  // namespace
}  // namespace clothfit
