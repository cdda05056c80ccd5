// Diagnoses whole recordings that another simulator made, and compares with what was simulated. Two
// hide an effect that they do not declare, one hides none.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <vector>

#include "fit/diagnosis/diagnose.h"
#include "tests/data/whole_runs.h"
#include "tests/fit/whole_recording.h"

namespace clothfit {
namespace {

double found_value(const FitResult& result, const std::string& effect, const std::string& name) {
  for (const EffectEstimate& of : result.effects)
    for (const ParameterEstimate& parameter : of.parameters)
      if (of.name == effect && parameter.name == name) return parameter.value;
  ADD_FAILURE() << "the model has no " << effect << "." << name;
  return 0;
}

/// Returns the mass that nonuniform_mass (hem) adds to the bottom edge of a cloth with equal
/// vertices. It is the share of a vertex's mass that lies in the hem, times the factor
/// (docs/effects).
double added_mass_kg(const FitResult& result, double mass_kg, double height_m) {
  const double factor = found_value(result, "nonuniform_mass", "hem_bottom");
  const double spacing_m = height_m / (result.mesh_rows - 1);
  const double width = found_value(result, "nonuniform_mass", "hem_width") / spacing_m;
  EXPECT_LT(width, 1) << "the hem reaches beyond one cell";
  const double last_row = 2 * width - width * width, row_above = width * width / 2;
  return mass_kg / result.mesh_rows * factor * (last_row + row_above);
}

/// Expects the residuals of frames that took no part to be the noise.
void expect_only_noise(const FitReport& report) {
  ASSERT_EQ(report.result.errors.size(), 1u);
  const ObservationErrors& errors = report.result.errors.front();
  EXPECT_LT(errors.held_out.rms, 1.1 * errors.noise);
}

TEST(DiagnosedRecordings, SwingPlainLacksNothing) {
  // The first half of the swing will do. docs/tour.md asks the same of all of it.
  FitInput input = bundled_recording("swing_plain");
  input.recording.held_out_from_frame = 30;
  std::erase_if(input.tracks3d, [](const Position3d& at) { return at.frame >= 42; });

  const Diagnosis diagnosis = diagnose(input, {}, {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::adequate);
  EXPECT_TRUE(diagnosis.accepted.empty());
  EXPECT_GT(diagnosis.limits.size(), 20u);
}

TEST(DiagnosedRecordings, SwingBreezeLacksItsWind) {
  CLOTHFIT_ONLY_IN_WHOLE_RUNS();
  const nlohmann::json hidden = bundled_truth("swing_breeze").at("hidden_effects").at(0);
  const auto direction = hidden.at("direction").get<std::vector<double>>();
  const Eigen::Vector3d truth =
      hidden.at("pressure_pa").get<double>() * Eigen::Map<const Eigen::Vector3d>(direction.data());

  const Diagnosis diagnosis = diagnose(bundled_recording("swing_breeze"), {}, {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::explained);
  ASSERT_EQ(diagnosis.accepted.size(), 1u);
  EXPECT_EQ(diagnosis.accepted.front().trial.hypothesis.effect, "wind");
  const FitResult& result = diagnosis.found().result;
  const Eigen::Vector3d wind(found_value(result, "wind", "q_x"), found_value(result, "wind", "q_y"),
                             found_value(result, "wind", "q_z"));
  EXPECT_LT((wind - truth).norm(), 0.05 * truth.norm());
  expect_only_noise(diagnosis.found());
}

TEST(DiagnosedRecordings, SwingHemLacksTheMassOfItsHem) {
  CLOTHFIT_ONLY_IN_WHOLE_RUNS();
  const double truth_kg = bundled_truth("swing_hem").at("hidden_effects").at(0).at("added_mass_kg");

  const Diagnosis diagnosis = diagnose(bundled_recording("swing_hem"), {}, {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  ASSERT_FALSE(diagnosis.accepted.empty());
  EXPECT_EQ(diagnosis.accepted.front().trial.hypothesis.effect, "nonuniform_mass");
  const FitResult& result = diagnosis.found().result;
  EXPECT_NEAR(added_mass_kg(result, 0.0347, 0.4), truth_kg, 0.1 * truth_kg);
  const ObservationErrors& errors = result.errors.front();
  // The error without it is 21 times the noise. In truth the mass hangs beside the edge, not on it.
  EXPECT_LT(errors.held_out.rms, 1.6 * errors.noise);
}

}  // namespace
}  // namespace clothfit
