// Checks the whole fit on a small synthetic cloth, from nothing to a result. Its parts are checked
// beside their own sources; recordings of other programs and of real cloth in recordings_test.cpp.
#include "fit/fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "data/input_error.h"
#include "tests/data/temporary_folder.h"
#include "tests/fit/synthetic_cloth.h"

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
  // There are 10 held-out frames of 49 markers, held ones included.
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

    const FitReport report =
        fit(synthetic_input({.drag_rate_per_s = rate, .mesh = 5}), options, {});

    ASSERT_TRUE(report.usable()) << report.message;
    ASSERT_EQ(report.result.effects.size(), 1u);
    const ParameterEstimate& drag = report.result.effects[0].parameters.at(0);
    EXPECT_EQ(drag.name, "rate");
    EXPECT_NEAR(drag.value, rate, std::max(0.03, 5 * drag.sigma));
  }
}

// The cloth moves in thick air, of which the model knows nothing.
TEST(Fit, OnlyFollowsTheCoarseMeshWhereTheModelIsGrosslyMisfitting) {
  const FitInput input = synthetic_input(
      {.drag_rate_per_s = 8, .mesh = 9, .markers = 5, .frames = 20, .held_out_from = 16});
  FitOptions options = quick();
  options.refine_best = 1;
  options.population = 20;
  options.generations = 6;
  options.work = 0.05;
  const FitReport whole = fit(input, options, {});
  options.coarse_beyond = 10;
  const FitReport followed = fit(input, options, {});

  ASSERT_TRUE(followed.usable()) << followed.message;
  const auto on_its_own_mesh = [](const std::string& stage) {
    return stage.starts_with("refinement on 9 x 9 over");
  };
  EXPECT_TRUE(std::ranges::any_of(whole.stages, on_its_own_mesh));
  EXPECT_TRUE(std::ranges::none_of(followed.stages, on_its_own_mesh));
  EXPECT_EQ(followed.result.mesh_columns, 9);
  const double left = whole.result.errors.at(0).fitted.rms;
  EXPECT_GT(left, std::sqrt(10) * 5e-4);
  EXPECT_LT(followed.result.errors.at(0).fitted.rms, 1.2 * left);
}

// The noise is so small that a coarser mesh errs by many times as much.
TEST(Fit, LeavesTheCoarseMeshWhereOnlyThatMisfits) {
  const SyntheticCloth truth{
      .mesh = 9, .markers = 5, .frames = 20, .held_out_from = 16, .noise_m = 5e-6};
  FitOptions options = quick();
  options.coarse_beyond = 10;
  options.start = named(truth.fabric);
  for (auto& [name, value] : *options.start) value *= 1.1;
  const FitReport report = fit(synthetic_input(truth), options, {});

  ASSERT_TRUE(report.usable()) << report.message;
  EXPECT_TRUE(std::ranges::any_of(report.stages, [](const std::string& stage) {
    return stage.starts_with("refinement on 9 x 9 over");
  }));
  EXPECT_LT(report.result.errors.at(0).fitted.rms, 5e-5);  // the truth has another time step
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
  const FitReport fitted = fit(synthetic_input({}), {.start = named(SyntheticCloth().fabric)}, {});
  ASSERT_TRUE(fitted.usable());
  FitOptions options;
  options.forecast = fitted.result;

  const FitReport forecast = fit(synthetic_input({.seed = 77}), options, {});

  ASSERT_TRUE(forecast.usable()) << forecast.message;
  EXPECT_EQ(find(forecast.result, "shear").state, ParameterState::fixed);
  EXPECT_EQ(find(forecast.result, "shear").value, find(fitted.result, "shear").value);
  EXPECT_LT(forecast.result.errors.at(0).held_out.rms, 1.5 * 5e-4);
}

