// Checks whole diagnoses of simulated recordings whose truth is known. Rates over many are a study
// (clothfit recover --undeclared), bundled recordings are tests/fit/recordings_test.cpp.
#include "fit/diagnosis/diagnose.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "data/input_error.h"
#include "fit/jobs/draws.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

/// A cloth that is diagnosed soon, with drag that its recording does not declare.
const SyntheticCloth kSmallWithDrag{
    .drag_rate_per_s = 1.2, .mesh = 5, .markers = 4, .frames = 30, .held_out_from = 24};

/// Returns every effect of the catalogue but those that compete for what these tests hide.
std::vector<std::string> without_all_but_competitors() {
  const std::vector<std::string> tested{"viscous_damping", "quadratic_drag", "wind",
                                        "gravity_tilt",    "scale",          "marker_placement"};
  std::vector<std::string> without;
  for (const ShapeCandidates& mode : hypotheses_to_test(synthetic_input(kSmallWithDrag), {}, 0.5))
    if (std::ranges::find(tested, mode.front().effect) == tested.end())
      without.push_back(mode.front().effect);
  return without;
}

/// Returns a short diagnosis on that cloth's mesh, which tests the drag and what competes with it.
DiagnoseOptions diagnosis_of_small_cloth() {
  DiagnoseOptions options;
  options.fit.mesh_columns = options.fit.mesh_rows = 5;
  options.fit.generations = 5;
  options.fit.population = 30;
  options.fit.refine_best = 1;
  options.fit.work = 0.01;
  options.without = without_all_but_competitors();
  options.beam_width = 1;
  options.refits = 3;
  options.separate = false;  // tests/fit/diagnosis/separation_test.cpp
  return options;
}

