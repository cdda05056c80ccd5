#include "tests/fit/planted_effect.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

/// Finds a nuisance parameter, or one of an effect of motion.
const ParameterEstimate* find(const FitResult& result, const std::string& effect,
                              const std::string& parameter) {
  const auto nuisance =
      std::ranges::find(result.nuisance, effect + "." + parameter, &ParameterEstimate::name);
  if (nuisance != result.nuisance.end()) return &*nuisance;
  for (const EffectEstimate& of : result.effects) {
    const auto own = std::ranges::find(of.parameters, parameter, &ParameterEstimate::name);
    if (of.name == effect && own != of.parameters.end()) return &*own;
  }
  return nullptr;
}

}  // namespace

void expect_found(const FitInput& input, const PlantedEffect& planted) {
  const FitOptions options{.observations = planted.observations,
                           .effects = {planted.name},
                           .priors = planted.priors,
                           .mesh_columns = 9,
                           .mesh_rows = 9,
                           .start = named(SyntheticCloth{}.fabric)};

  const FitReport report = fit(input, options, {});

  ASSERT_TRUE(report.usable()) << report.message;
  for (const auto& [name, truth] : planted.truth) {
    SCOPED_TRACE(planted.name + "." + name);
    const ParameterEstimate* found = find(report.result, planted.name, name);
    ASSERT_NE(found, nullptr);
    EXPECT_EQ(found->state, ParameterState::fitted);
    EXPECT_NEAR(found->value, truth, 4 * found->sigma);
    // "Found" means told from nothing.
    EXPECT_GT(std::abs(truth), 5 * found->sigma);
  }
  const ObservationErrors& errors = report.result.errors.front();
  EXPECT_NEAR(errors.fitted.rms, errors.noise, 0.04 * errors.noise);
}

}  // namespace clothfit
