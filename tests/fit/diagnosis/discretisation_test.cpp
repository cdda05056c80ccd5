// Checks by what a model is thought to err through its time step and its mesh: the orders of both,
// against finer steps and against cloths of another mesh. Not checked here: the judgement beside
// such an error (adequacy_test.cpp), and the orders of the scheme itself (tests/model/integrate/).
#include "fit/diagnosis/discretisation.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "fit/diagnosis/criteria.h"
#include "tests/fit/diagnosis/true_model.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

const FitOptions kCutOptions{.loss = Loss::squared};

/// Returns a small cloth, all of whose frames are fitted.
SyntheticCloth cut_cloth(int mesh, double noise_m = 5e-4) {
  return {.mesh = mesh, .markers = 4, .frames = 12, .held_out_from = 12, .noise_m = noise_m};
}

DiagnosisSetup cut_into(int mesh, const FitInput& input, const FitOptions& options = kCutOptions) {
  return {.inputs = {&input, 1}, .options = options, .columns = mesh, .rows = mesh};
}

/// Returns options with priors of flexion and damping, of which so few frames say little. A fit has
/// one optimum on every mesh then.
FitOptions with_known_flexion() {
  FitOptions options = kCutOptions;
  const NamedValues truth = named(SyntheticCloth().fabric);
  for (const char* name : {"flexion_warp", "flexion_weft", "damping_warp", "damping_weft"})
    options.priors.push_back(
        {.name = name, .mean = truth.at(name), .sigma = 0.03 * truth.at(name)});
  return options;
}

/// Returns the model at its optimum on the setup's mesh, linearised.
FittedModel optimum_on(const DiagnosisSetup& setup) {
  FittedModel model = model_at(setup, {}, {named(SyntheticCloth().fabric)});
  refine_model(model, setup, {}, {});
  linearise_model(model);
  EXPECT_TRUE(model.usable());
  return model;
}

TEST(Discretisation, ExpectsHalfAsMuchOfHalfTheStep) {
  const SyntheticCloth cloth = cut_cloth(5);
  SCOPED_TRACE("seed " + std::to_string(cloth.seed));
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = cut_into(5, input);
  FittedModel model = true_model(setup, cloth);
  const Eigen::VectorXd whole = discretisation_errors(setup, model).front().expected;
  PooledPart& part = model.parts.front();
  part.steps = part.steps.times(0.5);
  linearise_model(model);

  const Eigen::VectorXd half = discretisation_errors(setup, model).front().expected;

  ASSERT_GT(whole.norm(), 0.1);
  // The rest is of second order, a few thousandths at this step.
  EXPECT_LT((half - 0.5 * whole).norm(), 0.005 * whole.norm());
}

// The scheme is of first order: an eighth of the step leaves an eighth of the error.
TEST(Discretisation, ExpectsOfTheStepWhatAFinerOneShows) {
  const SyntheticCloth cloth = cut_cloth(5);
  SCOPED_TRACE("seed " + std::to_string(cloth.seed));
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = cut_into(5, input);
  const FittedModel model = true_model(setup, cloth);
  const PooledPart& part = model.parts.front();

  const DiscretisationError error = discretisation_errors(setup, model).front();

  const TrajectoryObjective fine(*model.problems.front(), part.frames, part.steps.times(0.125));
  const Eigen::VectorXd change = fine.residuals({part.values}).front() - part.linear.residual;
  ASSERT_EQ(error.expected.size(), change.size());
  EXPECT_LT((change - 0.875 * error.expected).norm(), 0.01 * error.expected.norm());
  // The direction allows for half of it.
  EXPECT_LT((2 * error.directions.col(0) - error.expected).norm(), 1e-9 * error.expected.norm());
}

TEST(Discretisation, IsThatOfEachRecordingByItself) {
  const SyntheticCloth cloth = cut_cloth(5);
  SCOPED_TRACE("seed " + std::to_string(cloth.seed));
  FitInput longer = synthetic_input(cloth), shorter = longer;
  shorter.recording.held_out_from_frame = 9;
  const std::vector<FitInput> inputs{longer, shorter};
  const DiagnosisSetup both{.inputs = inputs, .options = kCutOptions, .columns = 5, .rows = 5};

  const std::vector<DiscretisationError> errors =
      discretisation_errors(both, true_model(both, cloth));

  ASSERT_EQ(errors.size(), 2u);
  for (size_t n = 0; n < 2; ++n) {
    const DiagnosisSetup alone = cut_into(5, inputs[n]);
    const DiscretisationError expected =
        discretisation_errors(alone, true_model(alone, cloth)).front();
    EXPECT_EQ(errors[n].expected, expected.expected) << n;
    EXPECT_EQ(errors[n].directions.cols(), 2) << n;
  }
}

