// Checks the study of undeclared effects. Truths, amplitudes and right answers are as they say, and
// whole trials are kept and repeated. `clothfit recover --undeclared` prints how often a diagnosis
// is right.
#include "apps/study/trials/undeclared.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/study/trials/recover.h"
#include "apps/study/trials/undeclared_summary.h"
#include "data/input_error.h"
#include "fit/diagnosis/hypothesis_derivatives.h"
#include "fit/measurement_effects/registry.h"
#include "model/effects/registry.h"
#include "tests/apps/scratch_folder.h"
#include "tests/data/whole_runs.h"

namespace clothfit {
namespace {

/// Sets up a small cloth for half a second, of which three quarters are fitted.
SyntheticScene small_scene() {
  SyntheticScene scene;
  scene.truth_mesh = 7;
  scene.markers = 7;
  scene.frames = 31;
  scene.held_out_from = 24;
  scene.noise_m = 0.5e-3;
  return scene;
}

FitOptions small_fit() {
  return {.observations = ObservationKind::tracks3d, .mesh_columns = 7, .mesh_rows = 7};
}

/// Lists every effect but these.
std::vector<std::string> all_but(const std::vector<std::string>& effects) {
  std::vector<std::string> others;
  for (const EffectEntry& entry : effect_registry()) others.push_back(entry.name);
  for (const MeasurementEffectEntry& entry : measurement_effect_registry())
    others.push_back(entry.name);
  for (const std::string& effect : effects) std::erase(others, effect);
  return others;
}

/// Sets up a study of a smaller cloth still, with a short search. A few effects compete.
UndeclaredOptions small_undeclared_study() {
  UndeclaredOptions options{.scene = small_scene(), .diagnosis = {.fit = small_fit()}};
  options.scene.truth_mesh = options.scene.markers = 5;
  options.diagnosis.fit.mesh_columns = options.diagnosis.fit.mesh_rows = 5;
  options.diagnosis.fit.population = 40;
  options.diagnosis.fit.generations = 10;
  options.diagnosis.fit.refine_best = 1;
  options.diagnosis.without = all_but({"viscous_damping", "gravity_scale", "scale"});
  options.diagnosis.beam_width = 1;
  options.diagnosis.refits = 3;
  options.modes = {{"viscous_damping", ""}};
  options.trials = 1;
  options.seed = 21;
  options.threads = 1;
  return options;
}

double rms(const Eigen::Matrix3Xd& difference) {
  return std::sqrt(difference.squaredNorm() / static_cast<double>(difference.size()));
}

TEST(SyntheticScene, IsTheSameMotionByEitherIntegrator) {
  // The effects are of every kind: a force, inertia, supports, and a memory.
  for (const HiddenEffect& hidden :
       {HiddenEffect{"viscous_damping", {0.4}}, HiddenEffect{"added_air_mass", {0.01}},
        HiddenEffect{"support_motion", {0.002, 0.001, 0, 3, 0.2}},
        HiddenEffect{"relaxation", {0.1, 0.1}}}) {
    SCOPED_TRACE(hidden.name);
    SyntheticScene scene = small_scene();
    scene.hidden = {hidden};
    const std::vector<double> time_s = scene_frame_times_s(scene);
    const auto runge_kutta = [&](double steps) {
      scene.integrator = TruthIntegrator::runge_kutta;
      scene.truth_steps = steps;
      return simulate_scene(scene, 3, time_s).back();
    };
    const auto euler = [&](double steps) {
      scene.integrator = TruthIntegrator::euler;
      scene.truth_steps = steps;
      return simulate_scene(scene, 3, time_s).back();
    };
    const Eigen::Matrix3Xd there = runge_kutta(4);
    const double at_16 = rms(euler(16) - there), at_32 = rms(euler(32) - there);

    // As its steps shrink, the scheme of fits converges to the same motion, at first order.
    EXPECT_LT(at_32, 1e-5);
    EXPECT_NEAR(at_16 / at_32, 2, 0.3);
    EXPECT_LT(rms(runge_kutta(1) - there), 0.1 * at_32 + 1e-6);
    EXPECT_GT(rms(there - simulate_scene(scene, 3, time_s).front()), 0.02);
  }
}

TEST(SyntheticScene, MovesItsSupportsAsTheEffectDoes) {
  SyntheticScene scene = small_scene();
  scene.before_s = 0.1;
  scene.hidden = {{"support_motion", {0.002, -0.001, 0.003, 3.0, 0.2}}};
  const auto moved = simulate_scene(scene, 3, scene_frame_times_s(scene));

  const auto sine = [](double time_s) { return std::sin(2 * M_PI * (3 * time_s + 0.2)); };
  const Eigen::Vector3d way = moved[10].col(0) - moved[0].col(0);
  const Eigen::Vector3d expected =
      (sine(10 / 60.0) - sine(0)) * Eigen::Vector3d(0.002, -0.001, 0.003);
  EXPECT_LT((way - expected).norm(), 1e-12);
}

TEST(TrueSight, SeesAFasterClockAsFewerFramesPerSecond) {
  SyntheticScene scene = small_scene();
  scene.noisy = false;
  scene.truth_steps = 4;
  SyntheticScene slower = scene;
  scene.hidden = {{"frame_rate_error", {0.01}}};
  slower.frame_rate_hz = 60 / 1.01;

  const SyntheticRecording hidden = make_synthetic_recording(scene, 5);
  const SyntheticRecording other_rate = make_synthetic_recording(slower, 5);

  const size_t last = hidden.input.tracks3d.size() - 1;
  ASSERT_EQ(hidden.input.tracks3d.size(), other_rate.input.tracks3d.size());
  // Both cut time into steps of their own, so the scheme's error differs by micrometres.
  for (const size_t row : {last / 2, last})
    EXPECT_LT(
        (hidden.input.tracks3d[row].position_m - other_rate.input.tracks3d[row].position_m).norm(),
        3e-5);
}

TEST(TrueSight, SeesThroughALongerLensFurtherOut) {
  SyntheticScene scene = small_scene();
  scene.noisy = false;
  const SyntheticRecording plain = make_synthetic_recording(scene, 5);
  scene.hidden = {{"focal_error", {0.01}}};
  const SyntheticRecording longer = make_synthetic_recording(scene, 5);

  const CameraParameters camera = scene_camera(scene, 0, 960, 720);
  const auto& row = plain.input.tracks2d.at(camera.name).back();
  const Eigen::Vector2d from_centre = row.position_px - camera.centre_px;
  const Eigen::Vector2d moved =
      longer.input.tracks2d.at(camera.name).back().position_px - row.position_px;
  EXPECT_LT((moved - 0.01 * from_centre).norm(), 1e-9);
}

TEST(TrueSight, SeesAShrunkPatternWhereTheClothIs) {
  SyntheticScene scene = small_scene();
  scene.noisy = false;
  scene.hidden = {{"marker_placement", {0, 0, -0.02, -0.01, 0}}};
  const SyntheticRecording shrunk = make_synthetic_recording(scene, 5);

  // Given the truth's own surface at the places that the pattern really has
  const std::vector<Marker>& markers = shrunk.input.recording.markers.markers;
  Eigen::Matrix2Xd place_m(2, static_cast<Eigen::Index>(markers.size()));
  for (size_t m = 0; m < markers.size(); ++m)
    place_m.col(static_cast<Eigen::Index>(m)) << 0.98 * (markers[m].s_m - 0.2) + 0.2,
        0.99 * (markers[m].t_m - 0.2) + 0.2;
  const Surface surface =
      make_surface(scene.truth_mesh, scene.truth_mesh, scene.size_m, scene.size_m, place_m);
  const auto motion_m = simulate_scene(scene, 5, scene_frame_times_s(scene));

  for (const auto& row : shrunk.input.tracks3d)
    EXPECT_LT((row.position_m -
               surface.evaluate(motion_m[static_cast<size_t>(row.frame)]).col(row.marker))
                  .norm(),
              1e-12);
}

TEST(TrueSight, RefusesMarkersBesideTheCloth) {
  // Given markers up to the edges
  SyntheticScene scene = small_scene();
  for (const std::vector<double>& placement :
       {std::vector<double>{0, 0, 0.001, 0, 0}, {0.001, 0, 0, 0, 0}, {0, 0, 0, 0, 0.001}}) {
    scene.hidden = {{"marker_placement", placement}};
    EXPECT_THROW(make_synthetic_recording(scene, 5), InputError);
  }
}

TEST(HiddenMode, AmountsToAsManySigmasAsItSays) {
  const RecordingInformation information = recording_information(small_scene(), small_fit(), 7);
  const DrawnMode drawn =
      draw_mode(information, {"viscous_damping", ""}, {.least = 8, .most = 50}, 7);

  // The Cramer-Rao bound of a fit that has it free is another way to its sigma.
  FitOptions with_drag = small_fit();
  with_drag.effects = {"viscous_damping"};
  const double sigma = bound_sigmas(information.recording, with_drag).at("viscous_damping.rate");
  ASSERT_EQ(drawn.amplitude.size(), 1);
  EXPECT_GE(drawn.sigmas, 8);
  EXPECT_LE(drawn.sigmas, 50);
  EXPECT_NEAR(drawn.amplitude[0] / sigma, drawn.sigmas, 1e-3 * drawn.sigmas);
  EXPECT_NEAR(drawn.projected.norm(), 1, 1e-9);
}

TEST(HiddenMode, IsRefusedWhereItsBoundsKeepItFromBeingSeen) {
  const RecordingInformation information = recording_information(small_scene(), small_fit(), 7);
  const DrawnMode drawn =
      draw_mode(information, {"viscous_damping", ""}, {.least = 1e7, .most = 1e8}, 7);
  EXPECT_EQ(drawn.amplitude.size(), 0);
}

TEST(HiddenMode, SharesItsClassWithItsTwin) {
  // With still supports and free stiffness and damping a fast clock is exactly stronger gravity.
  const RecordingInformation information = recording_information(small_scene(), small_fit(), 7);
  const DrawnMode drawn =
      draw_mode(information, {"frame_rate_error", ""}, {.least = 8, .most = 50}, 7);

  const auto right = right_class(information, drawn, projected_modes(information));

  EXPECT_NE(std::ranges::find(right, "frame_rate_error"), right.end());
  EXPECT_NE(std::ranges::find(right, "gravity_scale"), right.end());
  EXPECT_EQ(std::ranges::find(right, "nonuniform_stiffness"), right.end());
}

TEST(ModeDerivatives, SquaredMultipleCorrelationIsThatOfLeastSquares) {
  Eigen::MatrixXd columns(3, 2);
  columns << 1, 2, 0, 0, 0, 1e-6;
  // In the plane of the first and third axis lie 9 + 16 of 9 + 4 + 16.
  EXPECT_NEAR(squared_multiple_correlation(Eigen::Vector3d(3, 2, 4), columns), 25.0 / 29, 1e-6);
}

TEST(Rate, HasExactBounds) {
  EXPECT_NEAR((Rate{.hits = 0, .trials = 500}.bounds().upper), 1 - std::pow(0.025, 1.0 / 500),
              1e-9);
  EXPECT_NEAR((Rate{.hits = 500, .trials = 500}.bounds().lower), std::pow(0.025, 1.0 / 500), 1e-9);
  // Tables have 0.272 and 0.728 for 10 of 20.
  EXPECT_NEAR((Rate{.hits = 10, .trials = 20}.bounds().lower), 0.272, 5e-4);
  EXPECT_NEAR((Rate{.hits = 10, .trials = 20}.bounds().upper), 0.728, 5e-4);
}

TEST(UndeclaredSummaries, CountLawsThatHalveTheErrorWhereAnEffectWasWithheld) {
  UndeclaredTrial trial{.hidden = {{.mode = {"viscous_damping", ""}}},
                        .mimicked = 0.2,
                        .stop = FitStop::converged,
                        .verdict = DiagnosisVerdict::unexplained,
                        .before = 4,
                        .after = 4,
                        .with_truth = 1,
                        .noise = 1,
                        .with_law = 2};
  UndeclaredResult result;
  result.trials.push_back(trial);  // half of the error is left
  trial.with_law = 2.1;
  result.trials.push_back(trial);
  trial.with_law = std::numeric_limits<double>::quiet_NaN();  // none was found
  result.trials.push_back(trial);
  trial.verdict = DiagnosisVerdict::adequate;  // none was asked for
  result.trials.push_back(trial);
  trial = result.trials.front();
  trial.mimicked = std::numeric_limits<double>::quiet_NaN();  // not withheld
  result.trials.push_back(trial);

  const Rate halves = undeclared_summaries(result).back().law_halves;
  EXPECT_EQ(halves.hits, 1);
  EXPECT_EQ(halves.trials, 3);
}

TEST(Undeclared, NamesADragAndItsAmount) {
  UndeclaredOptions options = small_undeclared_study();
  options.draw = {.least = 30, .most = 30};
  Releases releases(options.scene, options.diagnosis.fit);

  const UndeclaredTrial trial = undeclared_once(options, 0, 21, releases);

  SCOPED_TRACE("seed 21");
  ASSERT_TRUE(trial.usable()) << trial.refused << trial.message;
  EXPECT_TRUE(trial.right_first());
  EXPECT_TRUE(trial.all_named());
  EXPECT_LT(trial.after, trial.before);
  // Noise of 7 x 25 x 3 numbers scatters by 3 %.
  EXPECT_NEAR(trial.after / trial.with_truth, 1, 0.1);
  EXPECT_NEAR(trial.with_truth / trial.noise, 1, 0.15);
}

TEST(Undeclared, AcceptsNothingInACleanRecording) {
  UndeclaredOptions options = small_undeclared_study();
  options.hide = UndeclaredOptions::Hide::nothing;
  Releases releases(options.scene, options.diagnosis.fit);

  const UndeclaredTrial trial = undeclared_once(options, 0, 22, releases);

  SCOPED_TRACE("seed 22");
  ASSERT_TRUE(trial.usable()) << trial.message;
  EXPECT_TRUE(trial.right_first());
  EXPECT_EQ(trial.verdict, DiagnosisVerdict::adequate);
}

TEST(Undeclared, FindsAPlaceThatACoarserMeshDoesNotShow) {
  CLOTHFIT_ONLY_IN_WHOLE_RUNS();
  // The truth is stiffer by a tenth around a place between those that are tried. By the derivatives
  // of 9 x 9 vertices it explains nothing.
  SyntheticScene scene;
  scene.truth_mesh = 17;
  scene.markers = 9;
  scene.noise_m = 0.5e-3;
  scene.hidden = {
      {"nonuniform_stiffness", {0.1, 0.433, 0.202, 0.232, 0, 0.1, 0, 0, 0, 0.5, 0.5, 0.25, 0.25}}};
  const unsigned long long seed = 1;
  SCOPED_TRACE("seed " + std::to_string(seed));
  const SyntheticRecording recording = make_synthetic_recording(scene, seed);
  DiagnoseOptions options{.fit = small_fit()};
  options.fit.mesh_columns = options.fit.mesh_rows = 17;
  options.without = all_but({"nonuniform_stiffness"});
  options.law_terms = 0;

  const Diagnosis diagnosis = diagnose(recording.input, options, {});

  ASSERT_TRUE(diagnosis.usable()) << diagnosis.message;
  ASSERT_EQ(diagnosis.accepted.size(), 1u);
  const Hypothesis& found = diagnosis.accepted.front().trial.hypothesis;
  EXPECT_EQ(found.title(), "nonuniform_stiffness (patch)");
  EXPECT_NEAR(found.shape.at("patch_s"), 0.433, 0.1);
  EXPECT_NEAR(found.shape.at("patch_t"), 0.202, 0.1);
}

TEST(Undeclared, GoesOnFromItsJournalToTheSameNumbers) {
  UndeclaredOptions options = small_undeclared_study();
  options.diagnosis.most_effects = 0;  // this asks nothing of the diagnosis' own work
  options.diagnosis.without = all_but({"viscous_damping"});
  options.scene.noise_m = 1e-3;
  options.scene.markers = 4;
  options.scene.frames = 14;
  options.scene.held_out_from = 11;
  options.trials = 2;
  const UndeclaredResult alone = recover_undeclared(options, nullptr, {});
  const test::ScratchFolder scratch("undeclared");
  const std::filesystem::path file = scratch.path() / "undeclared.journal";
  {
    Journal journal(file, options.key(), JournalStart::fresh);
    int told = 0;
    recover_undeclared(options, &journal, [&](const Progress&) { return ++told < 2; });
    EXPECT_EQ(journal.finished().size(), 1u);
  }
  options.threads = 2;
  Journal journal(file, options.key(), JournalStart::resume);
  const UndeclaredResult resumed = recover_undeclared(options, &journal, {});

  ASSERT_EQ(resumed.trials.size(), 2u);
  for (size_t n = 0; n < 2; ++n) {
    const UndeclaredTrial &one = alone.trials[n], &other = resumed.trials[n];
    EXPECT_EQ(one.hidden.front().sigmas, other.hidden.front().sigmas);
    EXPECT_EQ(one.hidden.front().right, other.hidden.front().right);
    EXPECT_EQ(one.before, other.before);
    EXPECT_EQ(one.after, other.after);
    EXPECT_EQ(one.with_truth, other.with_truth);
  }
}

}  // namespace
}  // namespace clothfit
