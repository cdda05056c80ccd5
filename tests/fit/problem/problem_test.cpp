// Checks a recording made ready to be fitted: what is observed, held, declared, and what is
// refused. The search for the optimum is in refine_test.cpp, the whole fit in fit_test.cpp, motion
// of held points in drive_test.cpp.
#include "fit/problem/problem.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "data/input_error.h"
#include "fit/problem/parameterised_model.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

template <class Call>
std::string refusal(Call&& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "not refused";
}

FitProblem problem_of(const FitInput& input, const FitOptions& options = {}) {
  return make_problem(input, options, input.recording.cloth.mesh_columns,
                      input.recording.cloth.mesh_rows);
}

TEST(Problem, PlacesTheSheetOnTheFirstFrame) {
  const FitInput input = synthetic_input({.noise_m = 1e-9});

  const FitProblem problem = problem_of(input);

  // Held corners of the true sheet lie at (0, 0, 0) and (0.4, 0, 0).
  EXPECT_LT(problem.placed_sheet_m.col(0).norm(), 1e-7);
  EXPECT_LT((problem.placed_sheet_m.col(8) - Eigen::Vector3d(0.4, 0, 0)).norm(), 1e-7);
}

TEST(Problem, TakesTracksThatAreThereAndLeavesOutRejectedOnes) {
  FitInput input = synthetic_input({});
  input.tracks2d["front"][5].rejected = "low_margin";
  input.tracks2d["front"][9].rejected = "low_margin";

  const FitProblem both = problem_of(input);
  const FitProblem pixels = problem_of(input, {.observations = ObservationKind::tracks2d});

  ASSERT_EQ(both.observations.size(), 1u);
  EXPECT_EQ(both.observations[0].kind, "tracks3d");
  ASSERT_EQ(pixels.observations.size(), 1u);
  EXPECT_EQ(pixels.observations[0].rows.size(), input.tracks2d["front"].size() - 2);
  EXPECT_EQ(pixels.rejected.at("low_margin"), 2);
}

TEST(Problem, EstimatesSigmaWhereTracksDoNotStateIt) {
  FitInput input = synthetic_input({.noise_m = 8e-4, .seed = 3});
  for (Position3d& row : input.tracks3d) row.sigma_m = 0;

  const FitProblem problem = problem_of(input);

  EXPECT_NEAR(problem.observations[0].noise, 8e-4, 0.1 * 8e-4);
}

TEST(Problem, LooksAwayFromHeldOutFramesWhenItEstimatesSigma) {
  // Given tracks without sigma whose held-out frames are ten times noisier
  FitInput input = synthetic_input({.held_out_from = 18, .noise_m = 8e-4, .seed = 3});
  const FitInput noisier = synthetic_input({.held_out_from = 18, .noise_m = 8e-3, .seed = 4});
  for (size_t n = 0; n < input.tracks3d.size(); ++n) {
    if (input.tracks3d[n].frame >= 18) input.tracks3d[n] = noisier.tracks3d[n];
    input.tracks3d[n].sigma_m = 0;
  }

  const FitProblem problem = problem_of(input);

  EXPECT_NEAR(problem.observations[0].noise, 8e-4, 0.1 * 8e-4);
}

TEST(Problem, UncertainCameraPoseMakesGravityADirectionWithAPrior) {
  // Given a camera whose turn about its own x axis is known to 3 mrad, about y and z to 1 mrad
  FitInput input = synthetic_input({});
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Identity() * 1e-6;
  covariance(0, 0) = 9e-6;
  input.cameras[0].camera_from_world->covariance = covariance;

  const FitProblem problem = problem_of(input, {.observations = ObservationKind::tracks2d});

  // Then a turn about the world's x axis (the camera's x) has that prior, about y (its z) the other
  ASSERT_EQ(problem.tilt.size(), 2u);
  ASSERT_EQ(problem.priors.size(), 1u);
  const GaussianPrior& prior = problem.priors[0];
  for (const auto& [axis, sigma] : {std::pair(Eigen::Vector3d(Eigen::Vector3d::UnitX()), 3e-3),
                                    std::pair(Eigen::Vector3d(Eigen::Vector3d::UnitY()), 1e-3)}) {
    const Eigen::Vector2d turn = problem.level_axes.transpose() * (sigma * axis);
    Eigen::VectorXd values = problem.space.start();
    values[prior.indices[0]] = turn[0];
    values[prior.indices[1]] = turn[1];
    EXPECT_NEAR(prior.residual(values).norm(), 1.0, 1e-9);

    // and gravity is turned by just that
    const Eigen::Vector3d gravity = parameter_set(problem, values).gravity_m_per_s2;
    const Eigen::Vector3d expected = Eigen::AngleAxisd(sigma, axis) * problem.gravity_m_per_s2;
    EXPECT_LT((gravity - expected).norm(), 1e-12);
  }
}