// The error of a mesh is of second order. So the coarser of two meshes errs by four thirds of their
// difference, the finer one by a third of it, and both to the same side.
TEST(Discretisation, OfTheFinerMeshIsAQuarterOfTheCoarserOnes) {
  const SyntheticCloth cloth = cut_cloth(9);
  SCOPED_TRACE("seed " + std::to_string(cloth.seed));
  const FitInput input = synthetic_input(cloth);
  const FitOptions options = with_known_flexion();
  std::map<int, Eigen::VectorXd> direction;
  for (const int mesh : {7, 13}) {
    const DiagnosisSetup setup = cut_into(mesh, input, options);
    const std::vector<DiscretisationError> errors = discretisation_errors(setup, optimum_on(setup));
    ASSERT_EQ(errors.front().directions.cols(), 2);
    direction[mesh] = errors.front().directions.col(1);
  }

  ASSERT_GT(direction[13].norm(), 3);
  // Each of the four fits ends where a step would lower chi-square by a few hundredths.
  EXPECT_LT((direction[7] + 4 * direction[13]).norm(), 0.03 * direction[7].norm());
}

// The model differs from a cloth of twice the cells a side by three quarters of its mesh's error.
// The cloth has the other quarter itself.
TEST(Discretisation, ExplainsAClothOfTwiceTheCells) {
  const SyntheticCloth cloth = cut_cloth(13, 1e-4);
  SCOPED_TRACE("seed " + std::to_string(cloth.seed));
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = cut_into(7, input);
  FittedModel model = optimum_on(setup);
  EXPECT_GT(model.misfit(), 5);

  refine_with_discretisation(model, setup, {});

  ASSERT_TRUE(model.usable());
  ASSERT_EQ(model.parts.front().amplitudes.size(), 2);
  EXPECT_NEAR(model.parts.front().amplitudes[1], 0.75, 0.03);
  const auto count = static_cast<double>(model.residual_count());
  EXPECT_NEAR(model.misfit(), 1, 4 * std::sqrt(2 / count));
}

TEST(Discretisation, IsThatOfTheStepAloneWhereNaturalLengthsAreFitted) {
  const FitInput input = synthetic_input(cut_cloth(5));
  FitOptions options = kCutOptions;
  options.spring_set = SpringSet::louchet5;
  const DiagnosisSetup setup = cut_into(5, input, options);
  FittedModel model = model_at(setup, {}, {{}});
  linearise_model(model);
  ASSERT_TRUE(model.usable());

  const DiscretisationError error = discretisation_errors(setup, model).front();

  EXPECT_EQ(error.directions.cols(), 1);
  EXPECT_GT(error.expected.norm(), 0);
}

// The markers are moved along the step's direction: by an amplitude that is believable, and by one
// that is not, behind which another cause must stand. The truth's own step is three quarters of the
// model's, so that three quarters of the expected error are added too.
TEST(Discretisation, IsDroppedWhereMoreIsAskedOfItThanIsBelievable) {
  const SyntheticCloth cloth = cut_cloth(5, 5e-6);
  SCOPED_TRACE("seed " + std::to_string(cloth.seed));
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = cut_into(5, input);
  const DiscretisationError error = discretisation_errors(setup, true_model(setup, cloth)).front();
  for (const double asked : {0.5, 1.5}) {
    SCOPED_TRACE(asked);
    const double amplitude = asked * kCriteria.believable_error;
    FitInput moved = input;
    Eigen::Index row = 0;
    for (Position3d& at : moved.tracks3d)
      for (double& coordinate : at.position_m) {
        coordinate +=
            cloth.noise_m * (0.75 * error.expected[row] + amplitude * error.directions(row, 0));
        ++row;
      }
    FittedModel model = true_model(cut_into(5, moved), cloth);

    refine_with_discretisation(model, cut_into(5, moved), {});

    ASSERT_TRUE(model.usable());
    const PooledPart& part = model.parts.front();
    if (asked < 1) {
      ASSERT_EQ(part.amplitudes.size(), 2);
      EXPECT_EQ(part.correction.size(), error.expected.size());
      // The model's parameters leave fifteen sigmas of the direction, so that its amplitude is
      // known to a fifteenth.
      EXPECT_NEAR(part.amplitudes[0], amplitude, 4.0 / 15);
    } else {
      // The direction of the mesh stays.
      EXPECT_EQ(part.amplitudes.size(), 1);
      EXPECT_EQ(part.directions.cols(), 1);
      EXPECT_EQ(part.correction.size(), 0);
    }
  }
}

