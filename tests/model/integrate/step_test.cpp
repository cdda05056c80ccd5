// Checks one time step and many: the paper's scheme in closed form, its conserved quantities, its
// order, held points. Not checked here: the spring force itself (cloth_sweep_test.cpp), how long a
// step may be (stability_test.cpp), and runs over frames (simulate_test.cpp).

#include "model/integrate/step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "model/effects/registry.h"
#include "tests/model/mechanics.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

const Eigen::Vector3d kWeightless = Eigen::Vector3d::Zero();

ParameterSet cotton_set(const Cloth& cloth, const Eigen::Matrix3Xd& start_m) {
  return {.springs = spring_parameters(cotton(), cloth.mesh), .start_position_m = start_m};
}

/// Returns a wave over the flat cloth, smooth enough to stay smooth for a while.
Eigen::Matrix3Xd waved(const Mesh& mesh) {
  Eigen::Matrix3Xd p = flat_positions(mesh);
  for (Eigen::Index k = 0; k < p.cols(); ++k) {
    const double s = p(0, k), t = p(1, k);
    p(0, k) += 0.01 * std::sin(9 * t);
    p(2, k) += 0.03 * std::sin(8 * s + 0.3) * std::cos(7 * t);
  }
  return p;
}

TEST(Step, MovesTwoMassesOnASpringByTheClosedFormOfTheScheme) {
  // Given two vertices of mass m along t joined by one spring, stretched by x0 (a cloth of four
  // vertices with type 0 springs only is two such pairs),
  const Mesh mesh{.columns = 2, .rows = 2, .width_m = 0.1, .height_m = 0.1};
  const double m = 0.01, k = 20, c = 0.02, x0 = 0.004, h = 1e-3;
  const Cloth cloth = Cloth::of(mesh, Eigen::VectorXd::Constant(4, m));
  ParameterSet set{.gravity_m_per_s2 = kWeightless, .start_position_m = flat_positions(mesh)};
  set.springs.natural_length_m = flat_lengths(mesh);
  set.springs.stiffness_n_per_m[structural_t] = k;
  set.springs.damping_ns_per_m[structural_t] = c;
  set.start_position_m(1, 2) += x0;
  set.start_position_m(1, 3) += x0;

  // the extension obeys x_{n+1} = (2 - h gamma - h^2 omega^2) x_n - (1 - h gamma) x_{n-1} with
  // omega^2 = 2 k / m and gamma = 2 c / m,
  const double omega2 = 2 * k / m, gamma = 2 * c / m;
  const double b = 2 - h * gamma - h * h * omega2, d = 1 - h * gamma;
  const std::complex<double> root = std::sqrt(std::complex<double>(b * b / 4 - d));
  const std::complex<double> z1 = b / 2 + root, z2 = b / 2 - root;
  const double x1 = x0 * (1 - h * h * omega2);
  const std::complex<double> a1 = (x1 - x0 * z2) / (z1 - z2), a2 = x0 - a1;

  // when it is stepped, then the extension is a1 z1^n + a2 z2^n.
  SteppedCloth<> run(cloth, set, at_rest(set.start_position_m));
  double smallest_m = x0;
  for (int n = 1; n <= 500; ++n) {
    run.step(h);
    const Eigen::Matrix3Xd p = run.position_m();
    const double extension_m = (p.col(2) - p.col(0)).norm() - 0.1;
    const double expected_m = (a1 * std::pow(z1, n) + a2 * std::pow(z2, n)).real();
    ASSERT_NEAR(extension_m, expected_m, 1e-14) << "step " << n;
    smallest_m = std::min(smallest_m, extension_m);
  }
  EXPECT_LT(smallest_m, -0.5 * x0);  // it did swing
}

