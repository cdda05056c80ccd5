// Checks equilibria of hanging cloth: closed forms, three ways to the same minimum, the time
// stepper's resting state, held points, bad input. Not checked here: the energy itself
// (hanging_energy_test.cpp), derivatives (equilibrium_derivatives_test.cpp), how long it takes
// (tests/bench/equilibrium_bench.cpp).

#include "model/rest/equilibrium.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "data/input_error.h"
#include "model/cloth/stability.h"
#include "model/integrate/relax.h"
#include "model/integrate/simulate.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

/// A square cloth that hangs by its two upper corners, and its parameters. The start is flat and
/// lies on its back, so that it has to swing down.
struct Hung {
  Cloth cloth;
  ParameterSet set;
};

Hung hung_by_corners(int vertices_per_side) {
  Hung hung{square_cloth(vertices_per_side), {}};
  hung.cloth.held = {held_at(hung.cloth.mesh, 0, 0), held_at(hung.cloth.mesh, 0.4, 0)};
  hung.set = {.springs = spring_parameters(cotton(), hung.cloth.mesh),
              .start_position_m = flat_positions(hung.cloth.mesh)};
  return hung;
}

constexpr EquilibriumMethod kMethods[] = {EquilibriumMethod::conjugate_gradient,
                                          EquilibriumMethod::cascade,
                                          EquilibriumMethod::multigrid_newton};

double largest_distance_m(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return (a - b).colwise().norm().maxCoeff();
}

/// Returns a chain of elastic links between two points of equal height. The links carry a
/// horizontal tension H and a vertical one that grows by a vertex's weight at every vertex. Link i
/// is (H, V_i) (l0 / T_i + 1 / k), T_i = |(H, V_i)|, from Hooke's law T = k (l - l0).
Eigen::Matrix2Xd discrete_catenary(int vertices, double horizontal_n, double vertex_weight_n,
                                   double l0, double k) {
  Eigen::Matrix2Xd place = Eigen::Matrix2Xd::Zero(2, vertices);
  for (int i = 0; i + 1 < vertices; ++i) {
    const Eigen::Vector2d tension(horizontal_n, (i + 1 - 0.5 * vertices) * vertex_weight_n);
    place.col(i + 1) = place.col(i) + tension * (l0 / tension.norm() + 1 / k);
  }
  return place;
}

TEST(Equilibrium, OfAChainIsTheDiscreteCatenary) {
  // Given two chains side by side, whose ends lie where a horizontal tension of 0.05 N puts them,
  const Mesh mesh{.columns = 2, .rows = 40, .width_m = 0.05, .height_m = 0.78};
  const double vertex_kg = 0.5e-3, k = 30;
  Cloth cloth = Cloth::of(mesh, Eigen::VectorXd::Constant(mesh.vertex_count(), vertex_kg));
  const Eigen::Matrix2Xd expected =
      discrete_catenary(mesh.rows, 0.05, vertex_kg * 9.81, mesh.spacing_t_m(), k);
  for (const int i : {0, mesh.rows - 1})
    for (const int j : {0, 1}) {
      cloth.held.push_back(held_at(mesh, 0.05 * j, i * mesh.spacing_t_m()));
      cloth.held.back().motion = [=](double) {
        return Eigen::Vector3d(0.05 * j, expected(0, i), expected(1, i));
      };
    }
  ParameterSet set{.start_position_m = flat_positions(mesh)};
  set.springs.natural_length_m = flat_lengths(mesh);
  set.springs.stiffness_n_per_m[structural_t] = k;
  set.springs.stiffness_n_per_m[structural_s] = k;

  for (const EquilibriumMethod method : kMethods) {
    SCOPED_TRACE(static_cast<int>(method));

    const EquilibriumResult result =
        find_equilibrium(cloth, set, {.method = method, .tolerance = 1e-10});

    ASSERT_TRUE(result.usable()) << describe(result.reason);
    for (int i = 0; i < mesh.rows; ++i)
      for (int j = 0; j < 2; ++j) {
        const Eigen::Vector3d at(0.05 * j, expected(0, i), expected(1, i));
        // The chain is softest where it is nearly slack; 1e-10 of 0.4 N against some 0.01 N/m.
        EXPECT_LT((result.position_m.col(mesh.vertex(i, j)) - at).norm(), 1e-7) << i << ", " << j;
      }
    EXPECT_LT(expected(1, mesh.rows / 2), -0.2);  // it does sag
  }
}