TEST(Diagnose, NamesAHiddenDragAndItsAmplitude) {
  DiagnoseOptions options = diagnosis_of_small_cloth();
  options.without.clear();  // the whole catalogue competes
  const Diagnosis diagnosis = diagnose(synthetic_input(kSmallWithDrag), options, {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  ASSERT_EQ(diagnosis.accepted.size(), 1u);
  EXPECT_EQ(diagnosis.accepted.front().trial.hypothesis.effect, "viscous_damping");
  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::explained);
  EXPECT_FALSE(diagnosis.seen_elsewhere);
  EXPECT_FALSE(diagnosis.before.adequate);
  ASSERT_EQ(diagnosis.found().result.effects.size(), 1u);
  const ParameterEstimate& rate = diagnosis.found().result.effects.front().parameters.front();
  EXPECT_NEAR(rate.value, 1.2, 4 * rate.sigma);
  const ObservationErrors& before = diagnosis.base().result.errors.front();
  const ObservationErrors& after = diagnosis.found().result.errors.front();
  EXPECT_GT(before.held_out.rms, 2 * before.noise);
  EXPECT_LT(after.held_out.rms, 1.1 * after.noise);
}

TEST(Diagnose, FindsNothingWhereNothingIsHiddenAndSaysWhatItWouldHaveSeen) {
  SyntheticCloth cloth = kSmallWithDrag;
  cloth.drag_rate_per_s = 0;
  DiagnoseOptions options = diagnosis_of_small_cloth();
  options.without.clear();
  const Diagnosis diagnosis = diagnose(synthetic_input(cloth), options, {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  EXPECT_FALSE(diagnosis.changed());
  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::adequate);
  EXPECT_GT(diagnosis.limits.size(), 20u);
  for (const DetectionLimit& limit : diagnosis.limits)
    if (limit.hypothesis.effect == "viscous_damping") {
      EXPECT_GT(limit.limit[0], 0);
      EXPECT_LT(limit.limit[0], 0.5);  // 1/s: the drag of the other test is far above it
    }
}

TEST(Diagnose, SaysThatMarkersAreSeenElsewhereWhereNoHypothesisPutsThemThere) {
  constexpr double kOff_m = 4e-3;  // a standard deviation, of each coordinate of each marker
  SyntheticCloth cloth = kSmallWithDrag;
  cloth.drag_rate_per_s = 0;
  cloth.seen = [](const SyntheticMotion& motion, double time_s, const Eigen::Vector2d& place_m) {
    Eigen::Vector3d where = motion(time_s, place_m);
    Draws draws(5, static_cast<int>(std::lround(1e4 * place_m[0])),
                static_cast<int>(std::lround(1e4 * place_m[1])));
    for (double& coordinate : where) coordinate += kOff_m * draws.normal();
    return where;
  };
  const Diagnosis diagnosis = diagnose(synthetic_input(cloth), diagnosis_of_small_cloth(), {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  ASSERT_TRUE(diagnosis.seen_elsewhere);
  // The rms of 16 markers' 48 numbers scatters by 10 %, and the fit follows a little of it.
  EXPECT_NEAR(diagnosis.seen_elsewhere->rms_m, kOff_m, 0.2 * kOff_m);
  EXPECT_TRUE(diagnosis.accepted.empty());
  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::explained);
  const ObservationErrors& before = diagnosis.base().result.errors.front();
  const ObservationErrors& after = diagnosis.found().result.errors.front();
  EXPECT_GT(before.held_out.rms, 4 * before.noise);
  EXPECT_LT(after.held_out.rms, 1.1 * after.noise);
}

constexpr double kTurn_rad = 0.06, kTooLarge = 0.02;

/// A cloth so soft that its time steps are long.
const Fabric kSoftFabric{.tension_warp_n_per_m = 10,
                         .tension_weft_n_per_m = 12,
                         .shear_n_per_m = 4.5,
                         .flexion_warp_n_per_m = 2.2,
                         .flexion_weft_n_per_m = 1.8,
                         .damping_warp_s = 2.5e-3,
                         .damping_weft_s = 2e-3};

/// Makes a pattern that is turned on the cloth, in a world that is measured too large. Constants of
/// the markers do most of either.
FitInput with_two_causes() {
  SyntheticCloth cloth{.fabric = kSoftFabric,
                       .mesh = 5,
                       .markers = 4,
                       .marker_margin_m = 0.03,
                       .frames = 30,
                       .held_out_from = 24,
                       .scale = 1 + kTooLarge};
  cloth.seen = [](const SyntheticMotion& motion, double time_s, const Eigen::Vector2d& place_m) {
    const Eigen::Vector2d middle_m(0.2, 0.2);
    return motion(time_s, middle_m + Eigen::Rotation2Dd(kTurn_rad) * (place_m - middle_m));
  };
  return synthetic_input(cloth);
}

DiagnoseOptions diagnosis_of_two_causes() {
  DiagnoseOptions options = diagnosis_of_small_cloth();
  options.refits = 2;
  return options;
}

TEST(Diagnose, NamesCausesThatConstantsMatchOneByOneButNotTogether) {
  DiagnoseOptions options = diagnosis_of_two_causes();
  options.most_effects = 2;
  const Diagnosis diagnosis = diagnose(with_two_causes(), options, {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  ASSERT_EQ(diagnosis.accepted.size(), 2u);
  const Trial& first = diagnosis.accepted[0].trial;
  const Trial& second = diagnosis.accepted[1].trial;
  EXPECT_EQ(first.hypothesis.effect, "scale");
  EXPECT_EQ(second.hypothesis.title(), "marker_placement (turn)");
  EXPECT_GT(first.cross_validated, first.best_trivial);
  EXPECT_TRUE(first.on_credit);
  EXPECT_LT(second.cross_validated, first.best_trivial);
  EXPECT_FALSE(second.on_credit);
  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::explained);
  EXPECT_FALSE(diagnosis.seen_elsewhere);
  const std::map<std::string, double>& found = diagnosis.found().values;
  EXPECT_NEAR(found.at("scale.factor"), 1 + kTooLarge, 2e-3);
  EXPECT_NEAR(std::abs(found.at("marker_placement.turn")), kTurn_rad, 1e-3);
}

TEST(Diagnose, GivesUpACauseThatConstantsMatchWhereNoOtherMayBeNamedWithIt) {
  DiagnoseOptions options = diagnosis_of_two_causes();
  options.most_effects = 1;
  const Diagnosis diagnosis = diagnose(with_two_causes(), options, {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  EXPECT_TRUE(diagnosis.seen_elsewhere);
  for (const AcceptedEffect& accepted : diagnosis.accepted)
    EXPECT_NE(accepted.trial.hypothesis.effect, "scale");
}

TEST(Diagnose, FitsTwoRecordingsTogetherAndJudgesAThird) {
  const SyntheticCloth cloth = kSmallWithDrag;
  std::vector<FitInput> fitted;
  for (const unsigned seed : {1U, 2U}) {
    SyntheticCloth own = cloth;
    own.seed = seed;
    fitted.push_back(synthetic_input(own));
  }
  SyntheticCloth other = cloth;
  other.seed = 3;
  FitInput unseen = synthetic_input(other);
  for (Position3d& row : unseen.tracks3d) row.sigma_m = 0;  // a file that does not state it
  DiagnoseOptions options = diagnosis_of_small_cloth();
  options.refits = 2;
  const Diagnosis diagnosis = diagnose(fitted, {&unseen, 1}, options, {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  ASSERT_EQ(diagnosis.accepted.size(), 1u);
  EXPECT_EQ(diagnosis.accepted.front().trial.hypothesis.effect, "viscous_damping");
  ASSERT_EQ(diagnosis.recordings.size(), 3u);
  EXPECT_TRUE(diagnosis.recordings.back().held_out);
  const auto rate = [&](size_t n) {
    return diagnosis.recordings[n].after.result.effects.front().parameters.front();
  };
  EXPECT_EQ(rate(0).value, rate(1).value);
  EXPECT_EQ(rate(0).value, rate(2).value);
  EXPECT_NEAR(rate(0).value, 1.2, 4 * rate(0).sigma);
  for (const DiagnosedRecording& recording : diagnosis.recordings) {
    const ObservationErrors& before = recording.before.result.errors.front();
    const ObservationErrors& after = recording.after.result.errors.front();
    EXPECT_GT(before.held_out.rms, 2 * before.noise) << recording.before.result.recording;
    EXPECT_LT(after.held_out.rms, 1.1 * after.noise) << recording.before.result.recording;
    // Noise is stated, or is as all of the recording's frames tell, though none of the third is
    // fitted.
    EXPECT_NEAR(after.noise, cloth.noise_m, 0.1 * cloth.noise_m);
  }
}

/// Leaves the drag: it is not to be tested, and no cause is to be named.
DiagnoseOptions diagnosis_without_a_cause() {
  DiagnoseOptions options = diagnosis_of_small_cloth();
  options.without.push_back("viscous_damping");
  options.most_effects = 0;
  return options;
}

TEST(Diagnose, TestsNoEffectThatItIsToldToLeaveOutAndProposesALawForIt) {
  DiagnoseOptions options = diagnosis_without_a_cause();
  options.law_terms = 1;
  const Diagnosis diagnosis = diagnose(synthetic_input(kSmallWithDrag), options, {});

  EXPECT_FALSE(diagnosis.scores.empty());
  for (const Score& score : diagnosis.scores) EXPECT_NE(score.hypothesis.effect, "viscous_damping");
  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::unexplained);
  EXPECT_TRUE(diagnosis.law.found());
}

TEST(Diagnose, ProposesNoLawWhereItIsToldNotTo) {
  DiagnoseOptions options = diagnosis_without_a_cause();
  options.law_terms = 0;
  SyntheticCloth cloth = kSmallWithDrag;
  cloth.frames = 20;
  cloth.held_out_from = 16;
  const Diagnosis diagnosis = diagnose(synthetic_input(cloth), options, {});

  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::unexplained);
  EXPECT_TRUE(diagnosis.law.trials.empty());
  EXPECT_FALSE(diagnosis.law.found());
}

TEST(Diagnose, EndsSoonWhenItIsToldTo) {
  int calls = 0;
  const Diagnosis diagnosis = diagnose(synthetic_input({}), diagnosis_of_small_cloth(),
                                       [&](const Progress&) { return ++calls < 5; });
  EXPECT_EQ(diagnosis.stop, FitStop::cancelled);
}

TEST(Diagnose, ReportsWhatItHasWhereItsTimeIsUp) {
  DiagnoseOptions options = diagnosis_of_small_cloth();
  options.is_enough = [] { return true; };
  const Diagnosis diagnosis = diagnose(synthetic_input(kSmallWithDrag), options, {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  EXPECT_FALSE(diagnosis.complete);
  EXPECT_TRUE(diagnosis.accepted.empty());
  EXPECT_TRUE(diagnosis.limits.empty());
  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::unexplained);
  EXPECT_GT(diagnosis.base().result.observations_used, 0);
  ASSERT_FALSE(diagnosis.phases.empty());
  EXPECT_EQ(diagnosis.phases.front().name, "base fit");

  options.is_enough = {};
  options.budget_s = 1e-3;
  SyntheticCloth fitted_soon = kSmallWithDrag;
  fitted_soon.drag_rate_per_s = 0;
  EXPECT_FALSE(diagnose(synthetic_input(fitted_soon), options, {}).complete);
}

TEST(Diagnose, RefusesRecordingsOfTwoCloths) {
  std::vector<FitInput> inputs{synthetic_input({}), synthetic_input({})};
  inputs[1].recording.cloth.width_m *= 1.1;
  EXPECT_THROW(diagnose(inputs, {}, diagnosis_of_small_cloth(), {}), InputError);
  EXPECT_THROW(diagnose({&inputs[0], 1}, {&inputs[1], 1}, diagnosis_of_small_cloth(), {}),
               InputError);
  EXPECT_THROW(diagnose({}, {&inputs[1], 1}, diagnosis_of_small_cloth(), {}), InputError);
}

TEST(Diagnose, RefusesOptionsThatMakeNoSense) {
  DiagnoseOptions options = diagnosis_of_small_cloth();
  options.beam_width = 0;
  EXPECT_THROW(diagnose(synthetic_input({}), options, {}), InputError);
  options = diagnosis_of_small_cloth();
  options.law_terms = 11;
  EXPECT_THROW(diagnose(synthetic_input({}), options, {}), InputError);
  options = diagnosis_of_small_cloth();
  options.without = {"aether"};
  EXPECT_THROW(diagnose(synthetic_input({}), options, {}), InputError);
}

}  // namespace
}  // namespace clothfit
