// Checks how a diagnosis is judged by the truth, without running one. Not checked here: what a
// diagnosis finds (tests/fit/diagnosis), and the study around it (foreign_study_test.cpp).

#include "apps/study/foreign/judgement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "data/input_error.h"

namespace clothfit {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

/// Writes a truth.json that hides these effects, a list of JSON objects.
std::string truth_text(const std::string& hidden, const std::string& hinge_bending = "0.0") {
  return R"({"hidden_effects": [)" + hidden + R"(], "cloth": {"air_drag": 0.0},
             "springs": {"law": "linear", "types_2_3": {"k": 20.0, "c": 0.05},
                         "hinge_bending": )" +
         hinge_bending + R"(},
             "step_size_floor": {"mm": {"rms": 0.3, "rms_last_30_percent": 0.45, "max": 3.6},
                                 "px": {"rms": 0.1, "rms_last_30_percent": 0.25, "max": 2.4}}})";
}

ForeignTruth truth_of(const std::string& hidden) {
  return parse_foreign_truth(truth_text(hidden), "truth.json");
}

NamedEffect named(const std::string& effect, std::vector<std::string> alike = {}) {
  return {.effect = effect, .title = effect, .alike = std::move(alike)};
}

Judgement judged(const ForeignTruth& truth, const std::vector<NamedEffect>& effects,
                 DiagnosisVerdict verdict = DiagnosisVerdict::explained) {
  return judge(truth, verdict, effects);
}

const std::string kWind = R"({"effect": "wind", "pressure_pa": 0.25})";
const std::string kHem = R"({"effect": "heavy_hem", "added_mass_kg": 0.006})";

TEST(ForeignTruth, IsReadForEveryKindOfHiddenEffect) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> kinds{
      {R"({"effect": "air_drag", "c_per_s": 1.5})", {"viscous_damping"}},
      {R"({"effect": "contact", "body": "sphere", "radius": 0.06})", {"contact_sphere"}},
      {R"({"effect": "gravity_tilted", "degrees": 2.5})", {"gravity_tilt", "world_tilt"}},
      {R"({"effect": "gust"})", {"gust", "wind_pulse"}},
      {kHem, {"nonuniform_mass"}},
      {R"({"effect": "held_corner_moves", "corner": [0.0, 0.0]})",
       {"support_drift", "support_motion", "support_offset", "support_slip"}},
      {R"({"effect": "stiff_patch", "factor": 3.0})", {"nonuniform_stiffness"}},
      {kWind, {"wind"}},
  };
  for (const auto& [text, answers] : kinds) {
    const ForeignTruth truth = truth_of(text);
    ASSERT_EQ(truth.hidden.size(), 1u) << text;
    EXPECT_EQ(truth.kind(), TruthKind::hidden_effects);
    for (const std::string& effect : answers)
      EXPECT_TRUE(truth.hidden.front().is_answered_by(effect)) << text << effect;
    EXPECT_FALSE(truth.hidden.front().is_answered_by("stiffening")) << text;
  }
  EXPECT_FALSE(truth_of(kWind).hidden.front().is_answered_by("wind_pulse"));
  EXPECT_EQ(truth_of(kinds[2].first).hidden.front().title(), "gravity_tilt or world_tilt");
}

TEST(ForeignTruth, IsReadWithItsFloorOverTheLastFrames) {
  const ForeignTruth truth = truth_of("");

  EXPECT_DOUBLE_EQ(truth.floor_m, 0.45e-3);
  EXPECT_DOUBLE_EQ(truth.floor_px, 0.25);

  const ForeignTruth without =
      parse_foreign_truth(R"({"hidden_effects": [], "springs": {}})", "truth.json");
  EXPECT_TRUE(std::isnan(without.floor_m));
  EXPECT_TRUE(std::isnan(without.floor_px));
}

TEST(ForeignTruth, KnowsAForeignLawByItsSprings) {
  const auto kind_with = [](const std::string& springs) {
    return parse_foreign_truth(R"({"hidden_effects": [], "springs": )" + springs + "}", "here")
        .kind();
  };

  EXPECT_EQ(truth_of("").kind(), TruthKind::nothing_hidden);
  EXPECT_EQ(kind_with(R"({"types_2_3_tension_only": {"k": 15.0}, "hinge_bending": 0.0})"),
            TruthKind::foreign_law);
  EXPECT_EQ(kind_with(R"({"hinge_bending": {"k": 0.00015}})"), TruthKind::foreign_law);
  EXPECT_EQ(kind_with(R"({"hinge_bending": null})"), TruthKind::nothing_hidden);
}

