// Checks that a scale of the measurement is found where it was planted.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/fit/measurement_contract.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

TEST(Scale, KeepsToTheContract) {
  check_measurement_effect("scale", synthetic_input({}));
}

TEST(Scale, IsFoundWhereItWasPlanted) {
  constexpr double kTrue = 1.02;
  const FitInput input = synthetic_input({.scale = kTrue});

  const FitReport report = fit(input,
                               {.effects = {"scale"},
                                .mesh_columns = 9,
                                .mesh_rows = 9,
                                .start = named(SyntheticCloth{}.fabric)},
                               {});

  ASSERT_TRUE(report.usable()) << report.message;
  const auto found =
      std::ranges::find(report.result.nuisance, "scale.factor", &ParameterEstimate::name);
  ASSERT_NE(found, report.result.nuisance.end());
  EXPECT_NEAR(found->value, kTrue, 4 * found->sigma);
  EXPECT_LT(found->sigma, 2e-4);
  EXPECT_NEAR(report.result.errors.front().fitted.rms, 5e-4, 2e-5);
}

TEST(Scale, ThatIsDeclaredIsTakenOutAndToldInTheResult) {
  FitInput input = synthetic_input({.scale = 1.02});
  input.recording.declared = {{.name = "scale", .parameters = {{"factor", {1.02}}}}};

  const FitReport report =
      fit(input, {.mesh_columns = 9, .mesh_rows = 9, .start = named(SyntheticCloth{}.fabric)}, {});

  ASSERT_TRUE(report.usable()) << report.message;
  EXPECT_NEAR(report.result.errors.front().fitted.rms, 5e-4, 2e-5);
  const auto found =
      std::ranges::find(report.result.nuisance, "scale.factor", &ParameterEstimate::name);
  ASSERT_NE(found, report.result.nuisance.end());
  EXPECT_EQ(found->value, 1.02);
  EXPECT_EQ(found->state, ParameterState::fixed);
}

}  // namespace
}  // namespace clothfit
