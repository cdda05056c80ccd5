// Checks stress that relaxes.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/model/spring_rig.h"

namespace clothfit {
namespace {

constexpr double kAtOnce_n_per_m = 40, kRatio = 0.7, kTime_s = 0.05, kElongation = 0.03;

TEST(Relaxation, KeepsTheContractOfEffects) {
  expect_effect_contract("relaxation", {.isotropic = true, .proportional = true, .internal = true});
}

/// Returns the share of the arm's tension that remains from a sudden elongation after `steps`
/// steps.
double left_after(double time_step_s, int steps) {
  DrivenRibbon ribbon(2, kAtOnce_n_per_m, "relaxation", {kRatio, kTime_s});
  double tension_n = 0;
  for (int n = 0; n < steps; ++n) tension_n = ribbon.tension_n(kElongation, 0, time_step_s);
  return tension_n / (kRatio * kAtOnce_n_per_m * ribbon.natural_length_m() * kElongation);
}

TEST(Relaxation, TheArmsStressFallsAsTheSchemeHasIt) {
  for (const int steps : {1, 10, 100})
    for (const double h : {1e-4, 1e-2, 1.0})  // much longer steps than its time included
      EXPECT_NEAR(left_after(h, steps), std::pow(1 + h / kTime_s, -steps), 1e-13);
}

TEST(Relaxation, TheArmsStressFallsExponentiallyInTheLimitOfSmallSteps) {
  const double exact = std::exp(-2.0);  // after twice the time
  double coarser = 0;
  for (const int steps : {50, 100, 200, 400}) {
    const double error = std::abs(left_after(2 * kTime_s / steps, steps) - exact);
    if (coarser > 0) {  // first order
      EXPECT_NEAR(coarser / error, 2, 0.05) << steps;
    }
    coarser = error;
  }
  EXPECT_LT(coarser, 0.01 * exact);
}

TEST(Relaxation, IsASpringForFastMotionsAndNothingForSlowOnes) {
  DrivenRibbon fast(2, kAtOnce_n_per_m, "relaxation", {kRatio, 10.0}),
      slow(2, kAtOnce_n_per_m, "relaxation", {kRatio, 0.005});
  const double full_n = kRatio * kAtOnce_n_per_m * fast.natural_length_m() * kElongation;

  double fast_n = 0, slow_n = 0;
  for (int n = 1; n <= 1000; ++n) {  // stretched within 1 s
    fast_n = fast.tension_n(kElongation * n / 1000, kElongation, 1e-3);
    slow_n = slow.tension_n(kElongation * n / 1000, kElongation, 1e-3);
  }

  EXPECT_NEAR(fast_n, full_n, 0.06 * full_n);          // 1 s of 10 s, half of it stretched
  EXPECT_NEAR(slow_n, 0.005 * full_n, 1e-6 * full_n);  // the dashpot: k time dl/dt
}

TEST(Relaxation, AnOscillatorLosesMostAtTheArmsOwnFrequency) {
  // In a standard linear solid the loss is largest where frequency times time is about 1.
  using Rig = SpringOscillator;
  const double period_time_s = std::sqrt(Rig::kMass_kg / Rig::kStiffness_n_per_m);
  const auto left = [&](double time_s) {
    const std::vector<double> x = Rig("relaxation", {0.1, time_s}, 0.02).extensions_m(5e-5, 20000);
    double largest = 0;
    for (size_t n = x.size() - 4000; n < x.size(); ++n) largest = std::max(largest, std::abs(x[n]));
    return largest;
  };

  const double own = left(period_time_s);

  EXPECT_LT(own, 0.7 * left(10 * period_time_s));
  EXPECT_LT(own, 0.7 * left(0.32 * period_time_s));
}

}  // namespace
}  // namespace clothfit
