// Runs the whole program on bundled recordings, from outside. The numbers are compared with the
// truth in tests/vision, tests/calib and tests/fit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

#include "data/fit_result.h"
#include "data/recording.h"
#include "data/text_file.h"
#include "data/tracks.h"
#include "model/topology/surface.h"
#include "tests/apps/bundled_recordings.h"
#include "tests/apps/program_run.h"
#include "tests/apps/scratch_folder.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using test::names_in;
using test::ProgramRun;
using test::run_program;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string read_text(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Keeps a fit small: few individuals, few generations, two iterations of each refinement.
std::vector<std::string> small_fit(const std::string& recording, const std::string& out) {
  return {"fit", recording, "--population", "16",     "--generations", "2",     "--refine-best",
          "1",   "--mesh",  "9x9",          "--work", "1e-4",          "--out", out};
}

TEST(ProgramFit, WritesAWholeResultFolder) {
  const test::ScratchFolder here("fit");

  const ProgramRun run =
      run_program(small_fit((kBundled / "swing_plain").string(), "a.fit"), here.path());

  ASSERT_EQ(run.exit_code, 0) << run.error;
  EXPECT_THAT(names_in(here.path()), ElementsAre("a.fit"));
  for (const char* name :
       {"fit.json", "report.html", "parameters.csv", "errors.csv", "residuals.csv", "overlay.svg"})
    EXPECT_TRUE(fs::exists(here.path() / "a.fit" / name)) << name;
  EXPECT_THAT(run.out, HasSubstr("Report: a.fit/report.html"));
  const FitResult result = read_fit_result(here.path() / "a.fit" / "fit.json");
  EXPECT_EQ(result.recording, "swing_plain");
  EXPECT_FALSE(result.parameters.empty());
  ASSERT_FALSE(result.errors.empty());
  EXPECT_GT(result.errors[0].held_out.count, 0);
  EXPECT_THAT(read_text(here.path() / "a.fit" / "report.html"), HasSubstr("<h2>Parameters</h2>"));
}

TEST(ProgramSimulate, OfAFitGivesTheFitsOwnError) {
  const test::ScratchFolder here("simulate_fit");
  const fs::path source = kBundled / "swing_plain";
  ASSERT_EQ(run_program(small_fit(source.string(), "a.fit"), here.path()).exit_code, 0);

  const ProgramRun run =
      run_program({"simulate", "--fit", "a.fit", "--format", "csv"}, here.path());

  ASSERT_EQ(run.exit_code, 0) << run.error;
  EXPECT_THAT(run.out, HasSubstr("as the model says"));
  const FitResult fit = read_fit_result(here.path() / "a.fit" / "fit.json");
  const Recording measured = read_recording(source);
  const Recording simulated = read_recording(here.path() / "swing_plain.simulation");
  EXPECT_EQ(simulated.markers.markers.size(), 81u);
  // The vertices' tracks are read back and interpolated at the markers.
  std::vector<Eigen::Matrix3Xd> mesh;
  for (const Position3d& row : read_tracks3d(*simulated.tracks3d, simulated.markers)) {
    if (row.marker == 0) mesh.emplace_back(3, 81);
    mesh.back().col(row.marker) = row.position_m;
  }
  Eigen::Matrix2Xd places(2, static_cast<Eigen::Index>(measured.markers.markers.size()));
  for (size_t m = 0; m < measured.markers.markers.size(); ++m)
    places.col(static_cast<Eigen::Index>(m)) << measured.markers.markers[m].s_m,
        measured.markers.markers[m].t_m;
  const Surface surface = make_surface(9, 9, 0.4, 0.4, places);
  double fitted = 0, held_out = 0;
  int fitted_count = 0, held_out_count = 0;
  for (const Position3d& row : read_tracks3d(*measured.tracks3d, measured.markers)) {
    const Eigen::Matrix3Xd at = surface.evaluate(mesh[static_cast<size_t>(row.frame)]);
    const bool is_held_out = row.frame >= *measured.held_out_from_frame;
    (is_held_out ? held_out : fitted) += (at.col(row.marker) - row.position_m).squaredNorm();
    ++(is_held_out ? held_out_count : fitted_count);
  }
  ASSERT_EQ(fitted_count, fit.errors[0].fitted.count);
  ASSERT_EQ(held_out_count, fit.errors[0].held_out.count);
  // Only the pose's rounding, 1e-16, differs.
  EXPECT_NEAR(std::sqrt(fitted / fitted_count), fit.errors[0].fitted.rms_distance, 1e-9);
  EXPECT_NEAR(std::sqrt(held_out / held_out_count), fit.errors[0].held_out.rms_distance, 1e-9);
}

TEST(ProgramFit, GivesTheSameBytesOnOneThreadAndOnTwo) {
  const test::ScratchFolder here("threads");
  std::vector<std::string> one = small_fit((kBundled / "swing_hem").string(), "one.fit");
  std::vector<std::string> two = small_fit((kBundled / "swing_hem").string(), "two.fit");
  one.insert(one.end(), {"--threads", "1"});
  two.insert(two.end(), {"--threads", "2"});

  ASSERT_EQ(run_program(one, here.path()).exit_code, 0);
  ASSERT_EQ(run_program(two, here.path()).exit_code, 0);

  for (const char* name : {"parameters.csv", "errors.csv", "residuals.csv", "overlay.svg"}) {
    const std::string of_one = read_text(here.path() / "one.fit" / name);
    EXPECT_FALSE(of_one.empty()) << name;
    EXPECT_TRUE(of_one == read_text(here.path() / "two.fit" / name)) << name;
  }
}

TEST(ProgramFit, GoesOnFromItsCheckpointAfterCtrlCToTheSameBytes) {
  const test::ScratchFolder here("checkpoint");
  const auto command = [&](const std::string& out) {
    return small_fit((kBundled / "swing_plain").string(), out);
  };
  ASSERT_EQ(run_program(command("whole.fit"), here.path()).exit_code, 0);
  std::vector<std::string> saved = command("saved.fit");
  saved.insert(saved.end(), {"--checkpoint", "search.txt"});
  const auto interrupt_after_a_generation = [&](int process) {
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!fs::exists(here.path() / "search.txt") && std::chrono::steady_clock::now() < give_up)
      std::this_thread::yield();
    kill(process, SIGINT);
  };

  const ProgramRun cut = run_program(saved, here.path(), interrupt_after_a_generation);
  EXPECT_EQ(cut.exit_code, 130) << cut.error;
  EXPECT_THAT(cut.error, HasSubstr("the search stands in search.txt"));
  EXPECT_THAT(cut.error, HasSubstr("--resume"));
  EXPECT_THAT(names_in(here.path()), ElementsAre("search.txt", "whole.fit"));
  saved.emplace_back("--resume");
  const ProgramRun resumed = run_program(saved, here.path());

  ASSERT_EQ(resumed.exit_code, 0) << resumed.error;
  const auto without_seconds = [&](const std::string& folder) {
    FitResult result = read_fit_result(here.path() / folder / "fit.json");
    result.seconds = 0;
    write_fit_result(result, here.path() / folder / "fit.json");
    return read_text(here.path() / folder / "fit.json");
  };
  EXPECT_EQ(without_seconds("saved.fit"), without_seconds("whole.fit"));
}

