// Checks the score test of hypotheses on simulated recordings, its derivatives, and the judgement
// of what a fit leaves. Not checked here: derivatives of runs along effects that a cloth does not
// have, one by one (tests/model/integrate/tangents_test.cpp).
#include "fit/diagnosis/score.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/cross_validation.h"
#include "fit/diagnosis/discretisation.h"
#include "tests/fit/diagnosis/true_model.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

const FitOptions kScoreOptions{.loss = Loss::squared};

DiagnosisSetup setup_of(std::span<const FitInput> inputs) {
  const ClothDescription& cloth = inputs.front().recording.cloth;
  return {.inputs = inputs,
          .options = kScoreOptions,
          .columns = cloth.mesh_columns,
          .rows = cloth.mesh_rows};
}

/// A cloth that is simulated soon.
const SyntheticCloth kFewVertices{.mesh = 5};

TEST(Score, PredictsASmallDragAndItsSigma) {
  const SyntheticCloth cloth{.drag_rate_per_s = 0.05, .noise_m = 1e-4};
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = setup_of({&input, 1});
  const FittedModel model = true_model(setup, cloth);
  ASSERT_TRUE(model.usable());
  const ModelProjection projection(model, kScoreOptions.loss);

  const std::vector<Score> scores = score_hypotheses(model, projection, {{drag_term()}}, {});

  ASSERT_EQ(scores.size(), 1u);
  EXPECT_NEAR(scores[0].amplitude[0], 0.05, 4 * scores[0].sigma[0]);
  EXPECT_LT(scores[0].sigma[0], 0.01);
  // A normal estimate so far from neutral takes this from chi-square.
  const double z = scores[0].amplitude[0] / scores[0].sigma[0];
  EXPECT_NEAR(scores[0].decrease, z * z, 1e-6 * z * z);
}

TEST(Score, IsThatOfNoiseWhereNothingIsHidden) {
  const SyntheticCloth cloth = kFewVertices;
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = setup_of({&input, 1});
  const FittedModel model = that_may_err(setup, true_model(setup, cloth));
  ASSERT_TRUE(model.usable());
  std::vector<ShapeCandidates> hypotheses = hypotheses_to_test(input, kScoreOptions, 0.4);
  std::erase_if(hypotheses, [](const ShapeCandidates& shapes) { return shapes.size() > 1; });

  const std::vector<Score> scores =
      score_hypotheses(model, ModelProjection(model, kScoreOptions.loss), hypotheses, {});

  EXPECT_GT(scores.size(), 5u);
  for (const Score& score : scores)
    // Beyond 20 lies the chi-square of one hypothesis in 100 000, with one degree of freedom.
    EXPECT_LT(score.decrease, 20 + 4 * static_cast<double>(score.amplitude.size() - 1))
        << score.hypothesis.title();
}

// Two recordings of one motion have the same derivatives, but for where noise has put the sheet. Of
// what is the cloth's they say twice as much as one.
TEST(Score, SharesThePhysicsOfTwoRecordingsAndNotTheirClocks) {
  const std::vector<FitInput> inputs{synthetic_input({.noise_m = 1e-4, .seed = 1}),
                                     synthetic_input({.noise_m = 1e-4, .seed = 2})};
  const SyntheticCloth cloth{.noise_m = 1e-4};
  const Hypothesis clock{.effect = "clock_offset", .mode = "", .amplitudes = {"time"}};
  const auto scores_of = [&](std::span<const FitInput> some) {
    const FittedModel model = true_model(setup_of(some), cloth);
    return score_hypotheses(model, ModelProjection(model, kScoreOptions.loss),
                            {{drag_term()}, {clock}}, {});
  };

  const std::vector<Score> one = scores_of({inputs.data(), 1}), two = scores_of(inputs);

  ASSERT_EQ(one.size(), 2u);
  ASSERT_EQ(two.size(), 2u);
  ASSERT_EQ(two[0].amplitude.size(), 1);
  EXPECT_NEAR(two[0].sigma[0], one[0].sigma[0] / std::sqrt(2.0), 0.02 * one[0].sigma[0]);
  ASSERT_EQ(two[1].amplitude.size(), 2);
  // What both clocks do alike is known as one of them alone is. What they do in opposite ways no
  // parameter of the cloth can do, so that it is known better.
  for (const double sigma_s : two[1].sigma) {
    EXPECT_LT(sigma_s, 1.01 * one[1].sigma[0]);
    EXPECT_GT(sigma_s, 0.99 * one[1].sigma[0] / std::sqrt(2.0));
  }
}

