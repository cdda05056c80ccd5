// The two kernels of a time step: the springs' pull and the Euler update. Not checked here: the
// whole step with gravity, effects and held points (step_test.cpp), and how long a step may be
// (stability_test.cpp).

#include "model/kernels/spring_force.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/model/mechanics.h"
#include "tests/model/random_cloth.h"
#include "tests/model/scalar_reference.h"
#include "tests/model/spring_force_variants.h"

namespace clothfit {
namespace {

/// One spring between vertices 0 and 1 of type structural_t.
SpringNet one_spring() {
  SpringNet net;
  net[structural_t] = {{.a = 0, .b = 1}};
  return net;
}

SpringParameters one_spring_parameters(double length_m, double stiffness, double damping) {
  SpringParameters springs;
  springs.natural_length_m[structural_t] = length_m;
  springs.stiffness_n_per_m[structural_t] = stiffness;
  springs.damping_ns_per_m[structural_t] = damping;
  return springs;
}

/// Springs as a search may try them: not at rest in the flat cloth.
SpringParameters random_springs(const Mesh& mesh, Uniform& uniform) {
  SpringParameters springs = spring_parameters(random_fabric(uniform), mesh);
  for (double& length : springs.natural_length_m) length *= uniform(0.8, 1.1);
  return springs;
}

SpringParameters without_stiffness(SpringParameters springs) {
  springs.stiffness_n_per_m.fill(0);
  return springs;
}

struct CrumpledState {
  Mesh mesh;
  SpringNet net;
  SpringParameters springs;
  Eigen::Matrix3Xd position_m, velocity_m_per_s;

  CrumpledState(Uniform& uniform, int vertices_per_side)
      : mesh(square_mesh(vertices_per_side)),
        net(make_springs(mesh)),
        springs(random_springs(mesh, uniform)),
        position_m(crumpled(mesh, 0.6, uniform)),
        velocity_m_per_s(uniform.vectors(mesh.vertex_count(), 2.0)) {}
};

TEST(SpringForce, PullsTheEndsOfAStretchedSpringTogether) {
  const SpringParameters springs = one_spring_parameters(0.10, 50, 0);
  Eigen::Matrix3Xd position_m = Eigen::Matrix3Xd::Zero(3, 2);
  position_m(0, 1) = 0.11;

  const Eigen::Matrix3Xd force_n =
      spring_forces_n(one_spring(), springs, position_m, at_rest(position_m));

  EXPECT_NEAR(force_n(0, 0), 50 * 0.01, 1e-14);  // k (l - l0)
  EXPECT_EQ(force_n.col(1), -force_n.col(0));
  EXPECT_EQ(force_n.bottomRows<2>().cwiseAbs().maxCoeff(), 0);
}

TEST(SpringForce, PushesTheEndsOfACompressedSpringApart) {
  const SpringParameters springs = one_spring_parameters(0.10, 50, 0);
  Eigen::Matrix3Xd position_m(3, 2);
  position_m << 0.3, 0.3, 0.1, 0.1, -0.5, -0.42;

  const Eigen::Matrix3Xd force_n =
      spring_forces_n(one_spring(), springs, position_m, at_rest(position_m));

  EXPECT_NEAR(force_n(2, 1), 50 * 0.02, 1e-14);
}

TEST(SpringForce, DashpotResistsTheRateOfStretchingOnly) {
  const SpringParameters springs = one_spring_parameters(0.10, 50, 0.3);
  Eigen::Matrix3Xd position_m = Eigen::Matrix3Xd::Zero(3, 2);
  position_m.col(1) << 0.06, 0.08, 0;  // at its natural length
  Eigen::Matrix3Xd velocity(3, 2);
  const Eigen::Vector3d along(0.6, 0.8, 0), across(0.8, -0.6, 0);
  velocity.col(0) << 7, -3, 2;
  velocity.col(1) = velocity.col(0) + 2.0 * along + 5.0 * across;

  const Eigen::Matrix3Xd force_n = spring_forces_n(one_spring(), springs, position_m, velocity);

  // c dl/dt along the spring, to the rounding of velocities of size 10.
  EXPECT_LT((force_n.col(0) - 0.3 * 2.0 * along).norm(), 1e-14);
}

TEST(SpringForce, AddsToWhatIsThere) {
  const SpringParameters springs = one_spring_parameters(0.10, 50, 0);
  Eigen::Matrix3Xd position_m = Eigen::Matrix3Xd::Zero(3, 2);
  position_m(0, 1) = 0.11;
  LaneVectors force_n = every_lane(Eigen::Matrix3Xd::Constant(3, 2, 4.0));

  add_spring_forces(one_spring(), every_lane(springs), every_lane(position_m),
                    every_lane(at_rest(position_m)), force_n);

  EXPECT_NEAR(force_n.lane(0)(0, 0), 4.5, 1e-14);
  EXPECT_EQ(force_n.lane(0)(1, 0), 4.0);
}

TEST(SpringForce, SumsToZeroAndExertsNoTorque) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    const CrumpledState s(uniform, 9);