TEST(Problem, CameraPoseWithoutCovarianceIsKnownToHalfADegree) {
  const FitInput input = synthetic_input({});

  const FitProblem problem = problem_of(input, {.observations = ObservationKind::tracks2d});

  ASSERT_EQ(problem.tilt.size(), 2u);
  ASSERT_EQ(problem.priors.size(), 1u);
  Eigen::VectorXd values = problem.space.start();
  values[problem.priors[0].indices[0]] = 0.006;
  values[problem.priors[0].indices[1]] = -0.008;
  EXPECT_NEAR(problem.priors[0].residual(values).norm(), 1.0, 1e-9);
  EXPECT_TRUE(problem_of(input, {.observations = ObservationKind::tracks3d}).tilt.empty());
}

TEST(Problem, SheetMotionTurnsAboutTheMiddleAndShifts) {
  const FitInput input = synthetic_input({});
  const FitProblem problem = problem_of(input);
  ASSERT_EQ(problem.sheet_motion.size(), 6u);
  Eigen::VectorXd values = problem.space.start();
  EXPECT_LT((parameter_set(problem, values).start_position_m - problem.placed_sheet_m).norm(),
            1e-14);

  values[problem.space.index("sheet_turn_x")] = 0.02;
  values[problem.space.index("sheet_shift_z")] = 0.003;
  const Eigen::Matrix3Xd moved = parameter_set(problem, values).start_position_m;

  const int middle = 4 * 9 + 4;
  EXPECT_LT((moved.col(middle) - problem.placed_sheet_m.col(middle) - Eigen::Vector3d(0, 0, 0.003))
                .norm(),
            1e-12);
  const Eigen::Vector3d arm = problem.placed_sheet_m.col(0) - problem.placed_sheet_m.col(middle);
  const Eigen::Vector3d turned = Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitX()) * arm;
  EXPECT_LT((moved.col(0) - moved.col(middle) - turned).norm(), 1e-12);
}

TEST(Problem, UnweighedClothGetsAnAssumedMass) {
  FitInput input = synthetic_input({});
  input.recording.cloth.mass_kg.reset();

  const FitProblem problem = problem_of(input);

  EXPECT_TRUE(problem.mass_assumed);
  EXPECT_NEAR(problem.cloth.mass_kg.sum(), 0.1 * 0.16, 1e-12);
}

TEST(Problem, EffectsEnterOnlyWhenDeclaredOrAskedFor) {
  FitInput input = synthetic_input({});
  EXPECT_TRUE(problem_of(input).cloth.effects.empty());

  const FitProblem asked = problem_of(input, {.effects = {"viscous_damping"}});
  ASSERT_EQ(asked.effects.size(), 1u);
  EXPECT_GE(asked.effects[0][0].parameter, 0);

  input.recording.declared = {{.name = "viscous_damping", .parameters = {{"rate", {1.5}}}}};
  const FitProblem declared = problem_of(input, {.effects = {"viscous_damping"}});
  ASSERT_EQ(declared.effects.size(), 1u);  // once, though both declared and asked for
  EXPECT_EQ(declared.effects[0][0].parameter, -1);
  EXPECT_EQ(declared.effects[0][0].constant, 1.5);
}

