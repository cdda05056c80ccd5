// Checks a frame that shakes.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

const Eigen::Vector3d kAmplitude_m_per_s2(1.5, -0.7, 0.9);
constexpr double kShaking_hz = 2.3, kPhase_turns = 0.15;

Eigen::Vector3d acceleration_m_per_s2(double time_s) {
  return std::sin(2 * std::numbers::pi * (kShaking_hz * time_s + kPhase_turns)) *
         kAmplitude_m_per_s2;
}

std::vector<double> parameters() {
  return {kAmplitude_m_per_s2.x(), kAmplitude_m_per_s2.y(), kAmplitude_m_per_s2.z(), kShaking_hz,
          kPhase_turns};
}

/// Returns the frame's place after each step of the scheme, V += h a, P += h V, from rest.
std::vector<Eigen::Vector3d> frame_places_m(int steps, double h) {
  std::vector<Eigen::Vector3d> places = {Eigen::Vector3d::Zero()};
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  for (int n = 0; n < steps; ++n) {
    velocity += h * acceleration_m_per_s2(n * h);
    places.push_back(places.back() + h * velocity);
  }
  return places;
}

TEST(FrameAcceleration, KeepsTheContractOfEffects) {
  expect_effect_contract("frame_acceleration", {});
}

TEST(FrameAcceleration, FreeClothStaysBehindAsTheFrameMovesOn) {
  const Cloth bare = square_cloth(5);
  const int steps = 400;
  const double h = 1e-3;
  const auto frame = frame_places_m(steps, h);
  ClothWithEffect cloth(bare, "frame_acceleration", parameters(), flat_positions(bare.mesh));
  cloth.set.gravity_m_per_s2.setZero();

  cloth.after(steps, h, [&](int step, const ClothWithEffect::State& state) {
    const Eigen::Matrix3Xd shift = state.position_m - cloth.set.start_position_m;
    EXPECT_LT((shift.colwise() + frame[static_cast<size_t>(step)]).cwiseAbs().maxCoeff(), 1e-12)
        << step;
  });
}

TEST(FrameAcceleration, IsWhatMovingSupportsLookLikeFromTheMovingFrame) {
  // Given a cloth whose supports are moved, and one whose supports rest in a shaken frame,
  Cloth resting = square_cloth(6);
  resting.held = {held_at(resting.mesh, 0, 0), held_at(resting.mesh, 0.31, 0.02)};
  Uniform uniform(4);
  const Eigen::Matrix3Xd start = crumpled(resting.mesh, 0.2, uniform);
  const int steps = 2000;
  const double h = 2e-4;
  const auto frame = frame_places_m(steps, h);
  Cloth moved = resting;
  for (HeldVertexWeights& held : moved.held) {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    for (const auto& [vertex, weight] : held.weights) place += weight * start.col(vertex);
    held.motion = [&frame, place, h](double time_s) -> Eigen::Vector3d {
      return place + frame[static_cast<size_t>(std::lround(time_s / h))];
    };
  }

  // when both run,
  const ClothWithEffect shaken(resting, "frame_acceleration", parameters(), start);
  const ClothWithEffect carried(moved, "frame_acceleration", {0, 0, 0, 1, 0}, start);

  // then the second is the first, seen from the frame.
  const Eigen::Matrix3Xd seen = shaken.after(steps, h).position_m;
  const Eigen::Matrix3Xd world = carried.after(steps, h).position_m;
  EXPECT_GT((world - seen).cwiseAbs().maxCoeff(), 0.02);
  // Crumpled cloth makes the rounding of 2000 steps ten thousand times larger at most.
  EXPECT_LT((world.colwise() - frame.back() - seen).cwiseAbs().maxCoeff(), 1e-9);
}

}  // namespace
}  // namespace clothfit