TEST(Equilibrium, IsTheSameByAllThreeMethods) {
  const Hung hung = hung_by_corners(17);
  std::vector<EquilibriumResult> results;
  for (const EquilibriumMethod method : kMethods)
    results.push_back(
        find_equilibrium(hung.cloth, hung.set, {.method = method, .tolerance = 1e-9}));

  for (const EquilibriumResult& result : results) {
    ASSERT_TRUE(result.usable()) << describe(result.reason);
    EXPECT_LT(result.imbalance, 1e-9);
    EXPECT_NEAR(result.energy_j, results[0].energy_j, 1e-12 * std::abs(results[0].energy_j));
    // The cloth may fold forwards or backwards: two minima, mirror images of one another. The
    // softest motion, a fold that opens, has some 1e-4 N/m: 1e-9 of 0.25 N moves it by 2.5 um.
    Eigen::Matrix3Xd mirrored = result.position_m;
    mirrored.row(1) *= -1;
    EXPECT_LT(std::min(largest_distance_m(result.position_m, results[0].position_m),
                       largest_distance_m(mirrored, results[0].position_m)),
              1e-5);
  }
  EXPECT_GT(largest_distance_m(results[0].position_m, hung.set.start_position_m), 0.3);
}

TEST(Equilibrium, ByTheCascadeIsAsLowAndTakesFewerSteps) {
  // The fabric resists bending and shear well. One that hardly does buckles in a new way on every
  // mesh, and the cascade gains little.
  Hung hung = hung_by_corners(33);
  hung.set.springs.stiffness_n_per_m = {50, 50, 20, 20, 10, 10};
  const auto find = [&](EquilibriumMethod method) {
    return find_equilibrium(hung.cloth, hung.set, {.method = method});
  };
  const EquilibriumResult single = find(EquilibriumMethod::conjugate_gradient);
  const EquilibriumResult cascade = find(EquilibriumMethod::cascade);
  const EquilibriumResult newton = find(EquilibriumMethod::multigrid_newton);

  ASSERT_TRUE(single.usable() && cascade.usable() && newton.usable());
  // The rule leaves each a little above the minimum: the gradient, 1e-3 of the weight, times the
  // way that it still moves, millimetres.
  const double left_j = 1e-3 * 0.25 * 0.01;
  EXPECT_LE(cascade.energy_j, single.energy_j + left_j);
  EXPECT_LE(newton.energy_j, single.energy_j + left_j);
  EXPECT_LT(cascade.evaluations, single.evaluations / 2);
  EXPECT_EQ(cascade.stages.size(), 3u);
  EXPECT_EQ(cascade.stages.front().mesh.columns, 9);
  EXPECT_EQ(single.stages.size(), 1u);
}

TEST(Equilibrium, OfEquation8IsFoundToo) {
  const Mesh mesh = square_mesh(15);
  std::array<double, kSpringTypes> constant_j{};
  const auto length = flat_lengths(mesh);
  const std::array<double, kSpringTypes> stiffness = {50, 50, 20, 20, 10, 10};
  for (size_t t = 0; t < kSpringTypes; ++t) constant_j[t] = stiffness[t] * length[t] * length[t];
  const HangingCloth paper =
      HangingCloth::of_equation8(mesh, constant_j, 1, masses_by_area(mesh, 0.03));
  const std::vector<HeldVertexWeights> held = {held_at(mesh, 0, 0), held_at(mesh, 0.4, 0)};
  Eigen::Matrix3Xd target_m(3, 2);
  target_m << 0, 0.4, 0, 0, 0, 0;

  const EquilibriumResult reference =
      find_equilibrium(paper, held, target_m, flat_positions(mesh),
                       {.method = EquilibriumMethod::conjugate_gradient, .tolerance = 1e-7});
  const EquilibriumResult newton =
      find_equilibrium(paper, held, target_m, flat_positions(mesh), {.tolerance = 1e-7});

  ASSERT_TRUE(reference.usable() && newton.usable());
  EXPECT_NEAR(newton.energy_j, reference.energy_j, 1e-9 * std::abs(reference.energy_j));
}

