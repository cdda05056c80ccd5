// Checks that a late clock is found where it was planted, and told from everything else.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/fit/measurement_contract.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

const ParameterEstimate* find(const std::vector<ParameterEstimate>& list, const std::string& name) {
  const auto found = std::ranges::find(list, name, &ParameterEstimate::name);
  return found != list.end() ? &*found : nullptr;
}

TEST(ClockOffset, KeepsToTheContract) {
  check_measurement_effect("clock_offset", synthetic_input({}));
}

TEST(ClockOffset, IsFoundWhereItWasPlantedAndMendsTheFit) {
  // Given frames that show the cloth 7 ms after their time, 0.4 of a frame interval
  constexpr double kTrue = 7e-3;
  const FitInput input = synthetic_input({.clock_offset_s = kTrue});
  FitOptions options{.effects = {"clock_offset"},
                     .mesh_columns = 9,
                     .mesh_rows = 9,
                     .start = named(SyntheticCloth{}.fabric)};

  const FitReport report = fit(input, options, {});

  ASSERT_TRUE(report.usable()) << report.message;
  const ParameterEstimate* offset = find(report.result.nuisance, "clock_offset.time");
  ASSERT_NE(offset, nullptr);
  EXPECT_NEAR(offset->value, kTrue, 4 * offset->sigma);
  EXPECT_LT(offset->sigma, 4e-4);
  EXPECT_NEAR(report.result.errors.front().fitted.rms, 5e-4, 2e-5);
  const ParameterEstimate* shear = find(report.result.parameters, "shear");
  ASSERT_NE(shear, nullptr);
  EXPECT_NEAR(shear->value, 18, 4 * shear->sigma);

  // The residual of a fit that trusts the clock is far above the noise.
  options.effects.clear();
  const FitReport without = fit(input, options, {});
  ASSERT_TRUE(without.usable()) << without.message;
  EXPECT_GT(without.result.errors.front().fitted.rms, 2 * 5e-4);
}

TEST(ClockOffset, IsHeldByAPriorThatSaysMoreThanTheData) {
  // Given the same recording, and a prior elsewhere, a thousand times as sharp as the data
  constexpr double kMean = 3e-3;
  const FitInput input = synthetic_input({.clock_offset_s = 7e-3});
  const FitReport report =
      fit(input,
          {.effects = {"clock_offset"},
           .priors = {{.name = "clock_offset.time", .mean = kMean, .sigma = 1e-7}},
           .mesh_columns = 9,
           .mesh_rows = 9,
           .start = named(SyntheticCloth{}.fabric)},
          {});

  ASSERT_TRUE(report.usable()) << report.message;
  const ParameterEstimate* offset = find(report.result.nuisance, "clock_offset.time");
  ASSERT_NE(offset, nullptr);
  EXPECT_NEAR(offset->value, kMean, 1e-6);
}

}  // namespace
}  // namespace clothfit