TEST(Step, FallsFreelyByTheClosedFormOfTheScheme) {
  const Cloth cloth = square_cloth(7);
  Uniform uniform(1);
  ParameterSet set = cotton_set(cloth, uniform.rotation() * flat_positions(cloth.mesh));
  set.gravity_m_per_s2 = {0.3, -0.2, -9.81};
  const double h = 1e-3;

  SteppedCloth<> run(cloth, set, at_rest(set.start_position_m));
  for (int n = 1; n <= 400; ++n) run.step(h);

  // V_n = n h g, P_n = P_0 + h^2 g n (n + 1) / 2 hold; a sheet at rest feels nothing of its
  // springs.
  const Eigen::Matrix3Xd fallen =
      set.start_position_m.colwise() + set.gravity_m_per_s2 * (h * h * 400 * 401 / 2);
  EXPECT_LT((run.position_m() - fallen).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT(
      (run.velocity_m_per_s().colwise() - 400 * h * set.gravity_m_per_s2).cwiseAbs().maxCoeff(),
      1e-11);
}

TEST(Step, KeepsMomentumAndAngularMomentumWithoutGravity) {
  for (const unsigned seed : {2u, 3u}) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    const Cloth cloth = square_cloth(9);
    ParameterSet set = cotton_set(cloth, crumpled(cloth.mesh, 0.5, uniform));
    set.gravity_m_per_s2 = kWeightless;
    const Eigen::Matrix3Xd v0 = uniform.vectors(cloth.mesh.vertex_count(), 0.5);

    SteppedCloth<> run(cloth, set, v0);
    for (int n = 0; n < 2000; ++n) run.step(1e-4);

    // Each pair of forces sums to zero and acts along the line between its ends at the time it is
    // taken. The scheme therefore keeps both, up to the rounding of 2000 sums of size 0.01.
    const Eigen::Matrix3Xd p = run.position_m(), v = run.velocity_m_per_s();
    EXPECT_LT(
        (momentum_kg_m_per_s(cloth.mass_kg, v) - momentum_kg_m_per_s(cloth.mass_kg, v0)).norm(),
        1e-14);
    EXPECT_LT((torque(p, v * cloth.mass_kg.asDiagonal()) -
               torque(set.start_position_m, v0 * cloth.mass_kg.asDiagonal()))
                  .norm(),
              1e-14);
    EXPECT_GT((v - v0).cwiseAbs().maxCoeff(), 0.1);  // and it did move
  }
}

/// Returns the largest deviation of the total energy from its start over 0.1 s without damping, in
/// joules.
double energy_error_j(double time_step_s) {
  const Cloth cloth = square_cloth(7);
  ParameterSet set = cotton_set(cloth, waved(cloth.mesh));
  set.springs.damping_ns_per_m.fill(0);
  const auto energy_j = [&](const Eigen::Matrix3Xd& p, const Eigen::Matrix3Xd& v) {
    return elastic_energy_j(cloth.springs, set.springs, p) + kinetic_energy_j(cloth.mass_kg, v) -
           set.gravity_m_per_s2.dot(p * cloth.mass_kg);
  };
  SteppedCloth<> run(cloth, set, at_rest(set.start_position_m));
  const double start_j = energy_j(set.start_position_m, at_rest(set.start_position_m));
  double worst_j = 0;
  for (int n = 0; n < std::lround(0.1 / time_step_s); ++n) {
    run.step(time_step_s);
    worst_j =
        std::max(worst_j, std::abs(energy_j(run.position_m(), run.velocity_m_per_s()) - start_j));
  }
  return worst_j;
}

TEST(Step, EnergyErrorFallsWithTheStep) {
  const double coarse_j = energy_error_j(2e-4);
  const double fine_j = energy_error_j(1e-4);

  EXPECT_GT(fine_j, 1e-9);
  EXPECT_NEAR(std::log2(coarse_j / fine_j), 1, 0.1);  // the scheme is of first order
}

