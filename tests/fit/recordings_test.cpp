// Checks fits of whole recordings. The bundled ones, made by another simulator, are compared with
// what was simulated; CLOTHFIT_DATA names recordings of real cloth. From pictures instead of
// tracks: tests/apps/demo_test.cpp.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "fit/fit.h"
#include "tests/fit/whole_recording.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

double true_stiffness(const std::string& recording, const std::string& types) {
  return bundled_truth(recording).at("springs").at(types).at("k");
}

/// Expects fabric parameters within `share` of the simulated ones, with a sigma of 5 % at most.
void expect_true_fabric(const FitResult& result, const std::string& recording, double share) {
  for (const ParameterEstimate& parameter : result.parameters) {
    std::string types;
    if (parameter.name.starts_with("tension")) types = "types_0_1";
    if (parameter.name.starts_with("shear")) types = "types_2_3";
    if (parameter.name.starts_with("flexion")) types = "types_4_5";
    if (types.empty()) continue;
    const double truth = true_stiffness(recording, types);
    EXPECT_EQ(parameter.state, ParameterState::fitted) << parameter.name;
    EXPECT_NEAR(parameter.value, truth, share * truth) << parameter.name;
    EXPECT_LT(parameter.sigma, 0.05 * parameter.value) << parameter.name;
    EXPECT_GT(parameter.sigma, 0) << parameter.name;
  }
}

/// Makes a fit begin with stiffness a third too large, further off than is asked of its end.
FitOptions started_beside(const std::string& recording) {
  constexpr double kBeside = 4.0 / 3;
  FitOptions options;
  options.start.emplace();
  for (const auto& [name, types] :
       {std::pair("tension_warp", "types_0_1"), std::pair("tension_weft", "types_0_1"),
        std::pair("shear", "types_2_3"), std::pair("flexion_warp", "types_4_5"),
        std::pair("flexion_weft", "types_4_5")})
    (*options.start)[name] = kBeside * true_stiffness(recording, types);
  return options;
}

const ObservationErrors& only_errors(const FitReport& report) {
  EXPECT_EQ(report.result.errors.size(), 1u);
  return report.result.errors.front();
}

// This is one test, because the fit that both halves look at takes some seconds.
TEST(Recordings, SwingPlainFrom3dTracksForecastsTheSameClothReleasedOtherwise) {
  const FitReport report = fit(bundled_recording("swing_plain"), started_beside("swing_plain"), {});

  ASSERT_TRUE(report.usable()) << report.message;
  expect_true_fabric(report.result, "swing_plain", 0.1);
  const ObservationErrors& errors = only_errors(report);
  // The noise is 0.5 mm. The residual of a plain model on the positions without noise was 0.58 mm
  // as a distance, 0.34 mm per coordinate, which adds in squares to 0.60 mm.
  EXPECT_LT(errors.fitted.rms, 0.54e-3);
  EXPECT_LT(errors.held_out.rms, 0.66e-3);
  EXPECT_GT(errors.trivial.first_frame, 20e-3);

  const fs::path other = further_data() / "recordings" / "swing_plain_b";
  if (further_data().empty() || !fs::exists(other))
    GTEST_SKIP() << "CLOTHFIT_DATA names no folder with recordings/swing_plain_b: nothing is "
                    "forecast";
  FitOptions options;
  options.forecast = report.result;
  const FitReport forecast = fit(whole_recording(other), options, {});

  ASSERT_TRUE(forecast.usable()) << forecast.message;
  EXPECT_LT(only_errors(forecast).held_out.rms, 0.62e-3);
  EXPECT_GT(only_errors(forecast).trivial.first_frame, 20e-3);
}

TEST(Recordings, SwingPlainFromOneCamera) {
  FitOptions options = started_beside("swing_plain");
  options.observations = ObservationKind::tracks2d;

  const FitReport report = fit(bundled_recording("swing_plain"), options, {});

  ASSERT_TRUE(report.usable()) << report.message;
  expect_true_fabric(report.result, "swing_plain", 0.1);
  EXPECT_LT(only_errors(report).fitted.rms, 0.34);
  EXPECT_LT(only_errors(report).held_out.rms, 0.5);
}