TEST(ForeignTruth, RefusesWhatItDoesNotKnow) {
  EXPECT_THAT([] { truth_of(R"({"effect": "ghost"})"); },
              ThrowsMessage<InputError>(HasSubstr("truth.json: hides 'ghost'")));
  EXPECT_THAT([] { truth_of(R"({"effect": "contact", "body": "plane"})"); },
              ThrowsMessage<InputError>(HasSubstr("contact/plane")));
  for (const char* text : {"", "[", "[]", "{}", R"({"hidden_effects": [1], "springs": {}})",
                           R"({"hidden_effects": [{"effect": 1}], "springs": {}})"})
    EXPECT_THAT([&] { parse_foreign_truth(text, "truth.json"); },
                ThrowsMessage<InputError>(HasSubstr("is no truth of a recording")))
        << text;
}

TEST(Judgement, IsRightWhereEachHiddenEffectIsNamed) {
  const ForeignTruth both = truth_of(kWind + "," + kHem);

  EXPECT_TRUE(judged(truth_of(kWind), {named("wind")}).right());
  EXPECT_TRUE(judged(both, {named("nonuniform_mass"), named("wind")}).right());
  const Judgement one = judged(both, {named("wind")});
  EXPECT_FALSE(one.right());
  EXPECT_THAT(one.missed, ElementsAre("nonuniform_mass"));
  EXPECT_THAT(one.not_there, IsEmpty());
  EXPECT_THAT(judged(both, {}).missed, ElementsAre("wind", "nonuniform_mass"));
}

TEST(Judgement, CountsTheClassOfAnAcceptedEffect) {
  const ForeignTruth wind = truth_of(kWind);

  EXPECT_TRUE(judged(wind, {named("gravity_tilt", {"frame_acceleration", "wind"})}).right());
  const Judgement other = judged(wind, {named("gravity_tilt", {"world_tilt"})});
  EXPECT_THAT(other.missed, ElementsAre("wind"));
  EXPECT_THAT(other.not_there, ElementsAre("gravity_tilt"));
}

TEST(Judgement, IsWrongWhereAnEffectIsLeftOver) {
  const Judgement judgement =
      judged(truth_of(kWind), {named("wind"), named("viscous_damping", {"quadratic_drag"})});

  EXPECT_FALSE(judgement.right());
  EXPECT_THAT(judgement.missed, IsEmpty());
  EXPECT_THAT(judgement.not_there, ElementsAre("viscous_damping"));
}

TEST(Judgement, LetsSeveralModesAnswerToOneHiddenEffect) {
  const ForeignTruth corner = truth_of(R"({"effect": "held_corner_moves"})");

  EXPECT_TRUE(judged(corner, {named("support_motion"), named("support_offset")}).right());
}

TEST(Judgement, DoesNotAskForTheVerdictWhereEffectsAreHidden) {
  for (const DiagnosisVerdict verdict :
       {DiagnosisVerdict::explained, DiagnosisVerdict::partly_explained})
    EXPECT_TRUE(judged(truth_of(kWind), {named("wind")}, verdict).right());
}

TEST(Judgement, AsksForAnAdequateModelWhereNothingIsHidden) {
  const ForeignTruth nothing = truth_of("");

  EXPECT_TRUE(judged(nothing, {}, DiagnosisVerdict::adequate).right());
  EXPECT_TRUE(judged(nothing, {}, DiagnosisVerdict::unexplained).wrong_verdict);
  EXPECT_THAT(judged(nothing, {named("wind")}).not_there, ElementsAre("wind"));
}

TEST(Judgement, AcceptsOnlyEffectsOfTheClothWhereItFollowsAForeignLaw) {
  const ForeignTruth other = parse_foreign_truth(truth_text("", R"({"k": 0.001})"), "truth.json");

  EXPECT_TRUE(judged(other, {}, DiagnosisVerdict::unexplained).right());
  EXPECT_TRUE(judged(other, {}, DiagnosisVerdict::adequate).wrong_verdict);
  for (const char* effect :
       {"anisotropy", "bending_energy", "stiffening", "nonuniform_stiffness", "nonuniform_mass",
        "hysteresis", "relaxation", "rest_curvature", "natural_size", "spring_damping"})
    EXPECT_TRUE(judged(other, {named(effect)}).right()) << effect;
  for (const char* effect :
       {"wind", "gust", "gravity_tilt", "gravity_scale", "world_tilt", "frame_acceleration",
        "clock_offset", "camera_drift", "support_slip", "contact_sphere", "viscous_damping",
        "quadratic_drag", "added_air_mass", "lens_distortion", "focal_error", "scale",
        "marker_placement"})
    EXPECT_THAT(judged(other, {named(effect)}).not_there, ElementsAre(effect));
}

}  // namespace
}  // namespace clothfit