TEST(Step, DampingTakesEnergyAway) {
  // Without gravity and held points only the dashpots can change the energy, up to the scheme's own
  // swing.
  const Cloth cloth = square_cloth(7);
  ParameterSet set = cotton_set(cloth, waved(cloth.mesh));
  set.gravity_m_per_s2 = kWeightless;
  for (double& c : set.springs.damping_ns_per_m) c *= 10;
  const double start_j = elastic_energy_j(cloth.springs, set.springs, set.start_position_m);

  SteppedCloth<> run(cloth, set, at_rest(set.start_position_m));
  double before_j = start_j;
  for (int block = 0; block < 10; ++block) {
    for (int n = 0; n < 500; ++n) run.step(5e-5);
    const double now_j = elastic_energy_j(cloth.springs, set.springs, run.position_m()) +
                         kinetic_energy_j(cloth.mass_kg, run.velocity_m_per_s());
    EXPECT_LT(now_j, before_j);
    before_j = now_j;
  }
  EXPECT_LT(before_j, 0.5 * start_j);
}

TEST(Step, TrajectoryConvergesWithTheFirstPowerOfTheStep) {
  // Given a cloth that swings from two corners, one of them moving,
  Cloth cloth = square_cloth(7);
  cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, 0.4, 0)};
  cloth.held[1].motion = [](double time_s) {
    return Eigen::Vector3d(0.4 - 0.05 * (1 - std::cos(6 * time_s)), 0, 0);
  };
  const ParameterSet set = cotton_set(cloth, waved(cloth.mesh));
  const auto end_m = [&](double time_step_s) {
    SteppedCloth<> run(cloth, set, at_rest(set.start_position_m));
    for (int n = 0; n < std::lround(0.2 / time_step_s); ++n) run.step(time_step_s);
    return run.position_m();
  };

  // when the step is halved again and again,
  const Eigen::Matrix3Xd at_4 = end_m(4e-4), at_2 = end_m(2e-4), at_1 = end_m(1e-4);

  // then the trajectory's change halves too.
  EXPECT_NEAR(std::log2((at_4 - at_2).norm() / (at_2 - at_1).norm()), 1, 0.1);
  EXPECT_GT((at_1 - set.start_position_m).norm(), 0.5);
}

TEST(Step, ActsOnEveryLaneByItsOwnParameters) {
  Cloth cloth = square_cloth(5);
  cloth.held = {held_at(cloth.mesh, 0.11, 0.07)};
  add_effect(cloth, "viscous_damping", "test");
  Uniform uniform(4);
  std::vector<ParameterSet> sets;
  for (int l = 0; l < kLanes; ++l) {
    sets.push_back({.springs = spring_parameters(random_fabric(uniform), cloth.mesh),
                    .gravity_m_per_s2 = uniform.vectors(1, 10).col(0),
                    .effects = {{uniform(0, 2)}},
                    .start_position_m = crumpled(cloth.mesh, 0.3, uniform)});
  }
  const LaneParameters<> together = lane_parameters<ExactLanes>(cloth, sets);
  LaneState<> state = LaneState<>::of(cloth);
  for (int l = 0; l < kLanes; ++l)
    state.position_m.set_lane(l, sets[static_cast<size_t>(l)].start_position_m);
  EulerStepper<> stepper(cloth);
  const LaneVectors<> target = stepper.held().locate(state.position_m);

  for (int n = 0; n < 100; ++n) stepper.step(together, target, n * 1e-4, 1e-4, state);

  for (int l = 0; l < kLanes; ++l) {
    SCOPED_TRACE(l);
    const ParameterSet& set = sets[static_cast<size_t>(l)];
    SteppedCloth<> alone(cloth, set, at_rest(set.start_position_m));
    for (int n = 0; n < 100; ++n) alone.step(1e-4);
    EXPECT_EQ(state.position_m.lane(l), alone.position_m());
    EXPECT_EQ(state.velocity_m_per_s.lane(l), alone.velocity_m_per_s());
  }
}

// --- held points ---------------------------------------------------------------------------------

TEST(HeldPoint, AtAVertexIsThatVertex) {
  const Mesh mesh{.columns = 17, .rows = 9, .width_m = 0.4, .height_m = 0.3};
  for (int i = 0; i < mesh.rows; ++i) {
    for (int j = 0; j < mesh.columns; ++j) {
      // Markers are written in decimals; a tenth of a micrometre is not another place.
      const double s = std::min(j * 0.4 / 16 + 5e-9, 0.4), t = std::max(i * 0.3 / 8 - 5e-9, 0.0);
      const HeldVertexWeights held = held_at(mesh, s, t);
      ASSERT_EQ(held.weights.size(), 1u);
      EXPECT_EQ(held.weights[0].vertex, mesh.vertex(i, j));
      EXPECT_EQ(held.weights[0].weight, 1);
    }
  }
}