TEST(Equilibrium, IsWhereTheTimeStepperComesToRest) {
  const Hung hung = hung_by_corners(9);
  const double h = 0.5 * stable_time_step_s(hung.cloth, hung.set);
  ParameterSet resting = hung.set;
  // Each relaxation leaves a percent of the distance, and more of slow folds.
  for (int n = 0; n < 12; ++n)
    resting.start_position_m = relax(hung.cloth, {&resting, 1}, 9.81, 0, h).front().position_m;

  const EquilibriumResult result = find_equilibrium(hung.cloth, hung.set, {.tolerance = 1e-9});

  ASSERT_TRUE(result.usable());
  EXPECT_LT(largest_distance_m(result.position_m, resting.start_position_m), 1e-5);
}

TEST(Equilibrium, HoldsPointsBetweenVertices) {
  Hung hung = hung_by_corners(14);
  const Mesh& mesh = hung.cloth.mesh;
  hung.cloth.held = {held_at(mesh, 0.013, 0.021), held_at(mesh, 0.39, 0), held_at(mesh, 0.2, 0.11)};
  hung.cloth.held[2].motion = [](double time_s) {
    return Eigen::Vector3d(0.2, 0.1, -0.02 * time_s);
  };

  const EquilibriumResult reference =
      find_equilibrium(hung.cloth, hung.set,
                       {.method = EquilibriumMethod::conjugate_gradient, .tolerance = 1e-8}, 1.5);
  const EquilibriumResult result = find_equilibrium(hung.cloth, hung.set, {.tolerance = 1e-9}, 1.5);

  ASSERT_TRUE(reference.usable()) << describe(reference.reason);
  ASSERT_TRUE(result.usable()) << describe(result.reason);
  const Eigen::Matrix3Xd target_m = held_targets_m(hung.cloth, hung.set, 1.5);
  EXPECT_EQ(target_m.col(2), Eigen::Vector3d(0.2, 0.1, -0.03));
  for (int h = 0; h < 3; ++h) {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    for (const auto& [vertex, weight] : hung.cloth.held[static_cast<size_t>(h)].weights)
      place += weight * result.position_m.col(vertex);
    EXPECT_LT((place - target_m.col(h)).norm(), 1e-14) << h;
  }
  EXPECT_NEAR(result.energy_j, reference.energy_j, 1e-6 * std::abs(reference.energy_j));
}

TEST(Equilibrium, TurnsWithTheScene) {
  SCOPED_TRACE("seed 1");
  Uniform uniform(1);
  const Eigen::Matrix3d turn = uniform.rotation();
  const Eigen::Vector3d shift(1, -2, 0.5);
  const Hung hung = hung_by_corners(9);
  Hung turned = hung;
  turned.set.gravity_m_per_s2 = turn * hung.set.gravity_m_per_s2;
  turned.set.start_position_m = (turn * hung.set.start_position_m).colwise() + shift;

  const EquilibriumResult here = find_equilibrium(hung.cloth, hung.set, {.tolerance = 1e-9});
  const EquilibriumResult there = find_equilibrium(turned.cloth, turned.set, {.tolerance = 1e-9});

  const Eigen::Matrix3Xd expected = (turn * here.position_m).colwise() + shift;
  EXPECT_LT(largest_distance_m(there.position_m, expected), 1e-5);
}

