// Checks the kernel of a time step: the springs' pull and the Euler update, on every instruction
// set. Not checked here: the whole step with effects and held points (step_test.cpp), and how long
// a step may be (stability_test.cpp).

#include "model/kernels/cloth_sweep.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/model/instruction_sets.h"
#include "tests/model/mechanics.h"
#include "tests/model/random_cloth.h"
#include "tests/model/scalar_reference.h"

namespace clothfit {
namespace {

/// Two springs of type structural_t, 1 m apart: between vertices 0 and 2, and between 1 and 3.
constexpr Mesh kPair{.columns = 2, .rows = 2, .width_m = 1, .height_m = 0.1};

/// Puts vertex 0 at `from`, vertex 2 at `to`; the other pair the same.
Eigen::Matrix3Xd pair_of(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d aside(1, 0, 0);
  Eigen::Matrix3Xd position_m(3, 4);
  position_m << from, from + aside, to, to + aside;
  return position_m;
}

SpringParameters one_spring_parameters(double length_m, double stiffness, double damping) {
  SpringParameters springs;
  springs.natural_length_m[structural_t] = length_m;
  springs.stiffness_n_per_m[structural_t] = stiffness;
  springs.damping_ns_per_m[structural_t] = damping;
  return springs;
}

/// Returns springs as a search may try them: not at rest in the flat cloth.
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
      : CrumpledState(uniform, square_mesh(vertices_per_side)) {}
  CrumpledState(Uniform& uniform, const Mesh& of)
      : mesh(of),
        net(make_springs(mesh)),
        springs(random_springs(mesh, uniform)),
        position_m(crumpled(mesh, 0.6, uniform)),
        velocity_m_per_s(uniform.vectors(mesh.vertex_count(), 2.0)) {}
};

TEST(SpringForce, PullsTheEndsOfAStretchedSpringTogether) {
  const SpringParameters springs = one_spring_parameters(0.10, 50, 0);
  const Eigen::Matrix3Xd position_m = pair_of({0, 0, 0}, {0, 0.11, 0});

  const Eigen::Matrix3Xd force_n = spring_forces_n(kPair, springs, position_m, at_rest(position_m));

  for (const Eigen::Index upper : {0, 1}) {
    EXPECT_NEAR(force_n(1, upper), 50 * 0.01, 1e-14);  // k (l - l0)
    EXPECT_EQ(force_n.col(upper + 2), -force_n.col(upper));
    EXPECT_EQ(force_n(0, upper), 0);
    EXPECT_EQ(force_n(2, upper), 0);
  }
}

TEST(SpringForce, PushesTheEndsOfACompressedSpringApart) {
  const SpringParameters springs = one_spring_parameters(0.10, 50, 0);
  const Eigen::Matrix3Xd position_m = pair_of({0.3, 0.1, -0.5}, {0.3, 0.1, -0.42});

  const Eigen::Matrix3Xd force_n = spring_forces_n(kPair, springs, position_m, at_rest(position_m));

  EXPECT_NEAR(force_n(2, 2), 50 * 0.02, 1e-14);
}

TEST(SpringForce, DashpotResistsTheRateOfStretchingOnly) {
  const SpringParameters springs = one_spring_parameters(0.10, 50, 0.3);
  const Eigen::Vector3d along(0.6, 0.8, 0), across(0.8, -0.6, 0), drift(7, -3, 2);
  const Eigen::Matrix3Xd position_m = pair_of({0, 0, 0}, 0.1 * along);  // at its natural length
  Eigen::Matrix3Xd velocity(3, 4);
  velocity << drift, drift, drift + 2.0 * along + 5.0 * across, drift;

  const Eigen::Matrix3Xd force_n = spring_forces_n(kPair, springs, position_m, velocity);

  // The force is c dl/dt along the spring, to the rounding of velocities of size 10.
  EXPECT_LT((force_n.col(0) - 0.3 * 2.0 * along).norm(), 1e-14);
  EXPECT_LT(force_n.col(1).norm(), 1e-14);
}

TEST(SpringForce, AddsToWhatIsThere) {
  const SpringParameters springs = one_spring_parameters(0.10, 50, 0);
  const Eigen::Matrix3Xd position_m = pair_of({0, 0, 0}, {0, 0.11, 0});
  LaneVectors<> force_n = every_lane(Eigen::Matrix3Xd::Constant(3, 4, 4.0));

  ClothSweep<>(kPair).add_spring_forces(every_lane(springs), every_lane(position_m),
                                        every_lane(at_rest(position_m)), force_n);

  EXPECT_NEAR(force_n.lane(0)(1, 0), 4.5, 1e-14);
  EXPECT_EQ(force_n.lane(0)(0, 0), 4.0);
}

TEST(SpringForce, SumsToZeroAndExertsNoTorque) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    const CrumpledState s(uniform, 9);

    const Eigen::Matrix3Xd force_n =
        spring_forces_n(s.mesh, s.springs, s.position_m, s.velocity_m_per_s);

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
        spring_forces_n(s.mesh, s.springs, s.position_m, at_rest(s.position_m));

