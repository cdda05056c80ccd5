// Checks wind with one harmonic. Not checked here: drag, which wind has.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

double harmonic(double frequency_hz, double phase_turns, double time_s) {
  return std::sin(2 * std::numbers::pi * (frequency_hz * time_s + phase_turns));
}

TEST(Gust, KeepsTheContractOfEffects) {
  expect_effect_contract("gust", {.proportional = false});
}

TEST(Gust, PushesAFlatSheetToAndFroAlongItsNormal) {
  const Eigen::Vector3d q(0.3, -0.2, 0.5);
  const double f = 1.7, phase = 0.1, h = 1e-3;
  Uniform uniform(1);
  const Eigen::Matrix3d attitude = uniform.rotation();
  const Eigen::Vector3d n = attitude.col(2);
  const Cloth bare = square_cloth(5);
  ClothWithEffect free(bare, "gust", {q.x(), q.y(), q.z(), f, phase},
                       attitude * flat_positions(bare.mesh));
  free.set.gravity_m_per_s2.setZero();

  double expected = 0;
  free.after(900, h, [&](int step, const ClothWithEffect::State& state) {
    // Every vertex has the same area per mass: V += h (n . q) sin / sigma n.
    expected += h * n.dot(q) * harmonic(f, phase, (step - 1) * h) / kSquareClothDensity_kg_per_m2;
    EXPECT_LT((state.velocity_m_per_s.colwise() - expected * n).cwiseAbs().maxCoeff(), 1e-12)
        << step;
  });
}

TEST(Gust, TurnsWithTheSceneWhenItsDirectionTurnsToo) {
  Uniform uniform(2);
  const Eigen::Vector3d q(0.3, -0.2, 0.5);
  const Eigen::Matrix3d turn = uniform.rotation();
  const Eigen::Vector3d turned = turn * q;
  const Cloth bare = square_cloth(6);
  const Eigen::Matrix3Xd p = crumpled(bare.mesh, 0.5, uniform), v = at_rest(p);

  const Eigen::Matrix3Xd force =
      ClothWithEffect(bare, "gust", {q.x(), q.y(), q.z(), 1, 0.1}, p).force_n(p, v);

  EXPECT_LT((ClothWithEffect(bare, "gust", {turned.x(), turned.y(), turned.z(), 1, 0.1}, p)
                 .force_n(turn * p, v) -
             turn * force)
                .norm(),
            1e-13 * force.norm());
}

}  // namespace
}  // namespace clothfit