// Two ways lead to one number: effects that the cloth does not have, and a fit that has them at
// their neutral values.
TEST(HypothesisDerivatives, AreThoseOfAModelThatHasTheEffectAtItsNeutralValue) {
  const SyntheticCloth cloth;
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = setup_of({&input, 1});
  std::vector<Hypothesis> hypotheses{
      drag_term(),
      {.effect = "wind", .mode = "pressure", .amplitudes = {"q_x", "q_y", "q_z"}},
      {.effect = "nonuniform_mass",
       .mode = "edges",
       .amplitudes = {"hem_left", "hem_right", "hem_top", "hem_bottom"},
       .shape = {{"hem_width", 0.02}},
       .shape_sigma = {{"hem_width", 0.01}}},
      {.effect = "scale", .mode = "", .amplitudes = {"factor"}}};
  // Several phases of one frequency need not be differentiated one by one.
  for (const double phase : {-0.2, 0.05, 0.3}) {
    const std::map<std::string, double> shape{{"frequency", 3}, {"phase", phase}};
    hypotheses.push_back({.effect = "gust", .mode = "", .amplitudes = {"q_x", "q_y", "q_z"}});
    hypotheses.push_back({.effect = "support_motion",
                          .mode = "",
                          .amplitudes = {"amplitude_x", "amplitude_y", "amplitude_z"}});
    hypotheses.push_back({.effect = "camera_shake",
                          .mode = "shift",
                          .amplitudes = {"shift_x", "shift_y", "shift_z"}});
    for (size_t k = hypotheses.size() - 3; k < hypotheses.size(); ++k) hypotheses[k].shape = shape;
  }

  const std::vector<Columns> columns = hypothesis_derivatives(true_model(setup, cloth), hypotheses);

  ASSERT_EQ(columns.size(), hypotheses.size());
  for (size_t k = 0; k < hypotheses.size(); ++k) {
    SCOPED_TRACE(hypotheses[k].title());
    ASSERT_EQ(columns[k].size(), 1u);  // recordings
    const FittedModel with = true_model(setup, cloth, {hypotheses[k]});
    const PooledPart& part = with.parts.front();
    const ParameterSpace& space = with.problems.front()->space;
    const Eigen::VectorXd slope = space.value_by_coordinate(part.values);
    const std::vector<std::string> names = hypotheses[k].parameters();
    ASSERT_EQ(columns[k].front().cols(), static_cast<Eigen::Index>(names.size()));
    for (size_t a = 0; a < names.size(); ++a) {
      const int p = space.index(names[a]);
      ASSERT_GE(p, 0) << names[a];
      const Eigen::VectorXd expected = part.linear.residual_by_coordinate.col(p) / slope[p];
      const Eigen::VectorXd found = columns[k].front().col(static_cast<Eigen::Index>(a));
      EXPECT_GT(expected.norm(), 0) << names[a];
      // The derivative by a hypothesis is a difference over 1e-5 of a typical change, and a force
      // is carried on between steps.
      EXPECT_LT((found - expected).norm(), 1e-3 * expected.norm()) << names[a];
    }
  }
}

TEST(Adequacy, HoldsForATrueModelAndNotForOneThatLacksDrag) {
  for (const double drag : {0.0, 1.0}) {
    SyntheticCloth cloth = kFewVertices;
    cloth.drag_rate_per_s = drag;
    const FitInput input = synthetic_input(cloth);
    const DiagnosisSetup setup = setup_of({&input, 1});
    const FittedModel model = that_may_err(setup, true_model(setup, cloth));
    ASSERT_TRUE(model.usable());

    const Adequacy adequacy = judge_adequacy(model, kScoreOptions.loss);

    EXPECT_EQ(adequacy.adequate, drag == 0) << "drag " << drag;
    if (drag == 0) {
      EXPECT_NEAR(adequacy.chi_square_per_dof, 1, 0.08);  // 3822 residuals: 3.5 of its sigmas
      EXPECT_NEAR(adequacy.noise_chi_square_per_dof, 1, 0.08);
      EXPECT_LT(std::abs(adequacy.time_score), 4);
      EXPECT_LT(std::abs(adequacy.neighbour_score), 4);
    } else {
      EXPECT_GT(adequacy.time_score, 10);
      EXPECT_GT(adequacy.neighbour_score, 10);
    }
  }
}