TEST(Equilibrium, HasTheSameBitsForAnyNumberOfThreads) {
  // The mesh gives several tasks to every kernel; a few iterations of each method say it all.
  Hung hung = hung_by_corners(121);
  for (const EquilibriumMethod method : kMethods) {
    std::vector<EquilibriumResult> results;
    for (const size_t threads : {1, 2, 5}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      results.push_back(find_equilibrium(
          hung.cloth, hung.set,
          {.method = method, .tolerance = 1e-9, .coarsest_vertices = 70, .most_iterations = 12}));
    }
    for (const EquilibriumResult& result : results) {
      EXPECT_EQ(result.reason, MinimiseReason::iterations_used_up);
      EXPECT_EQ(result.energy_j, results[0].energy_j);
      EXPECT_EQ(result.position_m, results[0].position_m);
    }
  }
}

TEST(Equilibrium, SaysWhenTheClothFalls) {
  // There are only springs across: all rows but the held one fall.
  Hung hung = hung_by_corners(9);
  hung.set.springs.stiffness_n_per_m = {0, 50, 0, 0, 0, 0};
  for (const EquilibriumMethod method : kMethods) {
    const EquilibriumResult result = find_equilibrium(hung.cloth, hung.set, {.method = method});
    EXPECT_EQ(result.reason, MinimiseReason::fell) << describe(result.reason);
    EXPECT_FALSE(result.usable());
  }
}

TEST(Equilibrium, SaysWhenIterationsAreUsedUpOrItIsCancelled) {
  const Hung hung = hung_by_corners(9);
  EXPECT_EQ(find_equilibrium(hung.cloth, hung.set, {.most_iterations = 3}).reason,
            MinimiseReason::iterations_used_up);
  int calls = 0;
  const EquilibriumResult cancelled = find_equilibrium(
      hung.cloth, hung.set, {.go_on = [&](const Mesh&, int, double) { return ++calls < 5; }});
  EXPECT_EQ(cancelled.reason, MinimiseReason::cancelled);
  EXPECT_EQ(calls, 5);
  EXPECT_EQ(cancelled.position_m.cols(), 81);
}

TEST(Equilibrium, RefusesWhatHasNone) {
  const Hung good = hung_by_corners(5);
  const auto expect_refused = [&](const auto& spoil, const std::string& named) {
    Hung bad = good;
    EquilibriumOptions options;
    spoil(bad, options);
    try {
      find_equilibrium(bad.cloth, bad.set, options);
      FAIL() << "no error for " << named;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(named), std::string::npos) << error.what();
    }
  };
  using Options = EquilibriumOptions;
  expect_refused([](Hung& h, Options&) { h.cloth.held.clear(); }, "held");
  expect_refused([](Hung& h, Options&) { h.set.springs.stiffness_n_per_m[2] = -3; }, "type 2");
  expect_refused([](Hung& h, Options&) { h.set.springs.stiffness_n_per_m.fill(0); }, "stiffness");
  expect_refused([](Hung& h, Options&) { h.set.springs.natural_length_m[4] = 0; }, "type 4");
  expect_refused([](Hung& h, Options&) { h.set.gravity_m_per_s2.setZero(); }, "gravity");
  expect_refused([](Hung& h, Options&) { h.cloth.mass_kg[3] = 0; }, "masses");
  expect_refused([](Hung& h, Options&) { h.set.start_position_m(1, 2) = NAN; }, "start");
  expect_refused([](Hung& h, Options&) { h.set.start_position_m.resize(3, 2); }, "start");
  expect_refused([](Hung& h, Options&) { h.cloth.held[0].weights[0].vertex = 99; }, "held");
  expect_refused([](Hung&, Options& o) { o.tolerance = 0; }, "tolerance");
  expect_refused([](Hung&, Options& o) { o.most_iterations = 0; }, "most_iterations");
  EXPECT_TRUE(find_equilibrium(good.cloth, good.set).usable());
}

}  // namespace
}  // namespace clothfit