    const Eigen::Matrix3Xd force_n =
        spring_forces_n(s.net, s.springs, s.position_m, s.velocity_m_per_s);

    const double size_n = force_n.cwiseAbs().sum();
    EXPECT_GT(size_n, 1);
    EXPECT_LT(force_n.rowwise().sum().norm(), 1e-14 * size_n);
    EXPECT_LT(torque(s.position_m, force_n).norm(), 1e-14 * size_n);
  }
}

TEST(SpringForce, IsMinusTheGradientOfTheElasticEnergy) {
  for (const unsigned seed : {4u, 5u}) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    const CrumpledState s(uniform, 5);

    const Eigen::Matrix3Xd force_n =
        spring_forces_n(s.net, s.springs, s.position_m, at_rest(s.position_m));

    const double step_m = 1e-6;
    for (Eigen::Index n = 0; n < force_n.size(); ++n) {
      Eigen::Matrix3Xd ahead = s.position_m, behind = s.position_m;
      ahead.reshaped()[n] += step_m;
      behind.reshaped()[n] -= step_m;
      const double gradient_n =
          (elastic_energy_j(s.net, s.springs, ahead) - elastic_energy_j(s.net, s.springs, behind)) /
          (2 * step_m);
      // Rounding of an energy below 10 J over the step: 1e-9; the difference's own error k h^2 /
      // l^2 l is below 1e-7 for springs of 1 cm.
      EXPECT_NEAR(force_n.reshaped()[n], -gradient_n, 1e-6 * (1 + std::abs(gradient_n)));
    }
  }
}

TEST(SpringForce, TurnsWithTheScene) {
  Uniform uniform(6);
  const CrumpledState s(uniform, 7);
  const Eigen::Matrix3d turn = uniform.rotation();
  const Eigen::Vector3d shift(0.4, -0.2, 1.0), drift(1, 2, -3);

  const Eigen::Matrix3Xd force_n =
      spring_forces_n(s.net, s.springs, s.position_m, s.velocity_m_per_s);
  const Eigen::Matrix3Xd turned_n =
      spring_forces_n(s.net, s.springs, (turn * s.position_m).colwise() + shift,
                      (turn * s.velocity_m_per_s).colwise() + drift);

  EXPECT_LT((turned_n - turn * force_n).cwiseAbs().maxCoeff(),
            1e-12 * force_n.cwiseAbs().maxCoeff());
}

TEST(SpringForce, DampingNeverAddsEnergy) {
  for (const unsigned seed : {7u, 8u, 9u, 10u}) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    const CrumpledState s(uniform, 9);

    const Eigen::Matrix3Xd force_n =
        spring_forces_n(s.net, without_stiffness(s.springs), s.position_m, s.velocity_m_per_s);

    EXPECT_LT(force_n.cwiseProduct(s.velocity_m_per_s).sum(), -1e-3);  // W; and it does act
  }
}