TEST(Recordings, AWindThatWasNotDeclaredIsFoundWhenAskedFor) {
  // Given the windy recording and the true pressure, 0.25 Pa in a level direction
  const nlohmann::json truth = bundled_truth("swing_breeze").at("hidden_effects").at(0);
  const auto direction = truth.at("direction").get<std::vector<double>>();
  const double pressure = truth.at("pressure_pa");

  FitOptions options = started_beside("swing_breeze");
  options.effects = {"wind"};

  const FitReport report = fit(bundled_recording("swing_breeze"), options, {});

  ASSERT_TRUE(report.usable()) << report.message;
  ASSERT_EQ(report.result.effects.size(), 1u);
  const std::vector<ParameterEstimate>& wind = report.result.effects.front().parameters;
  ASSERT_EQ(wind.size(), 4u);
  EXPECT_LT(wind[0].value, 0.02);  // c: the wind did not depend on the cloth's speed
  for (size_t axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(wind[1 + axis].value, pressure * direction[axis], 0.03 * pressure) << axis;
  // Then the residual is the noise, in frames that took no part too
  EXPECT_LT(only_errors(report).held_out.rms, 1.1 * only_errors(report).noise);
  expect_true_fabric(report.result, "swing_breeze", 0.03);
}

TEST(Recordings, AHiddenWindLeavesAnErrorThatThePlainModelCannotHide) {
  // Given a recording whose cloth is also blown at, undeclared; mesh and search kept small
  const FitReport report = fit(bundled_recording("swing_breeze"),
                               {.mesh_columns = 9,
                                .mesh_rows = 9,
                                .population = 40,
                                .generations = 5,
                                .refine_best = 1,
                                .work = 0.03},
                               {});

  // Then springs alone, whatever their fit, stay far above the noise
  ASSERT_TRUE(report.usable()) << report.message;
  EXPECT_GT(only_errors(report).fitted.rms, 3 * only_errors(report).noise);
  EXPECT_GT(only_errors(report).held_out.rms, 5 * only_errors(report).noise);
}

TEST(Recordings, RealClothOnARobotArmIsFittedWithNumbersWhateverTheyAre) {
  const fs::path folder = further_data() / "real/iri-robot-cloth/s0623_n7_traj8_1";
  if (further_data().empty() || !fs::exists(folder)) {
    GTEST_SKIP() << "CLOTHFIT_DATA names no folder with real/iri-robot-cloth";
  }
  FitInput input = whole_recording(folder);
  // Four seconds will do.
  input.recording.held_out_from_frame = 25;
  std::erase_if(input.tracks3d, [](const Position3d& at) { return at.frame >= 40; });

  const FitReport report = fit(input,
                               {.effects = {"viscous_damping"},
                                .mesh_columns = 5,
                                .mesh_rows = 5,
                                .population = 20,
                                .generations = 5,
                                .refine_best = 1,
                                .work = 0.005},
                               {});

  // Then the fit ends, everything is finite, and the markers that drive the cloth are not judged
  ASSERT_TRUE(report.usable()) << report.message;
  const ObservationErrors& errors = only_errors(report);
  EXPECT_TRUE(std::isfinite(errors.held_out.rms));
  EXPECT_GT(errors.held_out.rms, errors.noise);
  EXPECT_LT(errors.held_out.rms, errors.trivial.first_frame);
  EXPECT_GT(report.result.observations_rejected.at("drives_a_held_point"), 0);
  EXPECT_EQ(report.result.parameters.at(0).name, "areal_density");
  EXPECT_EQ(report.result.parameters.at(0).state, ParameterState::undetermined);
}

}  // namespace
}  // namespace clothfit
