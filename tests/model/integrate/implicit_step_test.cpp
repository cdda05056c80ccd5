// Checks the implicit scheme: closed form of one step, order, stability, momentum, held points. Not
// checked here: the Euler scheme with which it is compared (step_test.cpp).

#include "model/integrate/implicit_step.h"

#include <gtest/gtest.h>

#include <cmath>

#include "model/effects/registry.h"
#include "model/integrate/simulate.h"
#include "tests/model/mechanics.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

const Eigen::Matrix3Xd kNothingHeld(3, 0);

ImplicitState still(const Eigen::Matrix3Xd& position_m) {
  return {position_m, Eigen::Matrix3Xd::Zero(3, position_m.cols())};
}

TEST(ImplicitStep, OfTwoMassesOnASpringIsTheClosedForm) {
  // There are two pairs along t; the extension e of each is an oscillator of reduced mass m / 2.
  const Mesh mesh{.columns = 2, .rows = 2, .width_m = 1, .height_m = 0.1};
  const double m = 0.02, k = 300, c = 0.5, h = 0.02, e0 = 0.004, v0 = 0.3;
  const Cloth cloth = Cloth::of(mesh, Eigen::VectorXd::Constant(4, m));
  ParameterSet set{.gravity_m_per_s2 = Eigen::Vector3d::Zero()};
  set.springs.natural_length_m = flat_lengths(mesh);
  set.springs.stiffness_n_per_m[structural_t] = k;
  set.springs.damping_ns_per_m[structural_t] = c;
  ImplicitState state = still(flat_positions(mesh));
  for (const int far : {2, 3}) {
    state.position_m(1, far) += e0;
    state.velocity_m_per_s(1, far) = v0;
  }

  ASSERT_TRUE(ImplicitStepper(cloth).step(set, kNothingHeld, 0, h, state));

  const double omega2 = 2 * k / m, gamma = 2 * c / m;
  const double v1 = (v0 - h * omega2 * e0) / (1 + h * gamma + h * h * omega2);
  EXPECT_NEAR(state.velocity_m_per_s(1, 2) - state.velocity_m_per_s(1, 0), v1, 1e-12);
  EXPECT_NEAR(state.position_m(1, 2) - state.position_m(1, 0), 0.1 + e0 + h * v1, 1e-13);
}

/// A small cloth that hangs by a corner and a point between vertices, which moves.
struct Swinging {
  Cloth cloth = square_cloth(5);
  ParameterSet set;
  Swinging() {
    cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, 0.35, 0.02)};
    cloth.held[1].motion = [](double time_s) {
      return Eigen::Vector3d(0.35 - 0.2 * time_s * time_s, 0.02, 0);
    };
    set = {.springs = spring_parameters(cotton(), cloth.mesh),
           .start_position_m = flat_positions(cloth.mesh)};
  }
  Eigen::Matrix3Xd target_m(double time_s) const {
    Eigen::Matrix3Xd target(3, 2);
    target << Eigen::Vector3d::Zero(), cloth.held[1].motion(time_s);
    return target;
  }
  ImplicitState run(double duration_s, int steps) const {
    ImplicitStepper stepper(cloth);
    ImplicitState state = still(set.start_position_m);
    const double h = duration_s / steps;
    for (int n = 0; n < steps; ++n)
      EXPECT_TRUE(stepper.step(set, target_m((n + 1) * h), n * h, h, state));
    return state;
  }
};

TEST(ImplicitStep, ConvergesToTheEulerSchemesLimitInFirstOrder) {
  const Swinging swinging;
  const double duration_s = 0.2;
  const Eigen::Matrix3Xd limit = simulate(swinging.cloth, {&swinging.set, 1},
                                          {.frame_time_s = {0, duration_s}, .time_step_s = 2e-6})
                                     .front()
                                     .position_m.back();

  std::vector<double> errors;
  for (const int steps : {800, 1600, 3200})
    errors.push_back((swinging.run(duration_s, steps).position_m - limit).norm());

  // Halving the step halves the error, up to its second-order part.
  EXPECT_NEAR(errors[0] / errors[1], 2, 0.25);
  EXPECT_NEAR(errors[1] / errors[2], 2, 0.15);
  EXPECT_GT((limit - swinging.set.start_position_m).norm(), 0.1);
}