TEST(Problem, AVectorIsDeclaredAsOne) {
  FitInput input = synthetic_input({});
  input.recording.declared = {{.name = "wind", .parameters = {{"q", {0.1, 0.2, 0.3}}}}};

  const FitProblem problem = problem_of(input, {});

  // c is left to the fit; q_x, q_y and q_z have their declared values.
  ASSERT_EQ(problem.effects.size(), 1u);
  EXPECT_EQ(problem.effects[0][0].parameter, problem.space.index("wind.c"));
  for (size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(problem.effects[0][1 + axis].parameter, -1);
    EXPECT_EQ(problem.effects[0][1 + axis].constant, (std::array{0.1, 0.2, 0.3}[axis]));
  }
}

TEST(Problem, RefusesEffectsOfTheMeasurementWhereTheyWouldBeWrong) {
  const FitInput good = synthetic_input({});
  EXPECT_THAT(refusal([&] { problem_of(good, {.effects = {"clock_ofset"}}); }),
              AllOf(HasSubstr("no effect 'clock_ofset'"), HasSubstr("viscous_damping"),
                    HasSubstr("of the measurement: camera_drift, ")));
  // A drive that is measured along would have to be corrected too,
  FitInput tracked = good;
  for (HeldPoint& point : tracked.recording.held) point.motion = HeldMotion::tracked;
  for (const char* name : {"scale", "clock_offset"})
    EXPECT_THAT(refusal([&] { problem_of(tracked, {.effects = {name}}); }),
                HasSubstr("a held point that is tracked"));
  // and the paper's strain limit moves vertices at other velocities than they have.
  EXPECT_THAT(refusal([&] {
                problem_of(good, {.spring_set = SpringSet::louchet5, .effects = {"clock_offset"}});
              }),
              HasSubstr("strain limit"));
  EXPECT_EQ(
      refusal([&] { problem_of(good, {.spring_set = SpringSet::louchet5, .effects = {"scale"}}); }),
      "not refused");
  // 3D tracks have forgotten the camera.
  EXPECT_THAT(refusal([&] { problem_of(good, {.effects = {"focal_error"}}); }),
              HasSubstr("FitOptions::effects: focal_error, and 3D tracks; the pixels of cameras"));
}

TEST(Problem, APriorWeighsItsParameterAlone) {
  const FitProblem problem =
      problem_of(synthetic_input({}), {.priors = {{.name = "shear", .mean = 20, .sigma = 0.5}}});
  Eigen::VectorXd values = problem.space.start();
  values[problem.space.index("shear")] = 21.5;

  ASSERT_EQ(problem.priors.size(), 1u);
  EXPECT_EQ(problem.priors[0].indices, std::vector<int>{problem.space.index("shear")});
  EXPECT_DOUBLE_EQ(problem.priors[0].residual(values).squaredNorm(), 9);
}

TEST(Problem, AnEffectOfTheMeasurementBeginsWhereItsPriorIs) {
  const FitProblem problem =
      problem_of(synthetic_input({}),
                 {.effects = {"clock_offset", "scale"},
                  .priors = {{.name = "clock_offset.time", .mean = 0.01, .sigma = 0.002}}});
  const Eigen::VectorXd start = problem.space.start();
  EXPECT_EQ(start[problem.space.index("clock_offset.time")], 0.01);
  EXPECT_EQ(start[problem.space.index("scale.factor")], 1);
}

TEST(Problem, RefusesPriorsThatSayNothingOrTooMuch) {
  const FitInput input = synthetic_input({});
  const auto refused = [&](const std::vector<ParameterPrior>& priors) {
    return refusal([&] { problem_of(input, {.priors = priors}); });
  };
  EXPECT_THAT(refused({{.name = "sheer", .mean = 20, .sigma = 1}}),
              HasSubstr("did you mean `shear`?"));
  EXPECT_THAT(refused({{.name = "shear", .mean = 1e9, .sigma = 1}}),
              HasSubstr("where the fit looks"));
  EXPECT_THAT(refused({{.name = "shear", .mean = NAN, .sigma = 1}}),
              HasSubstr("where the fit looks"));
  EXPECT_THAT(refused({{.name = "shear", .mean = 10, .sigma = 1}, {"shear", 50, 1}}),
              HasSubstr("given twice"));
  for (const double sigma : {0.0, -1.0, double(NAN)})
    EXPECT_THAT(refusal([&] {
                  FitOptions{.priors = {{"shear", 20, sigma}}}.validate();
                }),
                HasSubstr("FitOptions::priors = shear"));
}