TEST(HeldPoint, InsideACellIsBilinearBetweenItsCorners) {
  const Mesh mesh{.columns = 5, .rows = 4, .width_m = 0.4, .height_m = 0.3};
  const Eigen::Matrix3Xd flat = flat_positions(mesh);
  Uniform uniform(5);
  for (int n = 0; n < 100; ++n) {
    const double s = uniform(0, 0.4), t = uniform(0, 0.3);
    const HeldVertexWeights held = held_at(mesh, s, t);
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    double sum = 0;
    for (const auto& [vertex, weight] : held.weights) {
      EXPECT_GT(weight, 0);
      place += weight * flat.col(vertex);
      sum += weight;
    }
    EXPECT_NEAR(sum, 1, 1e-15);
    EXPECT_LT((place - Eigen::Vector3d(s, t, 0)).norm(), 1e-15);  // linear functions are exact
  }
}

TEST(HeldPlacement, PutsAVertexExactlyWhereItBelongs) {
  Cloth cloth = square_cloth(5);
  cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, 0.4, 0),
                held_at(cloth.mesh, 0.2, 0.3)};
  Uniform uniform(6);
  const Eigen::Matrix3Xd p = crumpled(cloth.mesh, 0.3, uniform), v = uniform.vectors(25, 1);
  LaneVectors<> position_m = every_lane(p), velocity_m_per_s = every_lane(v);
  const Eigen::Matrix3Xd target = p(Eigen::all, {0, 4, 17}) + uniform.vectors(3, 0.01);
  const double h = 1e-3;

  HeldPlacement<>(cloth).place(every_lane(target), h, position_m, velocity_m_per_s);

  const Eigen::Matrix3Xd moved = position_m.lane(0) - p;
  // The tolerance is one rounding of a coordinate below half a metre.
  EXPECT_LT((position_m.lane(0)(Eigen::all, {0, 4, 17}) - target).cwiseAbs().maxCoeff(), 1e-16);
  EXPECT_EQ((moved.colwise().norm().array() > 0).count(), 3);  // and nothing else moves
  EXPECT_LT((velocity_m_per_s.lane(0) - (v + moved / h)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(HeldPlacement, MovesTheClothByTheSmallestCorrectionInTheNormOfTheMasses) {
  // Given held points inside cells, two of them in one cell, and uneven masses,
  Uniform uniform(7);
  Cloth cloth = square_cloth(5);
  for (double& mass : cloth.mass_kg) mass *= uniform(0.5, 2);
  const Eigen::Matrix2Xd places{{0.03, 0.09, 0.17, 0.33}, {0.02, 0.06, 0.31, 0.2}};
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(4, 25);
  for (Eigen::Index n = 0; n < 4; ++n) {
    cloth.held.push_back(held_at(cloth.mesh, places(0, n), places(1, n)));
    for (const auto& [vertex, weight] : cloth.held.back().weights) a(n, vertex) += weight;
  }
  const Eigen::Matrix3Xd p = crumpled(cloth.mesh, 0.3, uniform), v = uniform.vectors(25, 1);
  const Eigen::Matrix3Xd target = p * a.transpose() + uniform.vectors(4, 0.02);
  LaneVectors<> position_m = every_lane(p), velocity_m_per_s = every_lane(v);
  const double h = 2e-3;

  // when they are placed,
  HeldPlacement<>(cloth).place(every_lane(target), h, position_m, velocity_m_per_s);
  const Eigen::Matrix3Xd moved = position_m.lane(0) - p;

  // then they are at their places,
  EXPECT_LT((position_m.lane(0) * a.transpose() - target).cwiseAbs().maxCoeff(), 1e-15);
  // the correction d minimises d' M d / 2 subject to A d = r, that is M d = A' lambda for some
  // lambda (the conditions of Karush, Kuhn and Tucker),
  const Eigen::MatrixXd pushed = (moved * cloth.mass_kg.asDiagonal()).transpose();
  const Eigen::MatrixXd at = a.transpose();
  const Eigen::MatrixXd lambda = at.colPivHouseholderQr().solve(pushed);
  EXPECT_LT((at * lambda - pushed).norm(), 1e-14 * pushed.norm());
  EXPECT_GT(moved.norm(), 0.01);
  // and the velocities change with the positions.
  EXPECT_LT((velocity_m_per_s.lane(0) - (v + moved / h)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(HeldPlacement, LetsTwoPointsInTheSamePlaceShare) {
  for (const double s : {0.2, 0.17}) {  // at a vertex and inside a cell
    SCOPED_TRACE(s);
    Cloth cloth = square_cloth(5);
    cloth.held = {held_at(cloth.mesh, s, 0.2), held_at(cloth.mesh, s, 0.2)};
    const Eigen::Matrix3Xd p = flat_positions(cloth.mesh);
    LaneVectors<> position_m = every_lane(p), velocity_m_per_s = every_lane(at_rest(p));
    HeldPlacement<> held(cloth);
    Eigen::Matrix3Xd target(3, 2);
    target.col(0) << s, 0.2, 0.01;
    target.col(1) << s, 0.2, 0.03;

    held.place(every_lane(target), 1e-3, position_m, velocity_m_per_s);

    // The two points demand different places: the least squares solution is between.
    EXPECT_LT((held.locate(position_m).lane(0).colwise() - Eigen::Vector3d(s, 0.2, 0.02))
                  .cwiseAbs()
                  .maxCoeff(),
              1e-15);
  }
}

TEST(HeldPlacement, TwoPointsInTheSamePlaceDoNotDisturbARun) {
  Cloth once = square_cloth(5);
  once.held = {held_at(once.mesh, 0.17, 0.02)};
  Cloth twice = once;
  twice.held.push_back(twice.held.front());
  const ParameterSet set = cotton_set(once, hung_flat(once.mesh));

  SteppedCloth<> one(once, set, at_rest(set.start_position_m));
  SteppedCloth<> two(twice, set, at_rest(set.start_position_m));
  for (int n = 0; n < 500; ++n) {
    one.step(2e-4);
    two.step(2e-4);
  }

  EXPECT_LT((one.position_m() - two.position_m()).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(HeldPlacement, AMovingPointPassesItsVelocityToTheDashpots) {
  // Given a pair of vertices at rest length, dashpot between, the upper one held and moved away,
  const Mesh mesh{.columns = 2, .rows = 2, .width_m = 0.1, .height_m = 0.1};
  const double m = 0.01, c = 0.5, u = 0.3, h = 1e-3;
  Cloth cloth = Cloth::of(mesh, Eigen::VectorXd::Constant(4, m));
  cloth.held = {held_at(mesh, 0, 0)};
  cloth.held[0].motion = [=](double time_s) { return Eigen::Vector3d(0, -u * time_s, 0); };
  ParameterSet set{.gravity_m_per_s2 = kWeightless, .start_position_m = flat_positions(mesh)};
  set.springs.natural_length_m = flat_lengths(mesh);
  set.springs.damping_ns_per_m[structural_t] = c;

  // when it has moved for one step, and for a second one,
  SteppedCloth<> run(cloth, set, at_rest(set.start_position_m));
  run.step(h);
  const Eigen::Matrix3Xd after_one = run.velocity_m_per_s();
  run.step(h);
  const Eigen::Matrix3Xd after_two = run.velocity_m_per_s();

  // then it has its velocity at once, and the other follows by h c u / m a step later.
  EXPECT_NEAR(after_one(1, 0), -u, 1e-13);
  EXPECT_EQ(after_one(1, 2), 0);
  EXPECT_NEAR(after_two(1, 0), -u, 1e-13);
  EXPECT_NEAR(after_two(1, 2), -h * c * u / m, 1e-13);
}

}  // namespace
}  // namespace clothfit