TEST(ImplicitStep, StaysCalmAtAFramesLengthWhereTheEulerSchemeDoesNot) {
  Swinging stiff;
  for (double& k : stiff.set.springs.stiffness_n_per_m) k *= 1000;
  const double h = 1.0 / 60;
  EXPECT_FALSE(simulate(stiff.cloth, {&stiff.set, 1}, {.frame_time_s = {0, 1}, .time_step_s = h})
                   .front()
                   .usable());

  ImplicitStepper stepper(stiff.cloth);
  ImplicitState state = still(stiff.set.start_position_m);
  double lowest = 0, fastest = 0;
  for (int n = 0; n < 300; ++n) {
    // The moving point stops before the cloth is pulled tight.
    const double until_s = std::min((n + 1) * h, 0.5);
    ASSERT_TRUE(stepper.step(stiff.set, stiff.target_m(until_s), n * h, h, state));
    lowest = std::min(lowest, state.position_m.row(2).minCoeff());
    fastest = std::max(fastest, state.velocity_m_per_s.colwise().norm().maxCoeff());
  }
  // It is no faster than its fall from the diagonal's height, nor lower than its diagonal hangs.
  EXPECT_LT(fastest, std::sqrt(2 * 9.81 * 0.6) + 1);
  EXPECT_GT(lowest, -0.6);
  EXPECT_LT(state.velocity_m_per_s.norm(), 0.5);
}

TEST(ImplicitStep, KeepsTheMomentumOfFreeCloth) {
  SCOPED_TRACE("seed 1");
  Uniform uniform(1);
  const Cloth cloth = square_cloth(6);
  const ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh)};
  ImplicitState state{crumpled(cloth.mesh, 0.3, uniform), uniform.vectors(36, 1)};
  const Eigen::Matrix3Xd velocity_before = state.velocity_m_per_s;
  const Eigen::Vector3d before = momentum_kg_m_per_s(cloth.mass_kg, velocity_before);
  ImplicitStepper stepper(cloth);

  const double h = 0.01;
  for (int n = 0; n < 20; ++n) ASSERT_TRUE(stepper.step(set, kNothingHeld, n * h, h, state));

  // Gravity brings this in 0.2 s, and nothing else does.
  const Eigen::Vector3d expected = before + 0.2 * 0.025 * set.gravity_m_per_s2;
  EXPECT_LT((momentum_kg_m_per_s(cloth.mass_kg, state.velocity_m_per_s) - expected).norm(), 1e-13);
  EXPECT_GT((state.velocity_m_per_s - velocity_before).norm(), 1);
}

TEST(ImplicitStep, PutsHeldPointsWhereTheyBelong) {
  const Swinging swinging;
  const ImplicitState state = swinging.run(0.3, 20);
  const HeldProjection held(swinging.cloth.mesh, swinging.cloth.held);
  const MeshField position = MeshField::of(FieldLayout::of(swinging.cloth.mesh), state.position_m);
  EXPECT_LT((held.locate(position) - swinging.target_m(0.3)).norm(), 1e-12);
}

TEST(ImplicitStep, TakesEffectsFromTheBeginningOfTheStep) {
  // Unstretched cloth glides: only the drag of still air acts, at rate C.
  Cloth cloth = square_cloth(4);
  add_effect(cloth, "viscous_damping", "test");
  const ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh),
                         .gravity_m_per_s2 = Eigen::Vector3d::Zero(),
                         .effects = {{2.0}}};
  ImplicitState state = still(flat_positions(cloth.mesh));
  state.velocity_m_per_s.colwise() = Eigen::Vector3d(1, 2, 3);

  ASSERT_TRUE(ImplicitStepper(cloth).step(set, kNothingHeld, 0, 0.01, state));

  const Eigen::Vector3d expected = (1 - 0.01 * 2.0) * Eigen::Vector3d(1, 2, 3);
  EXPECT_LT((state.velocity_m_per_s.colwise() - expected).norm(), 1e-12);
}

}  // namespace
}  // namespace clothfit
