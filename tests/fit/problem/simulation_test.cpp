// Checks the way from model files and fits to simulations and back. Not checked here: the reader
// and the writer of model files (tests/data/model_description_test.cpp), and the steps of a
// simulation (tests/model).

#include "fit/problem/simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/input_error.h"
#include "fit/problem/parameterised_model.h"
#include "model/cloth/stability.h"
#include "model/fabric/spring_vector.h"
#include "model/integrate/simulate.h"
#include "tests/data/temporary_folder.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

ModelDescription small_model() {
  ModelDescription model;
  model.name = "small";
  model.cloth = {.width_m = 0.3, .height_m = 0.4, .mass_kg = 0.02};
  model.mesh_columns = 7;
  model.mesh_rows = 9;
  for (const FabricParameterName& parameter : kFabricParameters) model.fabric[parameter.name] = 20;
  model.fabric["damping_warp"] = model.fabric["damping_weft"] = 1e-3;
  model.frame_rate_hz = 60;
  model.frame_time_s = *frame_times(60, 0.5);
  return model;
}

double largest_difference_m(const std::vector<Eigen::Matrix3Xd>& a,
                            const std::vector<Eigen::Matrix3Xd>& b) {
  double largest = a.size() == b.size() ? 0 : INFINITY;
  for (size_t f = 0; f < a.size(); ++f)
    largest = std::max(largest, (a[f] - b[f]).cwiseAbs().maxCoeff());
  return largest;
}

TEST(Simulation, PlacesTheSheetWhereTheModelSays) {
  ModelDescription model = small_model();
  model.sheet.position_m = {1, 2, 3};
  // The sheet takes a quarter turn about x: t runs down.
  model.sheet.orientation = Eigen::AngleAxisd(-M_PI / 2, Eigen::Vector3d::UnitX());

  const Simulation simulation = make_simulation(model);

  const Mesh& mesh = simulation.cloth.mesh;
  const Eigen::Matrix3Xd& p = simulation.parameters.start_position_m;
  EXPECT_LT((p.col(mesh.vertex(0, 0)) - Eigen::Vector3d(1, 2, 3)).norm(), 1e-15);
  EXPECT_LT((p.col(mesh.vertex(0, 6)) - Eigen::Vector3d(1.3, 2, 3)).norm(), 1e-15);
  EXPECT_LT((p.col(mesh.vertex(8, 0)) - Eigen::Vector3d(1, 2, 2.6)).norm(), 1e-15);
  EXPECT_NEAR(simulation.cloth.mass_kg.sum(), 0.02, 1e-17);
}

TEST(Simulation, FollowsThePathsOfItsHeldPoints) {
  ModelDescription model = small_model();
  model.held.push_back({.point = {.edge = ClothEdge::top}, .path = {}});
  model.held.push_back({.point = {.at_m = {0.3, 0.4}, .motion = HeldMotion::path},
                        .path = {.time_s = {0, 0.5, 1},
                                 .position_m = {{0.3, 0.4, 0}, {0.3, 0.4, 0.1}, {0.3, 0.4, 0.2}}}});
  const Simulation simulation = make_simulation(model);

  const SimulateResult result = run(simulation, default_time_step_s(simulation));

  ASSERT_TRUE(result.usable());
  const Mesh& mesh = simulation.cloth.mesh;
  EXPECT_EQ(simulation.cloth.held.size(), 8u);
  for (size_t f = 0; f < result.position_m.size(); ++f) {
    const double time_s = simulation.frame_time_s[f];
    EXPECT_LT(
        (result.position_m[f].col(mesh.vertex(8, 6)) - Eigen::Vector3d(0.3, 0.4, 0.2 * time_s))
            .norm(),
        1e-12);
    EXPECT_LT((result.position_m[f].col(mesh.vertex(0, 3)) - Eigen::Vector3d(0.15, 0, 0)).norm(),
              1e-12);
  }
}

TEST(Simulation, LeavesParametersOfAnEffectThatAreNotGivenNeutral) {
  ModelDescription model = small_model();
  model.effects = {{.name = "wind", .parameters = {{"q", {0.1, 0.2, 0.3}}}}};

  const Simulation simulation = make_simulation(model);

  EXPECT_EQ(simulation.parameters.effects, (std::vector<std::vector<double>>{{0, 0.1, 0.2, 0.3}}));
}