TEST(ProgramFit, OfThePapersSpringsCanBeSimulatedForecastAndGoneOnFrom) {
  const test::ScratchFolder here("louchet5");
  const std::string recording = (kBundled / "swing_plain").string();
  std::vector<std::string> command = small_fit(recording, "a.fit");
  command.insert(command.end(), {"--springs", "louchet5", "--search", "cma"});
  const ProgramRun fitted = run_program(command, here.path());
  ASSERT_EQ(fitted.exit_code, 0) << fitted.error;
  const FitResult result = read_fit_result(here.path() / "a.fit" / "fit.json");
  EXPECT_EQ(result.parameter_set, "louchet5");
  EXPECT_EQ(result.parameters.size(), 6u);

  const ProgramRun simulated =
      run_program({"simulate", "--fit", "a.fit", "--format", "csv"}, here.path());
  ASSERT_EQ(simulated.exit_code, 0) << simulated.error;
  const ProgramRun softer = run_program(
      {"simulate", "--fit", "a.fit", "--set", "stiffness=5", "--format", "csv", "--out", "softer"},
      here.path());
  ASSERT_EQ(softer.exit_code, 0) << softer.error;
  const ProgramRun elsewhere = run_program({"simulate", (kBundled / "swing_hem").string(), "--fit",
                                            "a.fit", "--format", "csv", "--out", "elsewhere"},
                                           here.path());
  ASSERT_EQ(elsewhere.exit_code, 0) << elsewhere.error;
  const ProgramRun forecast = run_program(
      {"fit", recording, "--forecast", "a.fit/fit.json", "--out", "b.fit"}, here.path());
  ASSERT_EQ(forecast.exit_code, 0) << forecast.error;
  EXPECT_EQ(read_fit_result(here.path() / "b.fit" / "fit.json").mesh_columns, 9);
  const ProgramRun other = run_program({"fit", recording, "--forecast", "a.fit/fit.json",
                                        "--springs", "louchet18", "--out", "c.fit"},
                                       here.path());
  EXPECT_EQ(other.exit_code, 3);
  EXPECT_THAT(other.error, HasSubstr("the fit of --forecast has louchet5"));
  const ProgramRun gone_on =
      run_program({"fit", recording, "--start", "a.fit/fit.json", "--mesh", "9x9", "--work", "1e-4",
                   "--loss", "squared", "--out", "d.fit"},
                  here.path());
  ASSERT_EQ(gone_on.exit_code, 0) << gone_on.error;
  EXPECT_THAT(read_fit_result(here.path() / "d.fit" / "fit.json").command,
              HasSubstr("--start a.fit/fit.json --loss squared"));
}

