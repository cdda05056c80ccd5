// Whole runs of the program on bundled recordings, from outside. How good the numbers are:
// tests/vision, tests/calib and tests/fit compare them with the truth.
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
#include "data/tracks.h"
#include "model/surface.h"
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

const fs::path kBundled = fs::path(CLOTHFIT_SOURCE_DIR) / "data" / "recordings";

std::string read_text(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A fit kept small: few individuals, few generations.
std::vector<std::string> small_fit(const std::string& recording, const std::string& out) {
  return {"fit",           recording, "--population", "16",  "--generations", "2",
          "--refine-best", "1",       "--mesh",       "9x9", "--out",         out};
}

TEST(ProgramFit, WritesAWholeResultFolder) {
  const test::ScratchFolder here("fit");

  const ProgramRun run =
      run_program(small_fit((kBundled / "swing_plain").string(), "a.fit"), here.path());

  ASSERT_EQ(run.exit_code, 0) << run.error;
  EXPECT_THAT(names_in(here.path()), ElementsAre("a.fit"));
  for (const char* name : {"fit.json", "report.html", "parameters.csv", "errors.csv",
                           "residuals.csv", "overlay.svg"}) {
    EXPECT_TRUE(fs::exists(here.path() / "a.fit" / name)) << name;
  }
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
  // The vertices' tracks, read back, looked at where the markers are.
  std::vector<Eigen::Matrix3Xd> mesh;
  for (const Position3d& row : read_tracks3d(*simulated.tracks3d, simulated.markers)) {
    if (row.marker == 0) mesh.emplace_back(3, 81);
    mesh.back().col(row.marker) = row.position_m;
  }
  Eigen::Matrix2Xd places(2, static_cast<Eigen::Index>(measured.markers.markers.size()));
  for (std::size_t m = 0; m < measured.markers.markers.size(); ++m)
    places.col(static_cast<Eigen::Index>(m)) << measured.markers.markers[m].s_m,
        measured.markers.markers[m].t_m;
  const Surface surface = make_surface(9, 9, 0.4, 0.4, places);
  double fitted = 0, held_out = 0;
  int fitted_count = 0, held_out_count = 0;
  for (const Position3d& row : read_tracks3d(*measured.tracks3d, measured.markers)) {
    const Eigen::Matrix3Xd at = surface.evaluate(mesh[static_cast<std::size_t>(row.frame)]);
    const bool is_held_out = row.frame >= *measured.held_out_from_frame;
    (is_held_out ? held_out : fitted) += (at.col(row.marker) - row.position_m).squaredNorm();
    ++(is_held_out ? held_out_count : fitted_count);
  }
  ASSERT_EQ(fitted_count, fit.errors[0].fitted.count);
  ASSERT_EQ(held_out_count, fit.errors[0].held_out.count);
  // The pose's rounding, 1e-16, is all that differs.
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

TEST(ProgramFit, LeavesNothingWhenInterrupted) {
  const test::ScratchFolder here("interrupt");
  const auto interrupt_once_at_work = [&](int process) {
    // The hidden folder of the result appears when the work begins; from then on signals are
    // caught.
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (names_in(here.path()).empty() && std::chrono::steady_clock::now() < give_up) {
      std::this_thread::yield();
    }
    // Twice at once is one wish: `timeout` tells a program and its group.
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

  const ProgramRun run = run_program({"track", (kBundled / "tags_onecam").string()}, here.path());

  ASSERT_EQ(run.exit_code, 0) << run.error;
  EXPECT_THAT(names_in(here.path()), ElementsAre("tags_onecam.tracks"));
  const Recording recording = read_recording(here.path() / "tags_onecam.tracks");
  EXPECT_TRUE(recording.tracks2d.contains("front"));
  ASSERT_TRUE(recording.cameras[0].file);
  EXPECT_THAT(read_text(*recording.cameras[0].file), HasSubstr("camera_from_world"));
  EXPECT_TRUE(fs::exists(here.path() / "tags_onecam.tracks" / "tracks.json"));
  EXPECT_TRUE(fs::exists(here.path() / "tags_onecam.tracks" / "overlay_front.png"));
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
