// Checks that a diagnosis' report and diagnosis.json tell what was found in quantities of people,
// and that the report shows the parameters of the model found. Not checked here: the terminal's
// text (diagnosis_tables_test.cpp), what effects say (tests/model/effects/effect_words_test.cpp).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "apps/report/diagnosis/diagnosis_json.h"
#include "apps/report/diagnosis/diagnosis_page.h"
#include "tests/apps/sample_fit.h"
#include "tests/apps/scratch_folder.h"

namespace clothfit {
namespace {

using testing::HasSubstr;

/// Returns a diagnosis of a made-up recording, in which a drag with words and a damping without
/// any were accepted.
Diagnosis with_two_effects(const test::SampleFit& sample) {
  Diagnosis diagnosis;
  diagnosis.verdict = DiagnosisVerdict::explained;
  diagnosis.recordings.resize(1);
  diagnosis.recordings.front().before = diagnosis.recordings.front().after = sample.report;
  FitReport& found = diagnosis.recordings.front().after;
  found.model.cloth = sample.recording.cloth;
  found.model.mesh_columns = found.model.mesh_rows = 9;
  found.result.effects = {
      {"viscous_damping", {{.name = "rate", .unit = "1/s", .value = 1.5, .sigma = 0.02}}},
      {"spring_damping", {{.name = "shear", .unit = "s", .value = 1e-3, .sigma = 1e-4}}}};
  diagnosis.accepted.resize(2);
  diagnosis.accepted[0].trial.hypothesis = {.effect = "viscous_damping", .amplitudes = {"rate"}};
  diagnosis.accepted[1].trial.hypothesis = {.effect = "spring_damping", .amplitudes = {"shear"}};
  return diagnosis;
}

TEST(DiagnosisWords, StandInTheReportAboveTheValuesAndBesideTheParameters) {
  const test::SampleFit sample = test::sample_fit(3);

  const std::string html =
      diagnosis_page_html(with_two_effects(sample), {&sample.recording, 1}, "clothfit diagnose it");

  EXPECT_THAT(html, HasSubstr("<strong>half of a speed is gone after 0.462 s</strong>"));
  EXPECT_THAT(html, HasSubstr("<p>rate = 1.500 ± 0.020 1/s.</p>"));
  EXPECT_THAT(html, HasSubstr("<strong>shear = 0.00100 ± 0.00010 s</strong>"));
  EXPECT_THAT(html, HasSubstr("<h2>Parameters</h2>"));
  EXPECT_THAT(html, HasSubstr("tension_warp"));
  EXPECT_THAT(html, HasSubstr("undetermined: sigma exceeds the value, p &lt; 1"));
}

TEST(DiagnosisWords, StandInTheJsonOfEffectsThatHaveThem) {
  const test::ScratchFolder folder("diagnosis_words");
  const std::filesystem::path file = folder.path() / "diagnosis.json";

  write_diagnosis(with_two_effects(test::sample_fit(3)), "clothfit diagnose it", file);

  std::ifstream stream(file);
  const nlohmann::json accepted = nlohmann::json::parse(stream).at("accepted");
  EXPECT_EQ(accepted.at(0).at("in_words"), "half of a speed is gone after 0.462 s");
  EXPECT_FALSE(accepted.at(1).contains("in_words"));
}

}  // namespace
}  // namespace clothfit