TEST(Problem, RefusesWhatCannotBeFitted) {
  const FitInput good = synthetic_input({});

  FitInput no_first_frame = good;
  std::erase_if(no_first_frame.tracks3d,
                [](const Position3d& row) { return row.frame == 0 && row.marker > 2; });
  EXPECT_THAT(refusal([&] { problem_of(no_first_frame); }), HasSubstr("frame 0 shows too few"));

  FitInput no_pose = good;
  no_pose.cameras[0].camera_from_world.reset();
  EXPECT_THAT(refusal([&] { problem_of(no_pose, {.observations = ObservationKind::tracks2d}); }),
              HasSubstr("has no camera_from_world"));

  FitInput nothing = good;
  nothing.tracks3d.clear();
  nothing.tracks2d.clear();
  EXPECT_THAT(refusal([&] { problem_of(nothing); }), HasSubstr("0 frames are left to fit"));

  EXPECT_THAT(refusal([&] { problem_of(good, {.effects = {"viscous_dampign"}}); }),
              testing::AllOf(HasSubstr("known effects: "), HasSubstr(", viscous_damping")));

  EXPECT_THAT(
      refusal([&] { problem_of(good, {.effects = {"contact_mesh"}}); }),
      HasSubstr("FitOptions::effects: effect 'contact_mesh' has no obstacle to touch; the key "));
  FitInput no_obstacle = good;
  no_obstacle.recording.declared = {{.name = "contact_mesh", .parameters = {}, .line = 12}};
  EXPECT_THAT(refusal([&] { problem_of(no_obstacle); }),
              HasSubstr("recording.yaml:12: effect 'contact_mesh' has no obstacle to touch; "));

  FitInput wrong_parameter = good;
  wrong_parameter.recording.declared = {
      {.name = "viscous_damping", .parameters = {{"ratio", {1.5}}}}};
  EXPECT_THAT(refusal([&] { problem_of(wrong_parameter); }), HasSubstr("no parameter 'ratio'"));
  wrong_parameter.recording.declared = {{.name = "wind", .parameters = {{"q", {1.5}}}}};
  EXPECT_THAT(refusal([&] { problem_of(wrong_parameter); }),
              HasSubstr("wind.q has 1 numbers; a vector [x, y, z]"));
  wrong_parameter.recording.declared = {{.name = "wind", .parameters = {{"c", {1.5, 2}}}}};
  EXPECT_THAT(refusal([&] { problem_of(wrong_parameter); }),
              HasSubstr("wind.c has 2 numbers; one number"));

  FitInput slip = good;
  slip.tracks3d.back().frame = 2'000'000'000;
  EXPECT_THAT(refusal([&] { problem_of(slip); }), HasSubstr("frame 2000000000"));

  FitResult earlier;
  for (const char* name : {"tension_warp", "tension_weft", "shear", "flexion_warp", "flexion_weft",
                           "damping_warp", "damping_weft"})
    earlier.parameters.push_back({.name = name, .value = 1});
  EXPECT_THAT(
      refusal([&] { problem_of(good, {.effects = {"clock_offset"}, .forecast = earlier}); }),
      HasSubstr("asked for in a forecast"));
  EXPECT_THAT(
      refusal([&] { problem_of(good, {.effects = {"viscous_damping"}, .forecast = earlier}); }),
      HasSubstr("holds no value for viscous_damping.rate"));

  FitInput all_held_out = good;
  all_held_out.recording.held_out_from_frame = 1;
  EXPECT_THAT(refusal([&] { problem_of(all_held_out); }), HasSubstr("left to fit"));
}

}  // namespace
}  // namespace clothfit
