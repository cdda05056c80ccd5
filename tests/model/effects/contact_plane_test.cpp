// Checks contact with a plane, and the law of contact that all obstacles share (contact_law.h).

#include <gtest/gtest.h>

#include <cmath>

#include "model/cloth/stability.h"
#include "model/effects/contact_law.h"
#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

constexpr double kWeight_pa = 0.025 * 9.81 / 0.16;  // square_cloth's, per area
constexpr double kStiffness_pa_per_m = 3000;

/// A plane through the origin that leans by `angle_rad` about y, and a flat cloth parallel to it.
struct OnSlope {
  Eigen::Matrix3d lean;
  ClothWithEffect cloth;

  OnSlope(double angle_rad, double damping, double friction, double depth_m)
      : lean(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitY()).toRotationMatrix()),
        cloth(square_cloth(5), "contact_plane",
              {kStiffness_pa_per_m, damping, friction, lean(0, 2), lean(1, 2), lean(2, 2), 0},
              (lean * flat_positions(square_mesh(5))).colwise() - depth_m * lean.col(2)) {}
};

TEST(ContactPlane, KeepsTheContractOfEffects) {
  expect_effect_contract("contact_plane", {});
}

TEST(ContactPlane, ADroppedSheetComesToRestAsDeepAsItIsHeavy) {
  const OnSlope sheet(0, 20, 0.3, -0.02);

  const auto state = sheet.cloth.after(6000, 5e-4);

  // Swings die out as e^(-c t / (2 sigma)), 64 per second.
  EXPECT_LT((state.position_m.row(2).array() + kWeight_pa / kStiffness_pa_per_m).abs().maxCoeff(),
            1e-12);
  EXPECT_LT(state.velocity_m_per_s.cwiseAbs().maxCoeff(), 1e-12);
}

TEST(ContactPlane, WithoutDampingASheetBouncesBackToItsHeight) {
  const OnSlope sheet(0, 0, 0, -0.02);
  const double h = 2e-5;
  double highest = 0, lowest = 0;

  sheet.cloth.after(9000, h, [&](int step, const ClothWithEffect::State& state) {
    const double z = state.position_m(2, 12);
    lowest = std::min(lowest, z);
    if (step * h > 0.1) highest = std::max(highest, z);
  });

  EXPECT_LT(lowest, -1e-3);
  EXPECT_NEAR(highest, 0.02, 2e-4);  // the scheme is of first order in h
}

TEST(ContactPlane, ASheetSlidesDownWithWhatFrictionLeaves) {
  const double angle = 0.6, friction = 0.25;
  const double depth = kWeight_pa * std::cos(angle) / kStiffness_pa_per_m;
  const OnSlope sheet(angle, 5, friction, depth);
  const double h = 5e-4;

  const auto early = sheet.cloth.after(600, h), late = sheet.cloth.after(1200, h);

  const Eigen::Vector3d downhill = sheet.lean * Eigen::Vector3d::UnitX();
  const Eigen::Vector3d expected = 9.81 * (std::sin(angle) - friction * std::cos(angle)) * downhill;
  // Friction is smoothed below 1 mm/s; at 1 m/s a millionth of it is missing.
  EXPECT_LT((((late.velocity_m_per_s - early.velocity_m_per_s) / (600 * h)).colwise() - expected)
                .cwiseAbs()
                .maxCoeff(),
            1e-5);
}

TEST(ContactPlane, BelowTheAngleOfFrictionASheetOnlyCreeps) {
  const double angle = 0.4, friction = 0.7;
  const double depth = kWeight_pa * std::cos(angle) / kStiffness_pa_per_m;
  const OnSlope sheet(angle, 5, friction, depth);

  const auto state = sheet.cloth.after(2000, 5e-4);

  const double share = std::tan(angle) / friction;
  const double creep_m_per_s =
      9.81 * std::sin(angle) / Contact::kFrictionRate_per_s / std::sqrt(1 - share * share);
  EXPECT_LT(creep_m_per_s, 3e-3);
  EXPECT_LT((state.velocity_m_per_s.colwise() -
             Eigen::Vector3d(sheet.lean * Eigen::Vector3d::UnitX() * creep_m_per_s))
                .cwiseAbs()
                .maxCoeff(),
            1e-9);
}