// Where nothing is missing, amplitudes are those of noise, and a fit keeps its directions.
TEST(Discretisation, OfATrueModelIsBelieved) {
  const SyntheticCloth cloth{.mesh = 5};
  SCOPED_TRACE("seed " + std::to_string(cloth.seed));
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = cut_into(5, input);
  FittedModel model = true_model(setup, cloth);

  refine_with_discretisation(model, setup, {});

  ASSERT_TRUE(model.usable());
  const PooledPart& part = model.parts.front();
  ASSERT_EQ(part.directions.cols(), 2);
  ASSERT_EQ(part.amplitudes.size(), 2);
  EXPECT_LT(part.amplitudes.cwiseAbs().maxCoeff(), 3);
}

TEST(Discretisation, IsNotWhatAModelLacksThatIsFarOff) {
  const SyntheticCloth cloth{.drag_rate_per_s = 2, .mesh = 5, .noise_m = 1e-4};
  SCOPED_TRACE("seed " + std::to_string(cloth.seed));
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup setup = cut_into(5, input);
  FittedModel model = true_model(setup, cloth);
  ASSERT_GT(model.residual().squaredNorm(), 30 * static_cast<double>(model.residual_count()));

  refine_with_discretisation(model, setup, {});

  ASSERT_TRUE(model.usable());
  EXPECT_EQ(model.parts.front().directions.cols(), 0);
}

// How the cells are halved or doubled, tests/fit/refine/other_mesh_test.cpp checks.
TEST(Discretisation, IsSeenFromAMeshThatHoldsTheStart) {
  FitInput input = synthetic_input(cut_cloth(5));
  FitOptions options = kCutOptions;
  options.start_nodes = 8;
  const auto other = [&](int columns, int rows) {
    DiagnosisSetup setup = cut_into(0, input, options);
    setup.columns = columns;
    setup.rows = rows;
    const DiagnosisSetup found = with_other_mesh(setup);
    return std::pair(found.columns, found.rows);
  };

  EXPECT_EQ(other(17, 17), std::pair(9, 9));
  EXPECT_EQ(other(13, 15), std::pair(7, 8));
  // A start in motion needs a vertex more than it has nodes.
  input.recording.start = StartKind::unknown;
  EXPECT_EQ(other(17, 17), std::pair(9, 9));
  EXPECT_EQ(other(13, 15), std::pair(25, 29));
}

TEST(FitOnMesh, EndsAtTheOtherMeshsOptimum) {
  const SyntheticCloth cloth = cut_cloth(7);
  SCOPED_TRACE("seed " + std::to_string(cloth.seed));
  const FitInput input = synthetic_input(cloth);
  const FitOptions options = with_known_flexion();
  const DiagnosisSetup fine = cut_into(13, input, options), coarse = cut_into(7, input, options);
  const FittedModel model = optimum_on(fine);
  const FittedModel expected = optimum_on(coarse);
  const auto count = static_cast<double>(model.residual_count());

  const FittedModel found = fit_on_mesh(with_other_mesh(fine), model);

  ASSERT_TRUE(found.usable());
  EXPECT_EQ(found.problems.front()->cloth.mesh.columns, 7);
  EXPECT_EQ(found.parts.front().frames, model.parts.front().frames);
  EXPECT_LT(std::abs(found.misfit() - expected.misfit()) * count, 0.5);
  // The optimum on one mesh is none on the other.
  EXPECT_GT((model.misfit() - found.misfit()) * count, 100);
}

TEST(FitOnMesh, LeavesThePhysicsWhereItIsToldTo) {
  const SyntheticCloth cloth = cut_cloth(7);
  SCOPED_TRACE("seed " + std::to_string(cloth.seed));
  const FitInput input = synthetic_input(cloth);
  const DiagnosisSetup fine = cut_into(13, input), coarse = cut_into(7, input);
  const FittedModel model = optimum_on(coarse);

  const FittedModel found = fit_on_mesh(fine, model, {}, true);

  ASSERT_TRUE(found.usable());
  const NamedValues before = model.values().front(), after = found.values().front();
  for (const auto& [name, value] : before)
    if (name.starts_with("sheet_")) {
      EXPECT_NE(after.at(name), value) << name;
    } else
      EXPECT_DOUBLE_EQ(after.at(name), value) << name;
}

// With a start in motion the other mesh's fit goes by derivatives that are only updated. It may
// stop short of a change of parameters, which are fitted along with the direction it gives.
TEST(FitOnMesh, OfAStartInMotionStopsShortOnlyAlongTheParameters) {
  FitInput input = synthetic_input({.markers = 5, .frames = 14, .held_out_from = 14});
  input.recording.start = StartKind::unknown;
  FitOptions options = kCutOptions;
  options.start_nodes = 4;
  const DiagnosisSetup setup = cut_into(13, input, options);
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

}  // namespace
}  // namespace clothfit