TEST(ProgramFit, OfAClothInMotionCanBeSimulated) {
  // Given a recording that begins in the middle of a swing: a simulation's own, cut
  const test::ScratchFolder here("in_motion");
  std::ofstream(here.path() / "start.csv") << [] {
    std::string text = "row,column,x,y,z,vx,vy,vz\n";
    for (int row = 0; row < 5; ++row)
      for (int column = 0; column < 5; ++column)
        text += std::to_string(row) + "," + std::to_string(column) + "," +
                std::to_string(0.1 * column) + ",0," + std::to_string(1 - 0.1 * row) + ",0," +
                std::to_string(0.3 * row) + ",0\n";
    return text;
  }();
  std::ofstream(here.path() / "sheet.yaml")
      << "format: clothfit-model/1\nname: sheet\n"
         "cloth: {size: [0.4, 0.4], mass: 0.03, mesh: {columns: 5, rows: 5}}\n"
         "fabric: {tension_warp: 50, tension_weft: 50, shear: 20, flexion_warp: 10, "
         "flexion_weft: 10, damping_warp: 0.002, damping_weft: 0.002}\n"
         "held: [{at: [0, 0], motion: fixed}, {at: [0.4, 0], motion: fixed}]\n"
         "start: {kind: in_motion, file: start.csv}\ntime: {frame_rate: 60, duration: 0.3}\n";
  ASSERT_EQ(run_program({"simulate", "sheet.yaml", "--format", "csv"}, here.path()).exit_code, 0);

  const ProgramRun fitted =
      run_program({"fit", "sheet.simulation", "--start-nodes", "3", "--population", "16",
                   "--generations", "2", "--refine-best", "1", "--work", "0.1", "--out", "a.fit"},
                  here.path());
  ASSERT_EQ(fitted.exit_code, 0) << fitted.error;
  const ProgramRun simulated =
      run_program({"simulate", "--fit", "a.fit", "--format", "csv", "--out", "again"}, here.path());
  ASSERT_EQ(simulated.exit_code, 0) << simulated.error;

  // Then the fit's simulation is as far off as the fit says.
  const Recording measured = read_recording(here.path() / "sheet.simulation");
  const Recording again = read_recording(here.path() / "again");
  const Tracks3d before = read_tracks3d(*measured.tracks3d, measured.markers);
  const Tracks3d after = read_tracks3d(*again.tracks3d, again.markers);
  ASSERT_EQ(before.size(), after.size());
  double sum = 0;
  for (size_t n = 0; n < before.size(); ++n)
    sum += (before[n].position_m - after[n].position_m).squaredNorm();
  const FitResult result = read_fit_result(here.path() / "a.fit" / "fit.json");
  EXPECT_EQ(result.start, "unknown");
  // Tracks have twelve digits or so.
  EXPECT_NEAR(std::sqrt(sum / static_cast<double>(before.size())),
              result.errors[0].fitted.rms_distance, 1e-9);

  const ProgramRun forecast = run_program(
      {"fit", "sheet.simulation", "--forecast", "a.fit/fit.json", "--out", "b.fit"}, here.path());
  EXPECT_EQ(forecast.exit_code, 3);
  EXPECT_THAT(forecast.error, HasSubstr("begins with the cloth in motion"));
}

