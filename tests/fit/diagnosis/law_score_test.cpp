// The score test of laws on simulated recordings, and the judgement of what a fit leaves.
#include "fit/diagnosis/law_score.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/cross_validation.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/parameterised_model.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

constexpr double kTimeStep_s = 1.0 / 60 / 150;
const FitOptions kOptions{.loss = Loss::squared};

/// The true model of a recording whose drag is not declared.
ModelFit true_model(const DiagnosisSetup& setup, const SyntheticCloth& cloth, int frames) {
  const auto problem = problem_of(setup, {});
  const Eigen::VectorXd values = start_with(*problem, cloth.fabric);
  const TimeSteps steps =
      time_steps_of_run(problem->cloth, parameter_set(*problem, values), kTimeStep_s);
  return model_at(problem, {}, values, frames, steps);
}

TEST(LawScore, ForeseesASmallDragAndItsSigma) {
  const SyntheticCloth cloth{.drag_rate_per_s = 0.05, .noise_m = 1e-4};
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup{.input = input, .options = kOptions, .columns = 9, .rows = 9};
  const ModelFit model = true_model(setup, cloth, 26);
  ASSERT_TRUE(model.usable);
  const Projection projection =
      project(setup, model, Eigen::MatrixXd(model.linear.residual.size(), 0));
  const Term term{.effect = "viscous_damping",
                  .law = "",
                  .amplitudes = {describe_effect("viscous_damping").parameters.front().name}};

  const std::vector<LawScore> scores = score_laws(model, projection, {{term}}, {});

  ASSERT_EQ(scores.size(), 1u);
  EXPECT_NEAR(scores[0].amount[0], 0.05, 4 * scores[0].sigma[0]);
  EXPECT_LT(scores[0].sigma[0], 0.01);
  // What a normal estimate so far from neutral takes from chi-square.
  const double z = scores[0].amount[0] / scores[0].sigma[0];
  EXPECT_NEAR(scores[0].fall, z * z, 1e-6 * z * z);
}

TEST(LawScore, IsThatOfNoiseWhereNothingIsHidden) {
  const SyntheticCloth cloth;
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup{.input = input, .options = kOptions, .columns = 9, .rows = 9};
  const ModelFit model = true_model(setup, cloth, 26);
  ASSERT_TRUE(model.usable);
  const Projection projection = project(setup, model, discretisation_directions(setup, model));
  std::vector<LawShapes> laws = laws_to_test(input, kOptions, 0.4);
  std::erase_if(laws, [](const LawShapes& law) { return law.size() > 1; });

  for (const LawScore& score : score_laws(model, projection, laws, {}))
    // Beyond 20 one law in 100 000 has its chi-square with one degree of freedom.
    EXPECT_LT(score.fall, 20 + 4 * static_cast<double>(score.amount.size() - 1))
        << score.term.title();
}

TEST(Adequacy, HoldsForATrueModelAndNotForOneThatLacksDrag) {
  for (const double drag : {0.0, 1.0}) {
    const SyntheticCloth cloth{.drag_rate_per_s = drag};
    const FitInput input = synthetic_input(cloth);
    const DiagnosisSetup setup{.input = input, .options = kOptions, .columns = 9, .rows = 9};
    const ModelFit model = true_model(setup, cloth, 26);
    ASSERT_TRUE(model.usable);
    const Projection alone =
        project(setup, model, Eigen::MatrixXd(model.linear.residual.size(), 0));
    const Adequacy adequacy = judge_adequacy(
        model, project(setup, model, discretisation_directions(setup, model)), alone);

    EXPECT_EQ(adequacy.adequate, drag == 0) << "drag " << drag;
    if (drag == 0) {
      EXPECT_NEAR(adequacy.chi_square_per_dof, 1, 0.08);  // 3822 residuals: 3.5 of its sigmas
      EXPECT_LT(std::abs(adequacy.time_score), 4);
      EXPECT_LT(std::abs(adequacy.neighbour_score), 4);
    } else {
      EXPECT_GT(adequacy.time_score, 10);
      EXPECT_GT(adequacy.neighbour_score, 10);
    }
  }
}

// A model that is true foresees left-out frames to the noise; constants of markers, which nothing
// asks for, and a last residual, which is noise, do worse.
TEST(CrossValidation, OfATrueModelIsTheNoiseAndBeatsCorrectionsWithoutPhysics) {
  const SyntheticCloth cloth;
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup{.input = input, .options = kOptions, .columns = 9, .rows = 9};
  const ModelFit model = true_model(setup, cloth, 26);
  ASSERT_TRUE(model.usable);

  const CrossValidation validated = cross_validate(setup, model, 5, 1e300);

  ASSERT_TRUE(validated.usable);
  EXPECT_EQ(validated.block.size(), 5u);
  EXPECT_NEAR(validated.mean, 1, 0.1);
  EXPECT_GT(validated.constant_offset, validated.mean);
  EXPECT_NEAR(validated.last_residual, 2 * validated.mean, 0.3);
}

TEST(Discretisation, ShowsWhatTheStepAndTheMeshAreWorth) {
  const SyntheticCloth cloth;
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup{.input = input, .options = kOptions, .columns = 9, .rows = 9};
  const ModelFit model = true_model(setup, cloth, 26);
  const Eigen::MatrixXd directions = discretisation_directions(setup, model);

  ASSERT_EQ(directions.cols(), 2);
  // The truth was simulated on this mesh at about this step: its own errors are far below the
  // noise, but not nothing.
  for (int k = 0; k < 2; ++k) {
    const double rms = directions.col(k).norm() / std::sqrt(static_cast<double>(directions.rows()));
    EXPECT_GT(rms, 1e-4) << k;
    EXPECT_LT(rms, 20) << k;
  }
}

}  // namespace
}  // namespace clothfit