TEST(Simulation, RefusesEffectsThatDoNotExist) {
  const auto refusal = [](const std::string& name, const std::string& parameter, double value) {
    ModelDescription model = small_model();
    model.file = "m.yaml";
    model.effects = {{.name = name, .parameters = {{parameter, {value}}}, .line = 7}};
    try {
      make_simulation(model);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  using testing::StartsWith;

  EXPECT_THAT(refusal("wnid", "c", 1), StartsWith("m.yaml:7: there is no effect 'wnid'; known "));
  EXPECT_THAT(refusal("wind", "b", 1), StartsWith("m.yaml:7: effect wind has no parameter 'b'; "));
  EXPECT_THAT(refusal("wind", "c", -1), StartsWith("m.yaml:7: wind.c = -1; "));
  EXPECT_THAT(refusal("viscous_damping", "rate", -1), StartsWith("m.yaml:7: viscous_damping.rate"));
  EXPECT_EQ(refusal("wind", "q_x", -1), "accepted");
}

TEST(Simulation, LimitsStrainWhereTheModelSays) {
  ModelDescription model = small_model();
  for (const char* name : {"tension_warp", "tension_weft", "shear", "flexion_warp", "flexion_weft"})
    model.fabric[name] = 2;
  model.held.push_back({.point = {.edge = ClothEdge::top}, .path = {}});
  model.sheet.orientation = Eigen::AngleAxisd(-M_PI / 2, Eigen::Vector3d::UnitX());
  const auto longest_share = [&] {
    const Simulation simulation = make_simulation(model);
    const SimulateResult result = run(simulation, 5e-4);
    const Eigen::Matrix3Xd& p = result.position_m.back();
    const Mesh& mesh = simulation.cloth.mesh;
    return (p.col(mesh.vertex(1, 3)) - p.col(mesh.vertex(0, 3))).norm() / mesh.spacing_t_m();
  };

  EXPECT_GT(longest_share(), 1.1);
  model.critical_elongation = 0.05;
  model.strain_limit = StrainLimitKind::consistent;
  EXPECT_LT(longest_share(), 1.05 + 1.1e-3);  // the limit's tolerance is 1e-3
  for (const auto& [kind, mode] : {std::pair{StrainLimitKind::off, StrainLimitMode::off},
                                   {StrainLimitKind::positions, StrainLimitMode::positions},
                                   {StrainLimitKind::rates_first, StrainLimitMode::rates_first},
                                   {StrainLimitKind::consistent, StrainLimitMode::consistent}}) {
    model.strain_limit = kind;
    EXPECT_EQ(make_simulation(model).cloth.strain_limit.mode, mode);
  }
}

TEST(Simulation, RestsOnTheObstacleThatAModelFileNames) {
  // Given a table 0.7 m high, and a sheet let go level 1 cm above it
  const TemporaryFolder folder;
  folder.write("scene/table.obj",
               "v -1 -1 0.5\nv 1 -1 0.5\nv 1 1 0.5\nv -1 1 0.5\n"
               "v -1 -1 0.7\nv 1 -1 0.7\nv 1 1 0.7\nv -1 1 0.7\n"
               "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  const std::string falling =
      "format: clothfit-model/1\nname: sheet\n"
      "cloth: {size: [0.3, 0.4], mass: 0.024, mesh: {columns: 7, rows: 9}}\n"
      "fabric: {tension_warp: 20, tension_weft: 20, shear: 10, flexion_warp: 5, flexion_weft: 5, "
      "damping_warp: 1e-3, damping_weft: 1e-3}\n"
      "start: {kind: released_flat, position: [0, 0, 0.71]}\n"
      "time: {frame_rate: 50, duration: 1}\nobstacle: scene/table.obj\n";
  const auto heights_m = [&](const std::string& text) -> Eigen::VectorXd {
    const Simulation simulation = make_simulation(read_model(folder.write("sheet.yaml", text)));
    const SimulateResult result = run(simulation, 2e-4);
    EXPECT_TRUE(result.usable());
    return result.position_m.back().row(2);
  };

  // When it may touch the table, and when it may not
  const Eigen::VectorXd resting = heights_m(falling +
                                            "effects: [{effect: contact_mesh, parameters: "
                                            "{stiffness: 2e4, damping: 60, friction: 0.3}}]");
  const Eigen::VectorXd passing = heights_m(falling);

  // Then every vertex sinks in until its area's push, k A depth, carries its mass: 0.1 mm. There a
  // tenth of the dashpot acts. After a second the bounce is below a hundredth of a micrometre.
  const double depth_m = 0.024 / (0.3 * 0.4) * 9.81 / 2e4;
  EXPECT_LT((resting.array() - (0.7 - depth_m)).abs().maxCoeff(), 1e-8);
  EXPECT_LT(passing.maxCoeff(), 0.71 - 0.5 * 9.81);
}

TEST(Simulation, RefusesContactWithAMeshWithoutAnObstacle) {
  ModelDescription model = small_model();
  model.file = "m.yaml";
  model.effects = {{.name = "contact_mesh", .parameters = {{"stiffness", {1e4}}}, .line = 7}};

  try {
    make_simulation(model);
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::StartsWith("m.yaml:7: effect 'contact_mesh' has no obstacle "
                                                  "to touch; the key `obstacle: FILE.obj`"));
  }
}

TEST(Simulation, OfADescribedFitIsTheFitsOwn) {
  for (const double tilt : {0.0, 0.01}) {
    SCOPED_TRACE(tilt);
    FitInput input = synthetic_input({});
    input.recording.held = {{.at_m = {0, 0}, .motion = HeldMotion::fixed},
                            {.at_m = {0.4, 0}, .motion = HeldMotion::tracked}};
    const FitProblem problem = make_problem(input, {.effects = {"wind"}}, 9, 9);
    Eigen::VectorXd values = problem.space.start();
    values[problem.space.index("sheet_turn_x")] = tilt;
    values[problem.space.index("sheet_shift_z")] = 0.002;
    values[problem.space.index("shear")] = 17;
    for (const char* name : {"tension_warp", "tension_weft"})
      values[problem.space.index(name)] = 45;
    for (const char* name : {"wind.c", "wind.q_x", "wind.q_y", "wind.q_z"})
      values[problem.space.index(name)] = 0.02;
    const double time_step_s =
        0.5 * stable_time_step_s(problem.cloth, parameter_set(problem, values));

    const Simulation simulation = make_simulation(describe_model(problem, input.recording, values));

    const SimulateResult result = run(simulation, time_step_s);
    const auto own = run_model(problem, {values}, problem.frames(), time_step_s).front().position_m;
    ASSERT_FALSE(own.empty());
    // A pose is rounded on its way through a quaternion (1e-16), the path through a second spline
    // (1e-13 of its sizes). Half a second of motion multiplies that by a hundred or so.
    EXPECT_LT(largest_difference_m(result.position_m, own), 1e-9);
    EXPECT_GT((own.back() - own.front()).norm(), 0.1);
  }
}

TEST(Simulation, OfADescribedFitMovesAsTheCorrectedDriveDid) {
  FitInput input = synthetic_input({});
  for (HeldPoint& held : input.recording.held) held.motion = HeldMotion::tracked;
  // Knots lie between frames, and held-out frames behind the last.
  const FitProblem problem = make_problem(input, {.drive_knots = 7}, 5, 5);
  Eigen::VectorXd values = problem.space.start();
  for (int p = 0; p < problem.space.size(); ++p)
    if (problem.space.parameters[static_cast<size_t>(p)].role == ParameterRole::drive)
      values[p] = 2e-3 * std::sin(5.0 * p);
  const double time_step_s =
      0.5 * stable_time_step_s(problem.cloth, parameter_set(problem, values));

  const Simulation simulation = make_simulation(describe_model(problem, input.recording, values));

  const SimulateResult result = run(simulation, time_step_s);
  const auto own = run_model(problem, {values}, problem.frames(), time_step_s).front().position_m;
  ASSERT_FALSE(own.empty());
  // As in the test before, the sum of two splines is one, with the knots of both.
  EXPECT_LT(largest_difference_m(result.position_m, own), 1e-9);
  const auto plain = run_model(problem, {problem.space.start()}, problem.frames(), time_step_s);
  EXPECT_GT(largest_difference_m(plain.front().position_m, own), 1e-3);
}

TEST(Simulation, OfADescribedFitTouchesTheRecordingsObstacle) {
  // Given a cloth that swings from y > 0 towards a wall at y = -0.02 m
  constexpr double kWall_m = -0.02;
  FitInput input = synthetic_input({});
  SurfaceMesh wall{Eigen::Matrix3Xd(3, 4), Eigen::Matrix3Xi(3, 2)};
  wall.vertex_m << -1, 1, 1, -1,  //
      kWall_m, kWall_m, kWall_m, kWall_m, -1, -1, 1, 1;
  wall.triangle << 0, 0, 3, 2, 2, 1;
  input.recording.obstacle = wall;
  const FitProblem problem = make_problem(input, {.effects = {"contact_mesh"}}, 9, 9);
  Eigen::VectorXd values = problem.space.start();
  const auto rearmost_m = [&](double stiffness_pa_per_m) {
    values[problem.space.index("contact_mesh.stiffness")] = stiffness_pa_per_m;
    const double time_step_s =
        0.5 * stable_time_step_s(problem.cloth, parameter_set(problem, values));
    const auto own = run_model(problem, {values}, problem.frames(), time_step_s).front().position_m;
    const Simulation simulation = make_simulation(describe_model(problem, input.recording, values));
    // As above, the sheet's pose is rounded.
    EXPECT_LT(largest_difference_m(run(simulation, time_step_s).position_m, own), 1e-9);
    double rearmost = 0;
    for (const Eigen::Matrix3Xd& position_m : own)
      rearmost = std::min(rearmost, position_m.row(1).minCoeff());
    return rearmost;
  };
  for (const char* name : {"contact_mesh.damping", "contact_mesh.friction"})
    values[problem.space.index(name)] = 0;

  EXPECT_LT(rearmost_m(0), kWall_m - 0.05);
  EXPECT_GT(rearmost_m(2e4), kWall_m - 0.01);
}

/// Writes a model to model.yaml and reads it back.
ModelDescription on_disk(const ModelDescription& model) {
  const TemporaryFolder folder;
  write_model(model, folder.path());
  return read_model(folder.path() / "model.yaml");
}

TEST(Simulation, OfAFitOfThePapersSpringsIsTheFitsOwnFromItsFileToo) {
  for (const SpringSet set : {SpringSet::louchet5, SpringSet::louchet18}) {
    SCOPED_TRACE(to_string(set));
    const FitInput input = synthetic_input({});
    const FitProblem problem = make_problem(input, {.spring_set = set}, 9, 9);
    Eigen::VectorXd values = problem.space.start();
    for (int p = 0; p < problem.space.size(); ++p) {
      const FitParameter& parameter = problem.space.parameters[static_cast<size_t>(p)];
      if (parameter.role == ParameterRole::springs) values[p] *= 1 + 0.01 * (p % 7) / 3.0;
      if (parameter.name.starts_with("critical_elongation")) values[p] = 0.05;
    }
    const double time_step_s =
        0.5 * stable_time_step_s(problem.cloth, parameter_set(problem, values));

    const ModelDescription model = describe_model(problem, input.recording, values);
    const Simulation simulation = make_simulation(on_disk(model));

    // Every number of the springs is right to the last bit. The sheet's pose is rounded, and the
    // limit, which acts or does not, multiplies that.
    const SpringParameters springs = parameter_set(problem, values).springs;
    EXPECT_EQ(to_vector(simulation.parameters.springs), to_vector(springs));
    EXPECT_EQ(simulation.cloth.strain_limit.mode, StrainLimitMode::positions);
    const SimulateResult result = run(simulation, time_step_s);
    const auto own = run_model(problem, {values}, problem.frames(), time_step_s).front().position_m;
    ASSERT_FALSE(own.empty());
    EXPECT_LT(largest_difference_m(result.position_m, own), 1e-6);
    EXPECT_GT((own.back() - own.front()).norm(), 0.1);
  }
}

TEST(Simulation, OfAFitThatBeginsInMotionIsTheFitsOwnToTheLastBit) {
  FitInput input = synthetic_input({});
  input.recording.start = StartKind::unknown;
  const FitProblem problem = make_problem(input, {.start_nodes = 3}, 9, 9);
  Eigen::VectorXd values = problem.space.start();
  values[problem.space.index("start_position_4_y")] = 0.01;
  values[problem.space.index("start_velocity_4_y")] = 1;
  const double time_step_s =
      0.5 * stable_time_step_s(problem.cloth, parameter_set(problem, values));

  const Simulation simulation =
      make_simulation(on_disk(describe_model(problem, input.recording, values)));

  EXPECT_EQ(simulation.start, StartKind::unknown);
  const SimulateResult result = run(simulation, time_step_s);
  const auto own = run_model(problem, {values}, problem.frames(), time_step_s).front().position_m;
  ASSERT_FALSE(own.empty());
  EXPECT_EQ(largest_difference_m(result.position_m, own), 0);
  // It moves at once: 1 m/s in the middle, for a sixtieth of a second.
  EXPECT_GT((own[1] - own[0]).colwise().norm().maxCoeff(), 0.01);
}

TEST(Simulation, StartsAtRestWhereTheModelSays) {
  ModelDescription model = small_model();
  model.start = StartKind::at_rest;
  model.held.push_back({.point = {.edge = ClothEdge::top}, .path = {}});
  model.sheet.orientation = Eigen::AngleAxisd(-M_PI / 2, Eigen::Vector3d::UnitX());
  const Simulation simulation = make_simulation(model);

  const SimulateResult result = run(simulation, default_time_step_s(simulation));

  ASSERT_TRUE(result.usable());
  const auto bottom = simulation.cloth.mesh.vertex(8, 3);
  EXPECT_LT(result.position_m.front()(2, bottom), -0.4);  // it hangs longer than it is
  // After relaxing, the way left to rest is below a percent of the stretch, a few millimetres.
  EXPECT_LT((result.position_m.back() - result.position_m.front()).cwiseAbs().maxCoeff(), 2e-3);
}

}  // namespace
}  // namespace clothfit