TEST(ProgramFit, LeavesNothingWhenInterrupted) {
  const test::ScratchFolder here("interrupt");
  const auto interrupt_once_at_work = [&](int process) {
    // The hidden folder of the result appears when the work begins. From then on signals are
    // caught.
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (names_in(here.path()).empty() && std::chrono::steady_clock::now() < give_up)
      std::this_thread::yield();
    // Two at once are one wish: `timeout` tells a program and its group.
    kill(process, SIGINT);
    kill(process, SIGINT);
  };

  const ProgramRun run =
      run_program({"fit", (kBundled / "swing_plain").string(), "--generations", "100000"},
                  here.path(), interrupt_once_at_work);

  EXPECT_EQ(run.exit_code, 130) << run.error;
  EXPECT_THAT(names_in(here.path()), IsEmpty());
}

TEST(ProgramTrack, CompletesARecordingThatAFitCanUse) {
  const test::ScratchFolder here("track");
  const test::ScratchFolder bundled("track_bundled");
  // The first pictures will do: all of them are tracked in demo_test.cpp.
  const fs::path few = bundled.path() / "tags_onecam", pictures = "frames/front";
  fs::copy(kBundled / "tags_onecam", few, fs::copy_options::recursive);
  fs::remove_all(few / pictures);
  fs::create_directory(few / pictures);
  for (const char* name : {"000000.jpg", "000001.jpg", "000002.jpg", "000003.jpg"})
    fs::copy(kBundled / "tags_onecam" / pictures / name, few / pictures / name);

  const ProgramRun run = run_program({"track", few.string()}, here.path());

  ASSERT_EQ(run.exit_code, 0) << run.error;
  EXPECT_THAT(names_in(here.path()), ElementsAre("tags_onecam.tracks"));
  const Recording recording = read_recording(here.path() / "tags_onecam.tracks");
  EXPECT_TRUE(recording.tracks2d.contains("front"));
  ASSERT_TRUE(recording.cameras[0].file);
  EXPECT_THAT(read_text(*recording.cameras[0].file), HasSubstr("camera_from_world"));
  EXPECT_TRUE(fs::exists(here.path() / "tags_onecam.tracks" / "tracks.json"));
  EXPECT_TRUE(fs::exists(here.path() / "tags_onecam.tracks" / "overlay_front.png"));
}

TEST(ProgramTrack, RefusesTimesThatDoNotReachBeforeItTracks) {
  const test::ScratchFolder here("track_times");
  const fs::path recording = here.path() / "short";
  fs::copy(kBundled / "tags_onecam", recording, fs::copy_options::recursive);
  std::string yaml = read_text(recording / "recording.yaml");
  const std::string rate = "frame_rate: 60.0";
  yaml.replace(yaml.find(rate), rate.size(), "file: times.csv");
  write_text(yaml, recording / "recording.yaml");
  write_text("frame,time\n0,0\n1,0.02\n", recording / "times.csv");

  const ProgramRun run = run_program({"track", recording.string()}, here.path());

  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.error, HasSubstr((recording / "times.csv").string()));
  EXPECT_THAT(run.error, HasSubstr("lists 2 frames, but"));
  EXPECT_THAT(run.error, HasSubstr("holds 72 pictures"));
  EXPECT_FALSE(fs::exists(here.path() / "tags_onecam.tracks"));
}

TEST(ProgramCalibrate, CompletesARecordingThatTrackingCanUse) {
  const test::ScratchFolder here("calibrate");

  const ProgramRun run =
      run_program({"calibrate", (kBundled / "tags_onecam").string()}, here.path());

  ASSERT_EQ(run.exit_code, 0) << run.error;
  EXPECT_THAT(run.out, HasSubstr("fx"));
  const fs::path folder = here.path() / "tags_onecam.calibration";
  EXPECT_TRUE(fs::exists(folder / "calibration.json"));
  EXPECT_TRUE(fs::exists(folder / "calibration.csv"));
  EXPECT_TRUE(read_recording(folder).cameras[0].file);
}

}  // namespace
}  // namespace clothfit