TEST(Fit, ForecastsOnTheMeshThatWasFitted) {
  FitOptions options;
  options.forecast = FitResult{.mesh_columns = 7, .mesh_rows = 5};
  for (const auto& [name, value] : named(SyntheticCloth().fabric))
    options.forecast->parameters.push_back({.name = name, .value = value});

  const FitReport forecast = fit(synthetic_input({}), options, {});

  EXPECT_EQ(forecast.result.mesh_columns, 7);
  EXPECT_EQ(forecast.result.mesh_rows, 5);
}

// Knowledge of a recording from elsewhere is used as it is.
TEST(Fit, ReportsKnownParametersWithKnownOffsetsOfMarkers) {
  const FitInput input = synthetic_input({});
  FitOptions options;
  options.marker_offset_sigma_m = 0.01;
  KnownParameters known{.values = named(SyntheticCloth().fabric), .sigma = {}};
  const auto held_out = [&] {
    return report_at(input, options, known).result.errors.front().held_out.rms;
  };
  EXPECT_LT(held_out(), 1.2 * 5e-4);
  for (const auto& marker : input.recording.markers.markers)
    known.marker_offsets.push_back({.marker = marker.name, .offset_m = {0, 0, 0.01}});

  EXPECT_NEAR(held_out(), 0.01 / std::sqrt(3), 3e-4);
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

/// Makes a cloth whose fit takes a moment.
FitInput tiny_input(unsigned seed = 1) {
  return synthetic_input(
      {.mesh = 5, .markers = 5, .frames = 16, .held_out_from = 12, .seed = seed});
}

FitOptions tiny_fit(SearchMethod search) {
  FitOptions options = quick();
  options.search = search;
  options.population = 24;
  options.generations = 8;
  return options;
}

/// Returns fit.json's bytes, without the seconds that it took.
std::string fit_json(FitReport report, const TemporaryFolder& folder) {
  report.result.seconds = 0;
  const std::filesystem::path file = folder.path() / "fit.json";
  write_fit_result(report.result, file);
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Fit, LooksAtNoFewerFramesThanItSearchedOver) {
  const SyntheticCloth truth{.seed = 7};  // 26 frames are fitted
  FitOptions options = quick();
  options.search = SearchMethod::cma;
  options.search_share = 1;

  const FitReport report = fit(synthetic_input(truth), options, {});

  ASSERT_TRUE(report.usable()) << report.message;
  for (const std::string& stage : report.stages)
    if (stage.find("frames") != std::string::npos) {
      EXPECT_THAT(stage, ::testing::HasSubstr("26 frames"));
    }
  expect_within(report.result, "shear", truth.fabric.shear_n_per_m, 0.03);
}

TEST(Fit, TellsTheBasinsThatItCameAcrossBestFirst) {
  for (const SearchMethod search : {SearchMethod::paper, SearchMethod::cma}) {
    FitOptions options = tiny_fit(search);
    options.refine_best = 3;
    const FitReport report = fit(tiny_input(), options, {});

    ASSERT_TRUE(report.usable()) << report.message;
    const std::vector<Basin>& basins = report.result.basins;
    ASSERT_FALSE(basins.empty());
    EXPECT_TRUE(basins.front().refined);
    for (size_t n = 0; n < basins.size(); ++n) {
      ASSERT_EQ(basins[n].parameters.size(), 7u);
      EXPECT_EQ(basins[n].parameters[2].name, "shear");
      EXPECT_GE(basins[n].ended, 1);
      EXPECT_GE(basins[n].cost, basins[n > 0 ? n - 1 : 0].cost);
    }
    // The noise of a 3D point is sqrt(8 / pi) sigmas long on average; the mesh adds its error.
    EXPECT_GT(basins.front().cost, 1.4);
    EXPECT_LT(basins.front().cost, 3);
  }
}

TEST(Fit, GoesOnFromACheckpointToTheSameBytes) {
  const TemporaryFolder folder;
  for (const SearchMethod search : {SearchMethod::paper, SearchMethod::cma}) {
    const FitInput input = tiny_input();
    const FitReport whole = fit(input, tiny_fit(search), {});
    ASSERT_TRUE(whole.usable()) << whole.message;
    const std::string expected = fit_json(whole, folder);
    for (const int generation : {1, 3, 5}) {
      SCOPED_TRACE(generation);
      FitOptions options = tiny_fit(search);
      options.checkpoint =
          folder.path() / (std::to_string(static_cast<int>(search)) + std::to_string(generation));
      int calls = 0;
      const FitReport cut = fit(input, options, [&](const Progress& progress) {
        return progress.stage != "search" || ++calls < generation;
      });
      EXPECT_EQ(cut.stop, FitStop::cancelled);
      EXPECT_EQ(calls, generation);

      options.resume = true;
      const FitReport resumed = fit(input, options, {});

      EXPECT_EQ(resumed.search_cost, whole.search_cost);
      EXPECT_TRUE(fit_json(resumed, folder) == expected);
    }
  }
}

TEST(Fit, GoesOnAfterASearchThatHadEnded) {
  const TemporaryFolder folder;
  FitOptions options = tiny_fit(SearchMethod::paper);
  const std::string expected = fit_json(fit(tiny_input(), options, {}), folder);
  options.checkpoint = folder.path() / "checkpoint";
  const FitReport cut = fit(tiny_input(), options,
                            [&](const Progress& progress) { return progress.stage == "search"; });
  ASSERT_EQ(cut.stop, FitStop::cancelled);

  options.resume = true;
  EXPECT_TRUE(fit_json(fit(tiny_input(), options, {}), folder) == expected);
}

TEST(Fit, RefusesTheCheckpointOfAnotherFit) {
  const TemporaryFolder folder;
  FitOptions options = tiny_fit(SearchMethod::paper);
  options.checkpoint = folder.path() / "checkpoint";
  fit(tiny_input(), options, [](const Progress&) { return false; });
  ASSERT_TRUE(std::filesystem::exists(options.checkpoint));
  options.resume = true;

  EXPECT_THROW(fit(tiny_input(2), options, {}), InputError);  // other noise
  FitInput heavier = tiny_input();
  heavier.recording.cloth.mass_kg = 0.031;
  EXPECT_THROW(fit(heavier, options, {}), InputError);
  FitOptions other = options;
  other.seed = 2;
  EXPECT_THROW(fit(tiny_input(), other, {}), InputError);
  other = options;
  other.search = SearchMethod::cma;
  EXPECT_THROW(fit(tiny_input(), other, {}), InputError);
}

TEST(Fit, EndsItsSearchAtTheCostThatItIsAskedFor) {
  for (const SearchMethod search : {SearchMethod::paper, SearchMethod::cma}) {
    FitOptions options = tiny_fit(search);
    options.stop_cost = 1e6;
    EXPECT_EQ(fit(tiny_input(), options, {}).search_cost.size(), 1u);
  }
}

/// Makes a cloth with one stiffness for all springs, and air that damps it.
SyntheticCloth uniform_springs(double stiffness_n_per_m) {
  return {.fabric = {.tension_warp_n_per_m = stiffness_n_per_m,
                     .tension_weft_n_per_m = stiffness_n_per_m,
                     .shear_n_per_m = stiffness_n_per_m,
                     .flexion_warp_n_per_m = stiffness_n_per_m,
                     .flexion_weft_n_per_m = stiffness_n_per_m},
          .drag_rate_per_s = 3,
          .mesh = 5,
          .markers = 5,
          .frames = 24,
          .held_out_from = 18};
}

TEST(Fit, FindsThePapersFiveNumbersAndForecastsWithThem) {
  // The limit makes the cost piecewise: a smaller search ends in another basin.
  const SyntheticCloth truth = uniform_springs(20);
  FitOptions options = quick();
  options.population = 200;
  options.generations = 60;
  options.spring_set = SpringSet::louchet5;
  options.effects = {"viscous_damping"};

  const FitReport fitted = fit(synthetic_input(truth), options, {});

  ASSERT_TRUE(fitted.usable()) << fitted.message;
  EXPECT_EQ(fitted.result.parameter_set, "louchet5");
  expect_within(fitted.result, "stiffness", 20, 0.05);
  expect_within(fitted.result, "natural_length_01", 0.1, 0.01);
  expect_within(fitted.result, "natural_length_23", 0.1 * std::sqrt(2.0), 0.01);
  // No spring of the truth has a limit.
  EXPECT_EQ(find(fitted.result, "critical_elongation").state, ParameterState::undetermined);

  // The same cloth is recorded once more, with noise of its own.
  SyntheticCloth again = truth;
  again.seed = 77;
  FitOptions forecast{.spring_set = SpringSet::louchet5, .forecast = fitted.result};
  const FitReport report = fit(synthetic_input(again), forecast, {});

  ASSERT_TRUE(report.usable()) << report.message;
  EXPECT_EQ(report.result.parameter_set, "louchet5");
  EXPECT_EQ(find(report.result, "stiffness").state, ParameterState::fixed);
  EXPECT_LT(report.result.errors.at(0).held_out.rms, 1.5 * truth.noise_m);
  forecast.mesh_columns = 6;
  EXPECT_THROW(fit(synthetic_input(again), forecast, {}), InputError);
}

TEST(Fit, SaysThatSpringsOnTheirStrainLimitTellNothingOfTheirStiffness) {
  // Given springs so soft that the limit carries the cloth, at the step of the truth. One sweep a
  // step limits strain the more, the more steps there are. The fit begins with the truth and may do
  // little.
  SyntheticCloth truth = uniform_springs(0.1);
  truth.critical_elongation = 0.02;
  FitOptions options;
  options.spring_set = SpringSet::louchet18;
  options.effects = {"viscous_damping"};
  options.work = 1e-3;
  options.substep_scale = 80;
  options.start = {{"viscous_damping.rate", truth.drag_rate_per_s}};
  const double flat_m[] = {0.1, 0.1, 0.1 * std::sqrt(2.0), 0.1 * std::sqrt(2.0), 0.2, 0.2};
  for (int type = 0; type < 6; ++type) {
    const std::string of_type = std::string("_") + static_cast<char>('0' + type);
    (*options.start)["stiffness" + of_type] = 0.1;
    (*options.start)["natural_length" + of_type] = flat_m[type];
    (*options.start)["critical_elongation" + of_type] = truth.critical_elongation;
  }

  const FitReport report = fit(synthetic_input(truth), options, {});

  ASSERT_TRUE(report.usable()) << report.message;
  const ParameterEstimate& stiffness = find(report.result, "stiffness_0");  // along the fall
  EXPECT_EQ(stiffness.state, ParameterState::undetermined);
  EXPECT_THAT(stiffness.reason, ::testing::HasSubstr("sit on their strain limit"));
  // Such a spring shows only its longest length: the product of two parameters.
  EXPECT_THAT(find(report.result, "critical_elongation_0").reason,
              ::testing::HasSubstr("it can hardly be told from natural_length_0"));
}

TEST(Fit, BeginsWithTheParametersOfAnEarlierFitWithoutASearch) {
  const FitReport searched = fit(tiny_input(), tiny_fit(SearchMethod::paper), {});
  ASSERT_TRUE(searched.usable());
  FitOptions options;
  options.start.emplace();
  for (const ParameterEstimate& parameter : searched.result.parameters)
    if (parameter.name != "areal_density") (*options.start)[parameter.name] = 1.2 * parameter.value;

  const FitReport report = fit(tiny_input(), options, {});

  ASSERT_TRUE(report.usable()) << report.message;
  EXPECT_TRUE(report.search_cost.empty());
  EXPECT_TRUE(report.result.basins.empty());
  for (const char* name : {"tension_warp", "shear"}) {
    const ParameterEstimate& before = find(searched.result, name);
    EXPECT_NEAR(find(report.result, name).value, before.value, 0.2 * before.sigma) << name;
  }
  (*options.start)["sheer"] = 1;
  EXPECT_THROW(fit(tiny_input(), options, {}), InputError);
}

TEST(Fit, TakesShootingButNoStatesFromPixels) {
  const FitInput input = synthetic_input({.seed = 4});
  FitOptions options = quick();
  options.observations = ObservationKind::tracks2d;
  options.cost = LeadingCost::shooting;
  const SyntheticCloth truth;

  const FitReport led = fit(input, options, {});

  ASSERT_TRUE(led.usable()) << led.message;
  EXPECT_TRUE(led.search_cost.empty());
  expect_within(led.result, "tension_warp", truth.fabric.tension_warp_n_per_m, 0.06);
  expect_within(led.result, "shear", truth.fabric.shear_n_per_m, 0.04);
  for (const LeadingCost cost : {LeadingCost::full, LeadingCost::small}) {
    options.cost = cost;
    EXPECT_THROW(fit(input, options, {}), InputError);
  }
}

TEST(Fit, LooksFurtherWhereItIsAskedTo) {
  FitOptions options;
  options.start.emplace();
  for (const auto& [name, value] : std::map<std::string, double>{{"tension_warp", 40},
                                                                 {"tension_weft", 50},
                                                                 {"shear", 18},
                                                                 {"flexion_warp", 9},
                                                                 {"flexion_weft", 7},
                                                                 {"damping_warp", 2.5e-3},
                                                                 {"damping_weft", 2e-3}})
    (*options.start)[name] = value;
  const FitReport plain = fit(tiny_input(), options, {});
  ASSERT_TRUE(plain.usable()) << plain.message;
  EXPECT_FALSE(find(plain.result, "shear").bootstrap_90);
  EXPECT_FALSE(find(plain.result, "shear").mesh_shift);
  options.profile = options.two_meshes = true;
  options.bootstrap = 99;

  const FitReport report = fit(tiny_input(), options, {});

  ASSERT_TRUE(report.usable()) << report.message;
  const ParameterEstimate& shear = find(report.result, "shear");
  EXPECT_EQ(shear.value, find(plain.result, "shear").value);
  ASSERT_TRUE(shear.interval_90 && shear.bootstrap_90 && shear.mesh_shift);
  EXPECT_LT(shear.interval_90->lower, shear.value);
  EXPECT_GT(shear.interval_90->upper, shear.value);
  EXPECT_NE(*shear.mesh_shift, 0);
  EXPECT_EQ(report.stages.size(), plain.stages.size() + 7 + 1);  // a line for each parameter
  options.two_meshes = false;
  int calls = 0;
  const FitReport cancelled = fit(tiny_input(), options, [&](const Progress& now) {
    return now.stage != "profiles" || ++calls > 1;
  });
  EXPECT_TRUE(calls == 0 || cancelled.stop == FitStop::cancelled);
}

TEST(Fit, RefusesOptionsOutOfRange) {
  const FitInput input = synthetic_input({.mesh = 5, .markers = 5});
  EXPECT_THROW(fit(input, {.mesh_columns = 1}, {}), InputError);
  EXPECT_THROW(fit(input, {.population = 1}, {}), InputError);
  EXPECT_THROW(fit(input, {.search_share = 0}, {}), InputError);
  EXPECT_THROW(fit(input, {.search_share = 1.1}, {}), InputError);
  EXPECT_THROW(fit(input, {.work = 0}, {}), InputError);
  EXPECT_THROW(fit(input, {.substep_scale = 0}, {}), InputError);
  EXPECT_THROW(fit(input, {.resume = true}, {}), InputError);
  EXPECT_THROW(fit(input, {.bootstrap = 5}, {}), InputError);
  EXPECT_THROW(fit(input, {.two_meshes = true, .forecast = FitResult()}, {}), InputError);
  EXPECT_THROW(fit(input, {.spring_set = SpringSet::louchet5, .two_meshes = true}, {}), InputError);
  EXPECT_THROW(fit(input, {.checkpoint = "a", .start = {{}}}, {}), InputError);
}

}  // namespace
}  // namespace clothfit
