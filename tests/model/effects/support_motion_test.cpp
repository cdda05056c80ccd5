// Checks supports that move to and fro.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

const Eigen::Vector3d kAmplitude_m(0.03, -0.02, 0.01);
constexpr double kFrequency_hz = 1.9, kPhase_turns = 0.12;

std::vector<double> parameters(double point = 0) {
  return {kAmplitude_m.x(), kAmplitude_m.y(), kAmplitude_m.z(), kFrequency_hz, kPhase_turns, point};
}
double harmonic(double time_s) {
  return std::sin(2 * std::numbers::pi * (kFrequency_hz * time_s + kPhase_turns));
}
Eigen::Vector3d shift_m(double time_s) {
  return (harmonic(time_s) - harmonic(0)) * kAmplitude_m;
}

TEST(SupportMotion, KeepsTheContractOfEffects) {
  expect_effect_contract("support_motion", {});
}

TEST(SupportMotion, AddsToWhereHeldPointsAreWhetherTheyRestOrMove) {
  const Eigen::Vector3d velocity(0.1, 0.2, -0.1);
  Cloth bare = square_cloth(5);
  const Eigen::Matrix3Xd start = flat_positions(bare.mesh);
  const Eigen::Vector3d corner = start.col(4);
  bare.held = {held_at(bare.mesh, 0, 0), held_at(bare.mesh, 0.4, 0)};
  bare.held[1].motion = [&](double time_s) -> Eigen::Vector3d {
    return corner + time_s * velocity;
  };
  const double h = 1e-3;

  ClothWithEffect(bare, "support_motion", parameters(), start)
      .after(300, h, [&](int step, const ClothWithEffect::State& state) {
        const double t = step * h;
        EXPECT_LT((state.position_m.col(0) - start.col(0) - shift_m(t)).norm(), 1e-14) << step;
        EXPECT_LT((state.position_m.col(4) - corner - t * velocity - shift_m(t)).norm(), 1e-14)
            << step;
      });
}

TEST(SupportMotion, IsAShakenFrameSeenFromOutside) {
  // The scheme's acceleration of A sin(2 pi f t) is its second difference, -(2 - 2 cos(2 pi f h)) /
  // h^2 A sin(2 pi f t). The cloth moves as in a frame with that.
  Uniform uniform(5);
  Cloth bare = square_cloth(6);
  bare.held = {held_at(bare.mesh, 0, 0), held_at(bare.mesh, 0.31, 0.02)};
  const Eigen::Matrix3Xd start = crumpled(bare.mesh, 0.2, uniform);
  const int steps = 1500;
  const double h = 2e-4;
  const double factor = -(2 - 2 * std::cos(2 * std::numbers::pi * kFrequency_hz * h)) / (h * h);
  const Eigen::Vector3d a = factor * kAmplitude_m;

  const ClothWithEffect moved(bare, "support_motion", parameters(), start);
  ClothWithEffect shaken(bare, "frame_acceleration",
                         {a.x(), a.y(), a.z(), kFrequency_hz, kPhase_turns}, start);
  shaken.set.start_velocity_m_per_s = (shift_m(-h) / h).replicate(1, 36);

  const Eigen::Matrix3Xd world = moved.after(steps, h).position_m;
  const Eigen::Matrix3Xd frame = shaken.after(steps, h).position_m;
  EXPECT_GT((world - frame).cwiseAbs().maxCoeff(), 0.01);
  // The factor loses ten digits to cancellation, h^2 f^2 of the amplitude.
  EXPECT_LT((world.colwise() - shift_m(steps * h) - frame).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(SupportMotion, OfASinglePointLeavesTheOtherWhereItIs) {
  Cloth bare = square_cloth(5);
  const Eigen::Matrix3Xd start = flat_positions(bare.mesh);
  bare.held = {held_at(bare.mesh, 0, 0), held_at(bare.mesh, 0.4, 0)};
  const double h = 1e-3;

  ClothWithEffect(bare, "support_motion", parameters(2), start)
      .after(300, h, [&](int step, const ClothWithEffect::State& state) {
        EXPECT_EQ(state.position_m.col(0), start.col(0)) << step;
        EXPECT_LT((state.position_m.col(4) - start.col(4) - shift_m(step * h)).norm(), 1e-14)
            << step;
      });
}

}  // namespace
}  // namespace clothfit
