// Checks a report's statements of a proposed law and of the residual force. Not checked here: how
// they are found (tests/fit/diagnosis/proposed_law_test.cpp, residual_force_test.cpp).
#include "apps/report/diagnosis/diagnosis_law.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace clothfit {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Diagnosis with_law() {
  Diagnosis diagnosis;
  diagnosis.law.coefficients = {{.effect = "force_law",
                                 .parameter = "drag_squared",
                                 .unit = "1/m",
                                 .term = "-|v| v",
                                 .value = 1.234,
                                 .sigma = 0.021},
                                {.effect = "tension_law",
                                 .parameter = "warp_stretched",
                                 .unit = "1",
                                 .term = "e_warp^2 (e > 0)",
                                 .value = 40,
                                 .sigma = 3,
                                 .at_bound = true}};
  diagnosis.law.formula = "a = -1.234 1/m |v| v\nT / (k l0) = 40.0 e_warp^2 (e > 0)";
  diagnosis.law.before.mean = 9;
  diagnosis.law.after.mean = 1.1;
  const auto errors = [](double held_out) {
    return ObservationErrors{.kind = "tracks3d",
                             .unit = "m",
                             .held_out = {.rms = held_out, .count = 100},
                             .noise = 5e-4};
  };
  diagnosis.recordings.resize(1);
  diagnosis.recordings.front().after.result.errors = {errors(4e-3)};
  diagnosis.recordings.front().with_law.result.errors = {errors(1e-3)};
  return diagnosis;
}

TEST(DiagnosisLaw, StandsOnThePageAsAFormulaWithItsErrorsAndTheLineThatDeclaresIt) {
  const std::string html = proposed_law_html(with_law());

  EXPECT_THAT(html, HasSubstr("a = -1.234 1/m |v| v"));
  EXPECT_THAT(html, HasSubstr("e_warp^2 (e &gt; 0)"));
  EXPECT_THAT(html, HasSubstr("at the end of its range"));
  EXPECT_THAT(html, HasSubstr("4.00"));  // mm
  EXPECT_THAT(html, HasSubstr("effect: force_law"));
}

TEST(DiagnosisLaw, IsDeclaredWithAllItsOtherTermsAtZero) {
  const std::string text = declaration_text(with_law().law);

  EXPECT_THAT(text, HasSubstr("  - {effect: force_law, parameters: {drag: 0, normal_drag: 0"));
  EXPECT_THAT(text, Not(HasSubstr("drag_squared: 0, normal_drag: 0")));
  EXPECT_THAT(text, HasSubstr("normal_drag_squared: 0"));
  EXPECT_THAT(text, HasSubstr("  - {effect: tension_law, parameters: {weft_stretched: 0"));
}

TEST(DiagnosisLaw, StandsInTheJsonALineOfTheFormulaEach) {
  const nlohmann::ordered_json json = proposed_law_json(with_law());

  EXPECT_EQ(json["formula"].size(), 2u);
  EXPECT_EQ(json["formula"][1], "T / (k l0) = 40.0 e_warp^2 (e > 0)");
  EXPECT_EQ(json["coefficients"][0]["parameter"], "drag_squared");
  EXPECT_EQ(json["coefficients"][1]["at_bound"], true);
  EXPECT_EQ(json["held_out"][0]["before"], 4e-3);
  EXPECT_EQ(json["held_out"][0]["after"], 1e-3);
}

TEST(DiagnosisLaw, IsNullAndSilentWhereThereIsNone) {
  EXPECT_TRUE(proposed_law_json({}).is_null());
  EXPECT_EQ(proposed_law_html({}), "");
  EXPECT_EQ(declaration_text({}), "");
  EXPECT_TRUE(residual_force_json({}).is_null());
}

TEST(ResidualForceReport, ListsMarkersAndPutsWhatItGoesWithBestFirst) {
  Recording recording;
  recording.cloth = {.width_m = 0.4, .height_m = 0.4};
  recording.markers.markers = {{.name = "m0"}, {.name = "m1", .s_m = 0.1, .t_m = 0.2}};
  ResidualForce force;
  force.markers = {{.marker = 1, .mean_m_per_s2 = {1, 2, 2}, .rms_m_per_s2 = {2, 3, 6}}};
  force.regressions = {
      {.on = "time", .unit = "m/s3", .correlation = 0.2, .slope = 1, .sigma = 0.5},
      {.on = "velocity", .unit = "1/s", .correlation = -0.9, .slope = -1.5, .sigma = 0.1}};

  EXPECT_EQ(residual_force_table(force, recording).rows.front(),
            (std::vector<std::string>{"m1", "0.1", "0.2", "1", "2", "2", "2", "3", "6"}));
  EXPECT_EQ(regression_table(force).rows.front().front(), "velocity");
  EXPECT_THAT(residual_force_map_svg(force, recording), HasSubstr("m1: 3.00 m/s²"));
  EXPECT_THAT(residual_force_map_svg(force, recording), HasSubstr("m1: 7.00 m/s²"));
  EXPECT_THAT(residual_force_html({.why_none = "pixels"}, recording), HasSubstr("pixels"));
}

}  // namespace
}  // namespace clothfit