TEST(SpringForce, DampingDoesNothingToClothThatTurnsRigidly) {
  Uniform uniform(11);
  const CrumpledState s(uniform, 9);
  const Eigen::Vector3d spin_per_s(3, -5, 2), drift_m_per_s(1, 0.5, -2);
  Eigen::Matrix3Xd velocity(3, s.position_m.cols());
  for (Eigen::Index k = 0; k < velocity.cols(); ++k)
    velocity.col(k) = drift_m_per_s + spin_per_s.cross(s.position_m.col(k).head<3>());

  const Eigen::Matrix3Xd force_n =
      spring_forces_n(s.net, without_stiffness(s.springs), s.position_m, velocity);

  // Rounding of differences of velocities of a few m/s, times at most 1 Ns/m.
  EXPECT_LT(force_n.cwiseAbs().maxCoeff(), 1e-13);
}

TEST(SpringForce, LeavesOutASpringOfZeroLength) {
  // Given two vertices in the same place that fly apart,
  Uniform uniform(12);
  CrumpledState s(uniform, 5);
  const int a = s.mesh.vertex(2, 2), b = s.mesh.vertex(2, 3);
  s.position_m.col(b) = s.position_m.col(a);
  SpringNet without = s.net;
  std::erase_if(without[structural_s], [&](const Spring& n) { return n.a == a && n.b == b; });
  ASSERT_EQ(without[structural_s].size() + 1, s.net[structural_s].size());

  // when forces are added with that spring and without,
  const Eigen::Matrix3Xd with_n =
      spring_forces_n(s.net, s.springs, s.position_m, s.velocity_m_per_s);
  const Eigen::Matrix3Xd without_n =
      spring_forces_n(without, s.springs, s.position_m, s.velocity_m_per_s);

  // then they are the same and finite.
  EXPECT_TRUE(with_n.allFinite());
  EXPECT_EQ(with_n, without_n);
}

TEST(SpringForce, StaysFiniteDownToTheSmallestLengths) {
  const SpringParameters springs = one_spring_parameters(0.10, 50, 0.3);
  for (const double length_m : {1e-20, 1e-150, 1e-161, 1e-200, 5e-324}) {
    SCOPED_TRACE(length_m);
    Eigen::Matrix3Xd position_m = Eigen::Matrix3Xd::Zero(3, 2);
    position_m(1, 1) = length_m;

    const Eigen::Matrix3Xd force_n =
        spring_forces_n(one_spring(), springs, position_m, at_rest(position_m));

    EXPECT_TRUE(force_n.allFinite());
    EXPECT_LE(force_n.cwiseAbs().maxCoeff(), 50 * 0.10 * 1.1);
  }
}

TEST(SpringForce, LanesKnowNothingOfEachOther) {
  Uniform uniform(13);
  const Mesh mesh = square_mesh(7);
  const SpringNet net = make_springs(mesh);
  LaneSprings springs;
  LaneVectors position = LaneVectors::zero(mesh.vertex_count());
  LaneVectors velocity = position, force = position;
  std::vector<CrumpledState> states;
  for (int l = 0; l < kLanes; ++l) {
    states.emplace_back(uniform, 7);
    set_lane(l, states.back().springs, springs);
    position.set_lane(l, states.back().position_m);
    velocity.set_lane(l, states.back().velocity_m_per_s);
  }
  position.x(3, 5) = NAN;  // one lane is lost

  add_spring_forces(net, springs, position, velocity, force);

  for (int l = 0; l < kLanes; ++l) {
    SCOPED_TRACE(l);
    const CrumpledState& s = states[static_cast<size_t>(l)];
    if (l == 3) {
      EXPECT_FALSE(force.lane(l).allFinite());
    } else {
      EXPECT_EQ(force.lane(l), spring_forces_n(net, s.springs, s.position_m, s.velocity_m_per_s));
    }
  }
}