TEST(ContactPlane, PushesAndNeverPulls) {
  const OnSlope sheet(0, 50, 0.5, 1e-3);
  const Eigen::Matrix3Xd& inside = sheet.cloth.set.start_position_m;
  const Eigen::Matrix3Xd leaving = Eigen::Vector3d(1, 0, 1).replicate(1, 25);

  EXPECT_EQ(sheet.cloth.force_n(inside, leaving).norm(), 0);
  EXPECT_GT(sheet.cloth.force_n(inside, -leaving).row(2).minCoeff(), 0);
  EXPECT_EQ(sheet.cloth.force_n(-inside, -leaving).norm(), 0);  // not inside
}

TEST(ContactPlane, AtNeutralItsDerivativeByTheStiffnessIsThatOfAPush) {
  const OnSlope sheet(0, 0, 0, 2e-3);
  const EffectMap map(*sheet.cloth.cloth.effects.front(), sheet.cloth.cloth, 7,
                      EffectDeed::add_force);
  const int own = map.first_parameter() + ParameterNumber::own(0);
  Eigen::VectorXd neutral = Eigen::VectorXd::Zero(map.inputs());
  neutral.head<75>() = sheet.cloth.set.start_position_m.reshaped();
  neutral[own + 5] = 1;  // n_z
  Eigen::VectorXd hard = neutral;
  hard[own] = 1;

  EXPECT_EQ(map(neutral).norm(), 0);
  EXPECT_GT(map(hard).norm(), 0);
  EXPECT_LT((map.stated_jacobian(neutral).col(own) - map(hard)).norm(), 1e-17);
}

TEST(ContactPlane, IsAForcePerArea) {
  for (const int vertices : {2, 5, 9}) {
    const Cloth bare = square_cloth(vertices);
    const Eigen::Matrix3Xd p = flat_positions(bare.mesh).colwise() - Eigen::Vector3d(0, 0, 2e-3);
    const ClothWithEffect sheet(bare, "contact_plane", {1000, 0, 0, 0, 0, 1, 0}, p);

    EXPECT_NEAR(sheet.force_n(p, at_rest(p)).row(2).sum(), 1000 * 2e-3 * 0.16, 1e-15) << vertices;
  }
}

TEST(ContactPlane, TurnsWithTheSceneWhenThePlaneTurnsToo) {
  Uniform uniform(8);
  const Eigen::Matrix3d turn = uniform.rotation();
  const Cloth bare = square_cloth(6);
  const Eigen::Matrix3Xd p = crumpled(bare.mesh, 0.4, uniform), v = uniform.vectors(36, 1);
  const Eigen::Vector3d n = Eigen::Vector3d(0.1, 0.2, 1), m = turn * n;

  const Eigen::Matrix3Xd force =
      ClothWithEffect(bare, "contact_plane", {2000, 5, 0.4, n.x(), n.y(), n.z(), 0.05}, p)
          .force_n(p, v);

  EXPECT_GT(force.norm(), 0);
  EXPECT_LT((ClothWithEffect(bare, "contact_plane", {2000, 5, 0.4, m.x(), m.y(), m.z(), 0.05}, p)
                 .force_n(turn * p, turn * v) -
             turn * force)
                .norm(),
            1e-12 * force.norm());
}

TEST(ContactPlane, TheHardestGroundIsStableAtTheStableStep) {
  Uniform uniform(9);
  const Cloth bare = square_cloth(7);
  for (const double damping : {0.0, 100.0}) {
    for (const double friction : {0.0, 2.0}) {
      SCOPED_TRACE(testing::Message() << damping << ", " << friction);
      ClothWithEffect sheet(bare, "contact_plane", {1e5, damping, friction, 0.2, 0, 1, -0.05},
                            crumpled(bare.mesh, 0.2, uniform));

      const auto state = sheet.after(4000, 0.9 * stable_time_step_s(sheet.cloth, sheet.set));

      EXPECT_LT(state.velocity_m_per_s.colwise().norm().maxCoeff(), 30);
    }
  }
}

}  // namespace
}  // namespace clothfit