    const double step_m = 1e-6;
    for (Eigen::Index n = 0; n < force_n.size(); ++n) {
      Eigen::Matrix3Xd ahead = s.position_m, behind = s.position_m;
      ahead.reshaped()[n] += step_m;
      behind.reshaped()[n] -= step_m;
      const double gradient_n =
          (elastic_energy_j(s.net, s.springs, ahead) - elastic_energy_j(s.net, s.springs, behind)) /
          (2 * step_m);
      // The rounding of an energy below 10 J over the step is 1e-9. The difference's own error k
      // h^2 / l^2 l is below 1e-7 for springs of 1 cm.
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
      spring_forces_n(s.mesh, s.springs, s.position_m, s.velocity_m_per_s);
  const Eigen::Matrix3Xd turned_n =
      spring_forces_n(s.mesh, s.springs, (turn * s.position_m).colwise() + shift,
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
        spring_forces_n(s.mesh, without_stiffness(s.springs), s.position_m, s.velocity_m_per_s);

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
      spring_forces_n(s.mesh, without_stiffness(s.springs), s.position_m, velocity);

  // Differences of velocities of a few m/s are rounded, times at most 1 Ns/m.
  EXPECT_LT(force_n.cwiseAbs().maxCoeff(), 1e-13);
}

TEST(SpringForce, LeavesOutASpringOfZeroLength) {
  // Given two vertices in the same place that fly apart, joined by a spring of type structural_s,
  Uniform uniform(12);
  CrumpledState s(uniform, 5);
  const int a = s.mesh.vertex(2, 2), b = s.mesh.vertex(2, 3);
  s.position_m.col(b) = s.position_m.col(a);
  SpringParameters only_structural_s;
  only_structural_s.natural_length_m[structural_s] = 0.1;
  only_structural_s.stiffness_n_per_m[structural_s] = 50;
  only_structural_s.damping_ns_per_m[structural_s] = 0.3;

  const Eigen::Matrix3Xd force_n =
      spring_forces_n(s.mesh, only_structural_s, s.position_m, s.velocity_m_per_s);

  // then each feels its other spring alone, whose other end feels two.
  const auto pull = [&](int from, int to) -> Eigen::Vector3d {
    const Eigen::Vector3d along = s.position_m.col(to) - s.position_m.col(from);
    const Eigen::Vector3d rate = s.velocity_m_per_s.col(to) - s.velocity_m_per_s.col(from);
    const double l = along.norm();
    return (50 * (l - 0.1) + 0.3 * along.dot(rate) / l) / l * along;
  };
  EXPECT_TRUE(force_n.allFinite());
  EXPECT_LT((force_n.col(a) - pull(a, a - 1)).norm(), 1e-13);
  EXPECT_LT((force_n.col(b) - pull(b, b + 1)).norm(), 1e-13);
}

TEST(SpringForce, HasTheInverseLengthToRounding) {
  // A spring's force over 40 decades of length is compared with the library's square root.
  Uniform uniform(15);
  for (int n = 0; n < 2000; ++n) {
    const double length_m = std::pow(10, uniform(-20, 20));
    const SpringParameters springs = one_spring_parameters(0, 1, 0);
    const Eigen::Vector3d to = length_m * uniform.rotation().col(0);
    const Eigen::Matrix3Xd position_m = pair_of({0, 0, 0}, to);

    const Eigen::Matrix3Xd force_n =
        spring_forces_n(kPair, springs, position_m, at_rest(position_m));

    // f = l u is the vector itself; the inverse square root enters twice with 3e-16 each.
    EXPECT_LT((force_n.col(0) - to).norm(), 1e-15 * length_m) << length_m;
  }
}

TEST(SpringForce, StaysFiniteDownToTheSmallestLengths) {
  const SpringParameters springs = one_spring_parameters(0.10, 50, 0.3);
  for (const double length_m : {1e-20, 1e-150, 1e-161, 1e-200, 5e-324}) {
    SCOPED_TRACE(length_m);
    const Eigen::Matrix3Xd position_m = pair_of({0, 0, 0}, {0, length_m, 0});

    const Eigen::Matrix3Xd force_n =
        spring_forces_n(kPair, springs, position_m, at_rest(position_m));

    EXPECT_TRUE(force_n.allFinite());
    EXPECT_LE(force_n.cwiseAbs().maxCoeff(), 50 * 0.10 * 1.1);
  }
}

TEST(SpringForce, LanesKnowNothingOfEachOther) {
  Uniform uniform(13);
  const Mesh mesh = square_mesh(7);
  LaneSprings<> springs;
  LaneVectors<> position = LaneVectors<>::zero(mesh.vertex_count());
  LaneVectors<> velocity = position, force = position;
  std::vector<CrumpledState> states;
  for (int l = 0; l < kLanes; ++l) {
    states.emplace_back(uniform, 7);
    set_lane(l, states.back().springs, springs);
    position.set_lane(l, states.back().position_m);
    velocity.set_lane(l, states.back().velocity_m_per_s);
  }
  position.x(3, 5) = NAN;  // one lane is lost

  ClothSweep<>(mesh).add_spring_forces(springs, position, velocity, force);

  for (int l = 0; l < kLanes; ++l) {
    SCOPED_TRACE(l);
    const CrumpledState& s = states[static_cast<size_t>(l)];
    if (l == 3) {
      EXPECT_FALSE(force.lane(l).allFinite());
    } else
      EXPECT_EQ(force.lane(l), spring_forces_n(mesh, s.springs, s.position_m, s.velocity_m_per_s));
  }
}

class ClothSweepOn : public testing::TestWithParam<InstructionSet> {};

TEST_P(ClothSweepOn, AgreesWithTheScalarReferenceToTheLastBit) {
  const unsigned seed = 14;
  SCOPED_TRACE(seed);
  const OnInstructionSet on(GetParam());
  Uniform uniform(seed);
  for (const Mesh& mesh :
       {square_mesh(9), Mesh{.columns = 2, .rows = 3, .width_m = 0.1, .height_m = 0.2},
        Mesh{.columns = 6, .rows = 2, .width_m = 0.3, .height_m = 0.05}}) {
    SCOPED_TRACE(mesh.columns);
    const Eigen::VectorXd mass_kg = masses_by_area(mesh, 0.025);
    const double h = 1e-4;

    // Given other springs, another gravity and another crumpled start in every lane,
    LaneSprings<> springs;
    LaneVector<> gravity;
    LaneVectors<> position = LaneVectors<>::zero(mesh.vertex_count());
    LaneVectors<> velocity = position;
    std::vector<CrumpledState> states;
    std::vector<Eigen::Vector3d> pulls;
    for (int l = 0; l < kLanes; ++l) {
      states.emplace_back(uniform, mesh);
      pulls.push_back(uniform.vectors(1, 10).col(0));
      set_lane(l, states.back().springs, springs);
      gravity.x[l] = pulls.back().x();
      gravity.y[l] = pulls.back().y();
      gravity.z[l] = pulls.back().z();
    }
    // one of them with two vertices in the same place,
    const int a = mesh.vertex(1, 0), b = mesh.vertex(1, 1);
    states[2].position_m.col(a) = states[2].position_m.col(b);
    for (int l = 0; l < kLanes; ++l) {
      position.set_lane(l, states[static_cast<size_t>(l)].position_m);
      velocity.set_lane(l, states[static_cast<size_t>(l)].velocity_m_per_s);
    }

    // when they move for many steps,
    ClothSweep<> sweep(mesh);
    for (int n = 0; n < 200; ++n)
      sweep.step_euler(springs, gravity, mass_kg.cwiseInverse(), nullptr, h, position, velocity);

    // then every lane agrees with plain arithmetic, bit for bit.
    for (int l = 0; l < kLanes; ++l) {
      SCOPED_TRACE(l);
      CrumpledState& s = states[static_cast<size_t>(l)];
      const Eigen::Matrix3Xd start_m = s.position_m;
      for (int n = 0; n < 200; ++n) {
        const Eigen::Matrix3Xd force_n =
            reference_spring_forces(mesh, s.springs, s.position_m, s.velocity_m_per_s);
        reference_euler(mass_kg, pulls[static_cast<size_t>(l)], h, force_n, s.velocity_m_per_s,
                        s.position_m);
      }
      EXPECT_EQ(position.lane(l), s.position_m);
      EXPECT_EQ(velocity.lane(l), s.velocity_m_per_s);
      EXPECT_GT((s.position_m - start_m).cwiseAbs().maxCoeff(), 0.01);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, ClothSweepOn, testing::ValuesIn(instruction_sets()),
                         [](const auto& set) { return set.param.name(); });

TEST(ClothSweep, MovesPositionsWithTheNewVelocities) {
  Eigen::VectorXd mass_kg(4);
  mass_kg << 0.5, 2, 1, 1;
  const Eigen::Matrix3Xd ones = Eigen::Matrix3Xd::Ones(3, 4);
  LaneVectors<> velocity = every_lane(3 * ones), position = every_lane(10 * ones);
  const LaneVectors<> force = every_lane(4 * ones);
  const LaneVector<> gravity{LaneValue<>::Zero(), LaneValue<>::Zero(), LaneValue<>::Constant(-8)};

  ClothSweep<>(kPair).step_euler(every_lane(SpringParameters{}), gravity, mass_kg.cwiseInverse(),
                                 &force, 0.25, position, velocity);

  EXPECT_EQ(velocity.lane(0).col(0), Eigen::Vector3d(5, 5, 3));  // 3 + (4 / 0.5 - 8 e_z) / 4
  EXPECT_EQ(velocity.lane(0).col(1), Eigen::Vector3d(3.5, 3.5, 1.5));
  EXPECT_EQ(position.lane(0).col(0), Eigen::Vector3d(11.25, 11.25, 10.75));
  EXPECT_EQ(position.lane(0).col(1), Eigen::Vector3d(10.875, 10.875, 10.375));
}

}  // namespace
}  // namespace clothfit