// The same structure does not count where mesh and time step are thought to err by far more.
TEST(Adequacy, TakesLittleBesideTheDiscretisationsErrorForNoStructure) {
  const SyntheticCloth cloth{.drag_rate_per_s = 0.06};
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = setup_of({&input, 1});
  FittedModel model = true_model(setup, cloth);
  ASSERT_TRUE(model.usable());
  ASSERT_FALSE(judge_adequacy(model, kScoreOptions.loss).adequate);

  // The direction looks like nothing else: of mean square 40, its sign alternating.
  Eigen::MatrixXd& directions = model.parts.front().directions;
  directions = Eigen::MatrixXd::Constant(model.residual_count(), 1, std::sqrt(40.0));
  for (Eigen::Index n = 0; n < directions.rows(); n += 2) directions(n, 0) *= -1;
  model.parts.front().amplitudes = Eigen::VectorXd::Zero(1);

  const Adequacy adequacy = judge_adequacy(model, kScoreOptions.loss);
  EXPECT_NEAR(adequacy.discretisation_square, 40, 1e-9);
  EXPECT_TRUE(adequacy.adequate);
}

// A true model predicts frames left out to the noise. Constants of markers, which nothing asks for,
// and a last residual, which is noise, do worse.
TEST(CrossValidation, OfATrueModelIsTheNoiseAndBeatsCorrectionsWithoutPhysics) {
  const SyntheticCloth cloth = kFewVertices;
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = setup_of({&input, 1});
  const FittedModel model = true_model(setup, cloth);
  ASSERT_TRUE(model.usable());

  const CrossValidation validated = cross_validate(setup, model, 5, 1e300);

  ASSERT_TRUE(validated.usable);
  EXPECT_EQ(validated.block.size(), 5u);
  EXPECT_NEAR(validated.mean, 1, 0.1);
  EXPECT_GT(validated.constant_offset, validated.mean);
  EXPECT_NEAR(validated.last_residual, 2 * validated.mean, 0.3);
}

// The same holds of a whole recording that took no part in finding the cloth's parameters. Only
// where its sheet lay is its own.
TEST(CrossValidation, OfATrueModelPredictsAnotherRecordingToTheNoise) {
  const SyntheticCloth cloth = kFewVertices;
  const std::vector<FitInput> inputs{synthetic_input({.seed = 1}), synthetic_input({.seed = 2})};
  const DiagnosisSetup setup = setup_of(inputs);
  const FittedModel model = true_model(setup, cloth);
  ASSERT_TRUE(model.usable());

  const CrossValidation validated = cross_validate(setup, model, 5, 1e300, true);

  ASSERT_TRUE(validated.usable);
  ASSERT_EQ(validated.block.size(), 2u);  // one for each recording, whatever is asked for
  for (const double recording : validated.block) EXPECT_NEAR(recording, 1, 0.1);
  EXPECT_NEAR(validated.mean, 1, 0.07);  // 7644 residuals: 4 of its sigmas
}

// The first frames show a start in motion. Without them it would be told, through 54 numbers, from
// what became of it.
TEST(CrossValidation, KeepsTheFramesThatShowAStartInMotion) {
  FitInput input = synthetic_input({.frames = 46, .held_out_from = 40});
  input.recording.start = StartKind::unknown;
  FitOptions options = kScoreOptions;
  options.start_nodes = 3;
  const DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 9, .rows = 9};
  FittedModel model = model_at(setup, {}, {named(SyntheticCloth().fabric)});
  refine_model(model, setup, {}, {});
  ASSERT_TRUE(model.usable());
  linearise_model(model);

  const CrossValidation validated = cross_validate(setup, model, 5, 1e300);

  ASSERT_TRUE(validated.usable);
  ASSERT_EQ(validated.block.size(), 4u);
  const double seen = model.residual().squaredNorm() / static_cast<double>(model.residual_count());
  for (const double block : validated.block) EXPECT_LT(block, 2 * seen);
}

TEST(Discretisation, ShowsWhatTheStepAndTheMeshAreWorth) {
  const SyntheticCloth cloth = kFewVertices;
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = setup_of({&input, 1});
  const FittedModel model = true_model(setup, cloth);

  const std::vector<DiscretisationError> errors = discretisation_errors(setup, model);

  ASSERT_EQ(errors.size(), 1u);  // recordings
  const Eigen::MatrixXd& directions = errors.front().directions;
  ASSERT_EQ(directions.rows(), model.residual_count());
  ASSERT_EQ(directions.cols(), 2);
  // The truth was simulated on this mesh at about this step. Its own errors are far below the
  // noise, but not nothing.
  for (int k = 0; k < 2; ++k) {
    const double rms = directions.col(k).norm() / std::sqrt(static_cast<double>(directions.rows()));
    EXPECT_GT(rms, 1e-4) << k;
    EXPECT_LT(rms, 20) << k;
  }
}