/// The kernels as the model chooses them on this machine, and each of the instruction sets that
/// they are compiled for, if this machine has it.
class SpringForceVariant : public testing::TestWithParam<KernelVariant> {
 protected:
  void SetUp() override {
    if (!GetParam().runs_here()) GTEST_SKIP() << "this processor lacks " << GetParam().name;
  }
};

TEST_P(SpringForceVariant, AgreesWithTheScalarReferenceToTheLastBit) {
  const unsigned seed = 14;
  SCOPED_TRACE(seed);
  Uniform uniform(seed);
  const Mesh mesh = square_mesh(9);
  const SpringNet net = make_springs(mesh);
  const Eigen::VectorXd mass_kg = masses_by_area(mesh, 0.025);
  const double h = 1e-4;

  // Given other springs and another crumpled start in every lane,
  LaneSprings springs;
  LaneVectors position = LaneVectors::zero(mesh.vertex_count());
  LaneVectors velocity = position;
  std::vector<CrumpledState> states;
  for (int l = 0; l < kLanes; ++l) {
    states.emplace_back(uniform, 9);
    set_lane(l, states.back().springs, springs);
    position.set_lane(l, states.back().position_m);
    velocity.set_lane(l, states.back().velocity_m_per_s);
  }
  // one of them with two vertices in the same place,
  const auto a = mesh.vertex(3, 3), b = mesh.vertex(3, 4);
  states[2].position_m.col(a) = states[2].position_m.col(b);
  position.set_lane(2, states[2].position_m);

  // when they move for many steps,
  for (int n = 0; n < 200; ++n) {
    LaneVectors force = LaneVectors::zero(mesh.vertex_count());
    GetParam().add_forces(net, springs, position, velocity, force);
    GetParam().integrate(mass_kg, h, force, velocity, position);
  }

  // then every lane is where plain arithmetic has it, bit for bit.
  for (int l = 0; l < kLanes; ++l) {
    SCOPED_TRACE(l);
    CrumpledState& s = states[static_cast<size_t>(l)];
    const Eigen::Matrix3Xd start_m = s.position_m;
    for (int n = 0; n < 200; ++n) {
      Eigen::Matrix3Xd force_n = at_rest(start_m);
      add_reference_spring_forces(net, s.springs, s.position_m, s.velocity_m_per_s, force_n);
      reference_euler(mass_kg, h, force_n, s.velocity_m_per_s, s.position_m);
    }
    EXPECT_EQ(position.lane(l), s.position_m);
    EXPECT_EQ(velocity.lane(l), s.velocity_m_per_s);
    EXPECT_GT((s.position_m - start_m).cwiseAbs().maxCoeff(), 0.01);
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, SpringForceVariant, testing::ValuesIn(kernel_variants()),
                         [](const auto& variant) { return variant.param.name; });

TEST(IntegrateEuler, MovesPositionsWithTheNewVelocities) {
  Eigen::VectorXd mass_kg(2);
  mass_kg << 0.5, 2;
  const Eigen::Matrix3Xd ones = Eigen::Matrix3Xd::Ones(3, 2);
  LaneVectors velocity = every_lane(3 * ones), position = every_lane(10 * ones);

  integrate_euler(mass_kg, 0.25, every_lane(4 * ones), velocity, position);

  EXPECT_EQ(velocity.lane(0).col(0), Eigen::Vector3d::Constant(3 + 0.25 * 4 / 0.5));
  EXPECT_EQ(velocity.lane(0).col(1), Eigen::Vector3d::Constant(3 + 0.25 * 4 / 2));
  EXPECT_EQ(position.lane(0).col(0), Eigen::Vector3d::Constant(10 + 0.25 * 5));
  EXPECT_EQ(position.lane(0).col(1), Eigen::Vector3d::Constant(10 + 0.25 * 3.5));
}

}  // namespace
}  // namespace clothfit
