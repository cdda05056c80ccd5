// Checks an empirical tension. That it keeps momentum and angular momentum is part of the contract
// of internal effects (effect_contract.h).

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "model/effects/registry.h"
#include "tests/model/spring_rig.h"

namespace clothfit {
namespace {

constexpr double kLinear_n_per_m = 40, kLength_m = 0.4;  // for the ribbon, along the warp
constexpr double kScale_n = kLinear_n_per_m * kLength_m;

/// Returns the tension with the warp's coefficients.
double tension_n(double stretched, double compressed, double rate_squared_s2, double elongation,
                 double rate_per_s) {
  DrivenRibbon ribbon(2, kLinear_n_per_m, "tension_law",
                      {stretched, 0, 0, compressed, 0, 0, rate_squared_s2, 0, 0});
  return ribbon.tension_n(elongation, rate_per_s, 1e-3);
}

TEST(TensionLaw, KeepsTheContractOfEffects) {
  expect_effect_contract("tension_law", {.isotropic = true, .internal = true});
}

TEST(TensionLaw, IsTheNamedSquaresOfElongationAndItsRate) {
  for (const double e : {0.003, 0.045}) {
    EXPECT_NEAR(tension_n(15, 0, 0, e, 0), kScale_n * 15 * e * e, 1e-13) << e;
    EXPECT_NEAR(tension_n(0, -15, 0, -e, 0), -kScale_n * 15 * e * e, 1e-13) << e;
    EXPECT_EQ(tension_n(15, 0, 0, -e, 0), 0) << e;
    EXPECT_EQ(tension_n(0, -15, 0, e, 0), 0) << e;
  }
  for (const double rate : {-8.0, -0.3, 2.0})
    EXPECT_NEAR(tension_n(0, 0, 5e-4, 0.01, rate), kScale_n * 5e-4 * std::abs(rate) * rate, 1e-13)
        << rate;
}

TEST(TensionLaw, GoesStraightOnWhereTheSquaresEnd) {
  // The tangent is T(a) + T'(a) (x - a), at a = 0.05 and at 10/s.
  EXPECT_NEAR(tension_n(1, 0, 0, 0.3, 0), kScale_n * (0.0025 + 0.1 * 0.25), 1e-13);
  EXPECT_NEAR(tension_n(0, 1, 0, -0.3, 0), kScale_n * (0.0025 + 0.1 * 0.25), 1e-13);
  for (const double sign : {-1.0, 1.0})
    EXPECT_NEAR(tension_n(0, 0, 1e-3, 0.01, sign * 25), sign * kScale_n * 1e-3 * (100 + 20 * 15),
                1e-12);
}

TEST(TensionLaw, LeavesATenthToFiveTimesTheStiffnessWithinItsBounds) {
  const std::vector<EffectParameter> parameters =
      find_effect("tension_law", "").describe().parameters;
  for (const double stretched : {parameters[0].lower, parameters[0].upper})
    for (const double compressed : {parameters[3].lower, parameters[3].upper})
      for (double e = -0.5; e < 0.5; e += 0.01) {
        const double rise = 1 + (tension_n(stretched, compressed, 0, e + 1e-4, 0) -
                                 tension_n(stretched, compressed, 0, e, 0)) /
                                    (kScale_n * 1e-4);
        EXPECT_GT(rise, 0.1 - 1e-9) << stretched << " " << compressed << " " << e;
        EXPECT_LT(rise, 5 + 1e-9) << stretched << " " << compressed << " " << e;
      }
}

TEST(TensionLaw, ActsOnItsOwnSpringsOnly) {
  // A ribbon's springs that pull are its warp.
  for (size_t k = 0; k < 9; ++k) {
    std::vector<double> one(9, 0);
    one[k] = find_effect("tension_law", "").describe().parameters[k].typical;
    DrivenRibbon ribbon(2, kLinear_n_per_m, "tension_law", one);
    EXPECT_EQ(ribbon.tension_n(k == 3 ? -0.05 : 0.05, 1, 1e-3) != 0, k % 3 == 0)
        << find_effect("tension_law", "").describe().parameters[k].name;
  }
}

TEST(TensionLaw, NamesWhatEachCoefficientMultiplies) {
  std::map<std::string, std::string> factor;
  for (const EffectParameter& parameter : find_effect("tension_law", "").describe().parameters) {
    EXPECT_EQ(parameter.law_side, "T / (k l0)");
    factor[parameter.name] = parameter.law_factor;
  }
  EXPECT_EQ(factor["warp_stretched"], "e_warp^2 (e > 0)");
  EXPECT_EQ(factor["shear_rate_squared"], "|e'| e'_shear");
}

}  // namespace
}  // namespace clothfit