// The scheme is of first order: an eighth of the step leaves an eighth of the error.
TEST(Discretisation, ExpectsOfTheStepWhatAFinerOneShows) {
  const SyntheticCloth cloth = kFewVertices;
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = setup_of({&input, 1});
  const FittedModel model = true_model(setup, cloth);
  const PooledPart& part = model.parts.front();

  const DiscretisationError error = discretisation_errors(setup, model).front();

  const TrajectoryObjective fine(*model.problems.front(), part.frames, part.steps.times(0.125));
  const Eigen::VectorXd change = fine.residuals({part.values}).front() - part.linear.residual;
  ASSERT_EQ(error.expected.size(), change.size());
  EXPECT_LT((change - 0.875 * error.expected).norm(), 0.05 * error.expected.norm());
  // The direction allows for half of it.
  EXPECT_LT((2 * error.directions.col(0) - error.expected).norm(), 1e-9 * error.expected.norm());
}

// With a start in motion the other mesh's fit goes by derivatives that are only updated. It may
// stop short of a change of parameters, which are fitted along with the direction it gives.
TEST(Discretisation, OfAStartInMotionStopsShortOnlyAlongTheParameters) {
  FitInput input = synthetic_input({.frames = 28, .held_out_from = 20});
  input.recording.start = StartKind::unknown;
  FitOptions options = kScoreOptions;
  options.start_nodes = 4;
  const DiagnosisSetup setup{.inputs = {&input, 1}, .options = options, .columns = 13, .rows = 13};
  FittedModel model = model_at(setup, {}, {named(SyntheticCloth().fabric)});
  refine_model(model, setup, {}, {});
  ASSERT_TRUE(model.usable());
  const DiagnosisSetup other = with_other_mesh(setup);
  ASSERT_EQ(other.columns, 7);

  const FittedModel there = fit_on_mesh(other, model);

  ASSERT_TRUE(there.usable());
  FittedModel optimum = there;
  optimum.parts.front().linear = {};
  refine_model(optimum, other, {}, {});
  ASSERT_TRUE(optimum.usable());
  linearise_model(optimum);
  const Eigen::VectorXd direction = there.residual() - model.residual();
  const Eigen::VectorXd short_of = there.residual() - optimum.residual();
  const Eigen::MatrixXd& jacobian = optimum.parts.front().linear.residual_by_coordinate;
  const Eigen::VectorXd along = jacobian * jacobian.colPivHouseholderQr().solve(short_of);
  EXPECT_LT((short_of - along).norm(), 0.2 * direction.norm());
  EXPECT_LT((short_of - along).norm(), 0.4 * short_of.norm());
  EXPECT_LT(there.residual().squaredNorm(), 1.5 * optimum.residual().squaredNorm());
}

// Where nothing is missing, amplitudes are those of noise, and a fit keeps its directions.
TEST(Discretisation, OfATrueModelIsBelieved) {
  const SyntheticCloth cloth = kFewVertices;
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = setup_of({&input, 1});
  FittedModel model = true_model(setup, cloth);

  refine_with_discretisation(model, setup, {});

  ASSERT_TRUE(model.usable());
  const PooledPart& part = model.parts.front();
  ASSERT_EQ(part.directions.cols(), 2);
  ASSERT_EQ(part.amplitudes.size(), 2);
  EXPECT_LT(part.amplitudes.cwiseAbs().maxCoeff(), 3);
}

TEST(Discretisation, IsNotWhatAModelLacksThatIsFarOff) {
  SyntheticCloth cloth = kFewVertices;
  cloth.drag_rate_per_s = 2;
  cloth.noise_m = 1e-4;
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = setup_of({&input, 1});
  FittedModel model = true_model(setup, cloth);
  ASSERT_GT(model.residual().squaredNorm(), 30 * static_cast<double>(model.residual_count()));

  refine_with_discretisation(model, setup, {});

  ASSERT_TRUE(model.usable());
  EXPECT_EQ(model.parts.front().directions.cols(), 0);
}

}  // namespace
}  // namespace clothfit
