// The whole fit on a small synthetic cloth, from nothing to a result. Its parts are checked beside
// their own sources; recordings of other programs and of real cloth in recordings_test.cpp.
#include "fit/fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "data/input_error.h"
#include "synthetic_cloth.h"

namespace clothfit {
namespace {

FitOptions quick(unsigned long long seed = 1) {
  return {.seed = seed, .population = 60, .generations = 20, .refine_best = 2};
}

const ParameterEstimate& find(const FitResult& result, const std::string& name) {
  for (const ParameterEstimate& parameter : result.parameters)
    if (parameter.name == name) return parameter;
  throw std::out_of_range(name);
}

void expect_within(const FitResult& result, const std::string& name, double truth, double share) {
  const ParameterEstimate& estimate = find(result, name);
  EXPECT_EQ(estimate.state, ParameterState::fitted) << name << ": " << estimate.reason;
  EXPECT_NEAR(estimate.value, truth, share * truth) << name;
  EXPECT_GT(estimate.sigma, 0) << name;
}

TEST(Fit, RecoversTheFabricFrom3dTracksAndForecastsHeldOutFrames) {
  const SyntheticCloth truth;
  const FitReport report = fit(synthetic_input(truth), quick(), {});

  ASSERT_TRUE(report.usable()) << report.message;
  expect_within(report.result, "tension_warp", truth.fabric.tension_warp_n_per_m, 0.05);
  expect_within(report.result, "tension_weft", truth.fabric.tension_weft_n_per_m, 0.05);
  expect_within(report.result, "shear", truth.fabric.shear_n_per_m, 0.03);
  expect_within(report.result, "flexion_warp", truth.fabric.flexion_warp_n_per_m, 0.1);
  expect_within(report.result, "flexion_weft", truth.fabric.flexion_weft_n_per_m, 0.1);
  const ObservationErrors& errors = report.result.errors.at(0);
  EXPECT_NEAR(errors.fitted.rms, truth.noise_m, 0.05 * truth.noise_m);
  EXPECT_LT(errors.held_out.rms, 1.5 * truth.noise_m);
  EXPECT_GT(errors.trivial.first_frame, 20 * errors.held_out.rms);
  EXPECT_GT(errors.trivial.last_velocity, 20 * errors.held_out.rms);
  // 10 held-out frames of 49 markers, held ones included
  EXPECT_EQ(errors.held_out.count, 10 * 49);
}

TEST(Fit, RecoversTheFabricFromOneCamera) {
  const SyntheticCloth truth{.seed = 4};
  FitOptions options = quick();
  options.observations = ObservationKind::tracks2d;

  const FitReport report = fit(synthetic_input(truth), options, {});

  ASSERT_TRUE(report.usable()) << report.message;
  expect_within(report.result, "tension_warp", truth.fabric.tension_warp_n_per_m, 0.06);
  expect_within(report.result, "shear", truth.fabric.shear_n_per_m, 0.04);
  EXPECT_EQ(report.result.errors.at(0).unit, "px");
  EXPECT_LT(report.result.errors.at(0).held_out.rms, 1.5 * truth.noise_px);
}

TEST(Fit, FindsDragWhenAskedForAndNeutralWhereThereIsNone) {
  for (const double rate : {2.0, 0.0}) {
    SCOPED_TRACE(rate);
    FitOptions options = quick();
    options.effects = {"viscous_damping"};

    const FitReport report = fit(synthetic_input({.drag_rate_per_s = rate}), options, {});

    ASSERT_TRUE(report.usable()) << report.message;
    ASSERT_EQ(report.result.effects.size(), 1u);
    const ParameterEstimate& drag = report.result.effects[0].parameters.at(0);
    EXPECT_EQ(drag.name, "rate");
    EXPECT_NEAR(drag.value, rate, std::max(0.03, 5 * drag.sigma));
  }
}

TEST(Fit, GivesTheSameBitsForAnyNumberOfThreads) {
  const FitInput input =
      synthetic_input({.mesh = 5, .markers = 5, .frames = 16, .held_out_from = 12});
  FitOptions options = quick(3);
  options.generations = 6;

  options.threads = 1;
  const FitReport one = fit(input, options, {});
  options.threads = 4;
  const FitReport four = fit(input, options, {});

  ASSERT_TRUE(one.usable()) << one.message;
  for (size_t p = 0; p < one.result.parameters.size(); ++p) {
    EXPECT_EQ(one.result.parameters[p].value, four.result.parameters[p].value);
    EXPECT_EQ(one.result.parameters[p].sigma, four.result.parameters[p].sigma);
  }
  EXPECT_EQ(one.search_cost, four.search_cost);
}

TEST(Fit, ForecastsAnotherReleaseWithoutFittingIt) {
  // Given a fit, and another recording of the same cloth with noise of its own
  const FitReport fitted = fit(synthetic_input({}), quick(), {});
  ASSERT_TRUE(fitted.usable());
  FitOptions options;
  options.forecast = fitted.result;

  const FitReport forecast = fit(synthetic_input({.seed = 77}), options, {});

  ASSERT_TRUE(forecast.usable()) << forecast.message;
  EXPECT_EQ(find(forecast.result, "shear").state, ParameterState::fixed);
  EXPECT_EQ(find(forecast.result, "shear").value, find(fitted.result, "shear").value);
  EXPECT_LT(forecast.result.errors.at(0).held_out.rms, 1.5 * 5e-4);
}

TEST(Fit, TellsWhatItCannotKnowOfAClothThatWasNotWeighed) {
  FitInput input = synthetic_input({.mesh = 5, .markers = 5, .frames = 16, .held_out_from = 12});
  input.recording.cloth.mass_kg.reset();

  const FitReport report = fit(input, quick(), {});

  const ParameterEstimate& density = find(report.result, "areal_density");
  EXPECT_EQ(density.state, ParameterState::undetermined);
  EXPECT_THAT(density.reason, ::testing::HasSubstr("only ratios to mass"));
}

TEST(Fit, EndsWhenItIsCancelled) {
  for (const int after : {1, 8}) {
    int calls = 0;
    const FitReport report = fit(synthetic_input({.mesh = 5, .markers = 5}), quick(),
                                 [&](const Progress&) { return ++calls < after; });
    EXPECT_EQ(report.stop, FitStop::cancelled);
    EXPECT_FALSE(report.usable());
  }
}

TEST(Fit, RefusesOptionsOutOfRange) {
  const FitInput input = synthetic_input({.mesh = 5, .markers = 5});
  EXPECT_THROW(fit(input, {.mesh_columns = 1}, {}), InputError);
  EXPECT_THROW(fit(input, {.population = 1}, {}), InputError);
  EXPECT_THROW(fit(input, {.work = 0}, {}), InputError);
  EXPECT_THROW(fit(input, {.substep_scale = 0}, {}), InputError);
}

}  // namespace
}  // namespace clothfit
