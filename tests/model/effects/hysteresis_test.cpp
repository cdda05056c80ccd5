// Checks dry friction inside the fabric.

#include <gtest/gtest.h>

#include <cmath>

#include "model/effects/registry.h"
#include "tests/model/spring_rig.h"

namespace clothfit {
namespace {

constexpr double kStiffness_n_per_m = 40, kRatio = 0.7, kYield = 0.01;

TEST(Hysteresis, KeepsTheContractOfEffects) {
  expect_effect_contract("hysteresis", {.isotropic = true, .proportional = true, .internal = true});
}

TEST(Hysteresis, ACycleLosesTheAreaOfItsParallelogram) {
  DrivenRibbon ribbon(2, kStiffness_n_per_m, "hysteresis", {kRatio, kYield});
  const double amplitude = 0.04;
  // The path goes up and down along straight lines, corners and slips on the grid. The trapezoids
  // are exact.
  constexpr int kQuarter = 40;
  std::vector<double> cycle;
  for (int n = 1; n <= 2 * kQuarter; ++n) cycle.push_back(amplitude * (1 - double(n) / kQuarter));
  for (int n = 1; n <= 2 * kQuarter; ++n) cycle.push_back(amplitude * (-1 + double(n) / kQuarter));
  for (int n = 0; n <= kQuarter; ++n) ribbon.tension_n(amplitude * n / kQuarter, 0, 1e-3);

  double e = amplitude, tension_n = ribbon.tension_n(e, 0, 1e-3), work_j = 0;
  for (const double next : cycle) {
    const double next_n = ribbon.tension_n(next, 0, 1e-3);
    work_j += 0.5 * (tension_n + next_n) * (next - e) * ribbon.natural_length_m();
    e = next;
    tension_n = next_n;
  }

  const double l0 = ribbon.natural_length_m();
  EXPECT_NEAR(work_j, 4 * kRatio * kStiffness_n_per_m * l0 * l0 * kYield * (amplitude - kYield),
              1e-15);
}

TEST(Hysteresis, ASmallOscillationLosesNothing) {
  DrivenRibbon ribbon(2, kStiffness_n_per_m, "hysteresis", {kRatio, kYield});

  // Lengths of 0.4 m are rounded at 1e-16 m, times 28 N/m.
  for (const double e : {0.009, -0.003, 0.0, 0.01, -0.01}) {
    EXPECT_NEAR(ribbon.tension_n(e, 0, 1e-3),
                kRatio * kStiffness_n_per_m * ribbon.natural_length_m() * e, 1e-14)
        << e;
  }
}

TEST(Hysteresis, AnOscillatorLosesTheSameOfItsAmplitudeInEveryCycle) {
  // From one turning point to the next, F = ratio k l0 yield and k_f = ratio k:
  // k (A1^2 - A2^2) / 2 = F (A1 + A2 - 2 F / k_f). With k_f >> k that is A1 - A2 = 2 F / k, a
  // straight line instead of a viscous damper's exponential.
  using Rig = SpringOscillator;
  const double ratio = 20, yield = 1e-4, h = 2e-5;
  const double k = Rig::kStiffness_n_per_m, friction_n = ratio * k * Rig::kLength_m * yield;
  const std::vector<double> x = Rig("hysteresis", {ratio, yield}, 0.03).extensions_m(h, 50000);

  std::vector<double> turning{x.front()};
  for (size_t n = 1; n + 1 < x.size(); ++n) {
    if ((x[n] - x[n - 1]) * (x[n + 1] - x[n]) >= 0) continue;
    if (std::abs(x[n]) < 6 * friction_n / k) break;  // before it sticks
    turning.push_back(x[n]);
  }

  ASSERT_GT(turning.size(), 8u);
  for (size_t n = 1; n < turning.size(); ++n) {
    const double from = std::abs(turning[n - 1]), to = std::abs(turning[n]);
    const double work = friction_n * (from + to - 2 * yield * Rig::kLength_m);
    EXPECT_NEAR(0.5 * k * (from * from - to * to) / work, 1, 5e-3) << n;
    EXPECT_NEAR(from - to, 2 * friction_n / k, 0.03 * 2 * friction_n / k) << n;
  }
}

TEST(Hysteresis, WhereItSticksItIsNoStifferThanItsRatesSay) {
  // The cloth is crumpled less than the yield. The contract's cloth is crumpled beyond it, where
  // all slips.
  Uniform uniform(1);
  const Cloth cloth = square_cloth(6);
  const auto effect = find_effect("hysteresis", "").make();
  const std::vector<double> parameters{2.0, 0.1};
  const Eigen::Matrix3Xd p = crumpled(cloth.mesh, 0.02, uniform);

  const double seen =
      effect_contract::spectrum({{effect.get(), parameters}}, cloth, p).frequency2_per_s2;

  const double bound =
      effect->rates(cloth, spring_parameters(cotton(), cloth.mesh), parameters).frequency2_per_s2;
  EXPECT_LE(seen, bound);
  EXPECT_GE(seen, 0.4 * bound);
}

}  // namespace
}  // namespace clothfit
