// Whole diagnoses of simulated recordings whose truth is known. Rates over many are a study
// (clothfit recover --undeclared), bundled recordings are tests/fit/recordings_test.cpp.
#include "fit/diagnosis/diagnose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "data/input_error.h"
#include "fit/jobs/draws.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

/// A cloth that is diagnosed soon, with drag that its recording does not declare.
const SyntheticCloth kSmallWithDrag{
    .drag_rate_per_s = 1.2, .mesh = 7, .markers = 5, .frames = 30, .held_out_from = 22};

DiagnoseOptions quick() {
  DiagnoseOptions options;
  options.fit.mesh_columns = options.fit.mesh_rows = 7;
  options.fit.generations = 10;
  options.fit.population = 40;
  options.fit.refine_best = 1;
  options.lines = 1;
  options.refits = 3;
  options.separate = false;  // tests/fit/diagnosis/separation_test.cpp
  return options;
}

TEST(Diagnose, NamesAHiddenDragAndItsAmount) {
  const Diagnosis diagnosis = diagnose(synthetic_input(kSmallWithDrag), quick(), {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  ASSERT_EQ(diagnosis.accepted.size(), 1u);
  EXPECT_EQ(diagnosis.accepted.front().trial.term.effect, "viscous_damping");
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
  const Diagnosis diagnosis = diagnose(synthetic_input(cloth), quick(), {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  EXPECT_FALSE(diagnosis.changed());
  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::adequate);
  ASSERT_FALSE(diagnosis.limits.empty());
  for (const DetectionLimit& limit : diagnosis.limits)
    if (limit.term.effect == "viscous_damping") {
      EXPECT_GT(limit.limit[0], 0);
      EXPECT_LT(limit.limit[0], 0.5);  // 1/s: the drag of the other test is far above it
    }
}

TEST(Diagnose, SaysThatMarkersAreSeenElsewhereWhereNoLawPutsThemThere) {
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
  const Diagnosis diagnosis = diagnose(synthetic_input(cloth), quick(), {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  ASSERT_TRUE(diagnosis.seen_elsewhere);
  // Of 49 markers' 147 numbers, less what the fit could follow.
  EXPECT_NEAR(diagnosis.seen_elsewhere->rms_m, kOff_m, 0.2 * kOff_m);
  EXPECT_TRUE(diagnosis.accepted.empty());
  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::explained);
  const ObservationErrors& before = diagnosis.base().result.errors.front();
  const ObservationErrors& after = diagnosis.found().result.errors.front();
  EXPECT_GT(before.held_out.rms, 4 * before.noise);
  EXPECT_LT(after.held_out.rms, 1.1 * after.noise);
}

constexpr double kTurn_rad = 0.05, kTooLarge = 0.02;

/// A pattern that is turned on the cloth, in a world that is measured too large: constants of the
/// markers do most of either.
FitInput with_two_causes() {
  SyntheticCloth cloth{.mesh = 7,
                       .markers = 5,
                       .marker_margin_m = 0.03,
                       .frames = 30,
                       .held_out_from = 22,
                       .scale = 1 + kTooLarge};
  cloth.seen = [](const SyntheticMotion& motion, double time_s, const Eigen::Vector2d& place_m) {
    const Eigen::Vector2d middle_m(0.2, 0.2);
    return motion(time_s, middle_m + Eigen::Rotation2Dd(kTurn_rad) * (place_m - middle_m));
  };
  return synthetic_input(cloth);
}

DiagnoseOptions quick_of_two_causes() {
  DiagnoseOptions options = quick();
  options.fit.work = 0.1;
  options.refits = 2;
  return options;
}

TEST(Diagnose, NamesCausesThatConstantsMatchOneByOneButNotTogether) {
  DiagnoseOptions options = quick_of_two_causes();
  options.most_effects = 2;
  const Diagnosis diagnosis = diagnose(with_two_causes(), options, {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  ASSERT_EQ(diagnosis.accepted.size(), 2u);
  const LawTrial& first = diagnosis.accepted[0].trial;
  const LawTrial& second = diagnosis.accepted[1].trial;
  EXPECT_EQ(first.term.effect, "scale");
  EXPECT_EQ(second.term.title(), "marker_placement (turn)");
  EXPECT_GT(first.cross_validated, first.best_trivial);
  EXPECT_TRUE(first.with_later_ones);
  EXPECT_LT(second.cross_validated, first.best_trivial);
  EXPECT_FALSE(second.with_later_ones);
  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::explained);
  EXPECT_FALSE(diagnosis.seen_elsewhere);
  const std::map<std::string, double>& found = diagnosis.found().values;
  EXPECT_NEAR(found.at("scale.factor"), 1 + kTooLarge, 2e-3);
  EXPECT_NEAR(std::abs(found.at("marker_placement.turn")), kTurn_rad, 1e-3);
}

TEST(Diagnose, GivesUpACauseThatConstantsMatchWhereNoOtherMayBeNamedWithIt) {
  DiagnoseOptions options = quick_of_two_causes();
  options.most_effects = 1;
  const Diagnosis diagnosis = diagnose(with_two_causes(), options, {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  EXPECT_TRUE(diagnosis.seen_elsewhere);
  for (const AcceptedEffect& accepted : diagnosis.accepted)
    EXPECT_NE(accepted.trial.term.effect, "scale");
}

TEST(Diagnose, DoesNotNameWhatItWasNotToTest) {
  DiagnoseOptions options = quick();
  options.without = {"viscous_damping"};
  options.most_effects = 1;
  const Diagnosis diagnosis = diagnose(synthetic_input(kSmallWithDrag), options, {});

  for (const LawScore& score : diagnosis.scores) EXPECT_NE(score.term.effect, "viscous_damping");
  EXPECT_NE(diagnosis.verdict, DiagnosisVerdict::adequate);
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
  DiagnoseOptions options = quick();
  options.refits = 2;
  const Diagnosis diagnosis = diagnose(fitted, {&unseen, 1}, options, {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  ASSERT_EQ(diagnosis.accepted.size(), 1u);
  EXPECT_EQ(diagnosis.accepted.front().trial.term.effect, "viscous_damping");
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
    // Stated, or as all of the recording's frames tell, though none of the third is fitted.
    EXPECT_NEAR(after.noise, cloth.noise_m, 0.1 * cloth.noise_m);
  }
}

TEST(Diagnose, ProposesNoLawWhereItIsToldNotTo) {
  DiagnoseOptions options = quick();
  options.most_effects = 0;  // the drag is left
  options.law_terms = 0;
  const Diagnosis diagnosis = diagnose(synthetic_input(kSmallWithDrag), options, {});

  EXPECT_EQ(diagnosis.verdict, DiagnosisVerdict::unexplained);
  EXPECT_TRUE(diagnosis.law.trials.empty());
  EXPECT_FALSE(diagnosis.law.found());

  options.law_terms = 1;
  EXPECT_TRUE(diagnose(synthetic_input(kSmallWithDrag), options, {}).law.found());
}

TEST(Diagnose, EndsSoonWhenItIsToldTo) {
  int calls = 0;
  const Diagnosis diagnosis =
      diagnose(synthetic_input({}), quick(), [&](const Progress&) { return ++calls < 5; });
  EXPECT_EQ(diagnosis.stop, FitStop::cancelled);
}

TEST(Diagnose, RefusesRecordingsOfTwoCloths) {
  std::vector<FitInput> inputs{synthetic_input({}), synthetic_input({})};
  inputs[1].recording.cloth.width_m *= 1.1;
  EXPECT_THROW(diagnose(inputs, {}, quick(), {}), InputError);
  EXPECT_THROW(diagnose({&inputs[0], 1}, {&inputs[1], 1}, quick(), {}), InputError);
  EXPECT_THROW(diagnose({}, {&inputs[1], 1}, quick(), {}), InputError);
}

TEST(Diagnose, RefusesOptionsThatMakeNoSense) {
  DiagnoseOptions options = quick();
  options.lines = 0;
  EXPECT_THROW(diagnose(synthetic_input({}), options, {}), InputError);
  options = quick();
  options.law_terms = 11;
  EXPECT_THROW(diagnose(synthetic_input({}), options, {}), InputError);
  options = quick();
  options.without = {"aether"};
  EXPECT_THROW(diagnose(synthetic_input({}), options, {}), InputError);
}

}  // namespace
}  // namespace clothfit
