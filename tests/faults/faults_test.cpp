// Lets every call of the system that eight commands make on their files fail once. The program must
// say so by its exit code and a message that names a file, or do without; an older result stays or
// the whole new one is there, and what is kept for --resume leads to the same bytes. Not checked:
// faults of standard output and error, of two calls at once but where they belong together, of
// memory (memory_faults_test.cpp); power cuts.

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

#include "tests/apps/bundled_recordings.h"
#include "tests/data/whole_runs.h"
#include "tests/faults/faulty_run.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using test::Fault;
using test::FaultKind;
using test::FaultyCommand;
using test::FaultyRuns;

constexpr const char* kSheet =
    "format: clothfit-model/1\n"
    "name: sheet\n"
    "cloth: {size: [0.4, 0.4], mass: 0.03, mesh: {columns: 5, rows: 5}}\n"
    "fabric: {tension_warp: 50, tension_weft: 50, shear: 20, flexion_warp: 10, "
    "flexion_weft: 10, damping_warp: 0.002, damping_weft: 0.002}\n"
    "held: [{at: [0, 0], motion: fixed}, {at: [0.4, 0], motion: path, file: right.csv}]\n"
    "start: {kind: released_flat, position: [0, 0, 1], orientation: [0.70710678118654752, "
    "-0.70710678118654752, 0, 0]}\n"
    "time: {frame_rate: 60, duration: 0.15}\n";

void write_sheet(const fs::path& folder) {
  std::ofstream(folder / "sheet.yaml") << kSheet;
  std::ofstream(folder / "right.csv") << "time,x,y,z\n0,0.4,0,1\n1,0.4,0,1\n";
}

void write_simulated(const fs::path& folder) {
  write_sheet(folder);
  const test::ProgramRun made =
      test::run_program({"simulate", "sheet.yaml", "--format", "csv", "--out", "swing"}, folder);
  EXPECT_EQ(made.exit_code, 0) << made.error;
  for (const char* name : {"stdout.txt", "stderr.txt", "sheet.yaml", "right.csv"})
    fs::remove(folder / name);
}

/// Copies the bundled recording with two pictures of the cloth and four of the board.
void write_pictures(const fs::path& folder) {
  const fs::path from = kBundled / "tags_onecam", to = folder / "few";
  for (const char* name :
       {"markers.csv", "recording.yaml", "reference.csv", "frames/front/000000.jpg",
        "frames/front/000001.jpg", "calibration/front/00.jpg", "calibration/front/01.jpg",
        "calibration/front/02.jpg", "calibration/front/03.jpg"}) {
    fs::create_directories((to / name).parent_path());
    fs::copy(from / name, to / name);
  }
}

FaultyCommand simulate() {
  return {.name = "simulate",
          .prepare = write_sheet,
          .words = {"simulate", "sheet.yaml", "--format", "csv,obj,pc2,gltf"}};
}
FaultyCommand fit() {
  return {.name = "fit",
          .prepare = write_simulated,
          .words = {"fit", "swing", "--population", "8", "--generations", "2", "--refine-best", "1",
                    "--work", "1e-4", "--keep", "--threads", "1", "--checkpoint", "search.txt"},
          .kept = "search.txt"};
}
FaultyCommand track() {
  return {.name = "track", .prepare = write_pictures, .words = {"track", "few", "--threads", "1"}};
}
FaultyCommand calibrate() {
  return {.name = "calibrate", .prepare = write_pictures, .words = {"calibrate", "few"}};
}
FaultyCommand recover() {
  return {.name = "recover",
          .prepare = [](const fs::path&) {},
          .words = {"recover", "--trials", "2", "--start-factor", "2", "--mesh", "5",
                    "--truth-mesh", "5", "--markers", "5", "--seconds", "0.3", "--rate", "30",
                    "--threads", "1", "--journal", "trials.journal"},
          .kept = "trials.journal"};
}
FaultyCommand diagnose() {
  return {.name = "diagnose",
          .prepare = write_simulated,
          .words = {"diagnose", "swing", "--work", "1e-4", "--lines", "1", "--refits", "1",
                    "--most-effects", "1", "--law-terms", "0", "--plant", "0", "--threads", "1",
                    "--budget", "1e-9"}};
}
FaultyCommand sheet() {
  return {.name = "sheet",
          .prepare = [](const fs::path&) {},
          .words = {"sheet", "dots", "--size", "0.1x0.1", "--grid", "4x4", "--dpi", "72"},
          .replaces = false};
}
FaultyCommand drape() {
  return {.name = "drape",
          .prepare =
              [](const fs::path& folder) {
                std::ofstream(folder / "twill.yaml")
                    << "format: clothfit-fabric/1\nname: twill\nunits: si\nareal_density: 0.2\n"
                       "tension: {warp: 500, weft: 400}\nshear: 40\n"
                       "bending: {warp: 8e-6, weft: 2e-6}\n";
              },
          .words = {"drape", "--test", "cusick", "--fabric", "twill.yaml", "--spacing", "15mm",
                    "--starts", "1", "--threads", "1"}};
}
FaultyCommand check() {
  return {
      .name = "check", .prepare = write_simulated, .words = {"check", "swing"}, .writes = false};
}

/// Lets each `every`-th call of the kinds that are wanted fail, one a run.
void expect_honest_faults(const FaultyCommand& command, int every = 1) {
  FaultyRuns runs(command);
  if (::testing::Test::HasFailure()) return;
  int faults = 0, turn = 0;
  const auto let_fail = [&](const Fault& fault, bool older) {
    if (turn++ % every != 0) return;
    ++faults;
    runs.expect_honest(fault, older);
  };
  std::string counts;
  for (const FaultKind& kind : test::fault_kinds()) {
    // What is not replaced loses its mark at the end, and nothing else is removed.
    if (kind.name == "remove" && !command.replaces) continue;
    const int calls = runs.calls().at(kind.name);
    if (calls > 0) counts += " " + kind.name + " " + std::to_string(calls);
    for (int number = 1; number <= calls; number += kind.every) {
      let_fail({.kind = kind, .number = number}, true);
      // A disk that is full stays so.
      if (kind.name == "write") let_fail({.kind = kind, .number = number, .stays = true}, true);
      // Where nothing stands at --out, other calls put the result there.
      if (kind.name == "exchange") let_fail({.kind = kind, .number = number}, false);
      if (kind.name != "exchange" && kind.name != "copy") continue;
      // What a file system lacks is done in another way.
      const FaultKind lacking{.name = kind.name, .error_number = EINVAL};
      for (const bool older : {false, true}) let_fail({.kind = lacking, .number = number}, older);
      if (kind.name != "exchange") continue;
      for (const char* also : {"rename:1:5", "rename:2:5", "rename:3:5"})
        if (command.kept != "search.txt") {  // it is renamed too
          let_fail({.kind = lacking, .number = number, .also = also}, true);
        }
    }
  }
  std::printf("%s: %d faults; calls:%s\n", command.name.c_str(), faults, counts.c_str());
}

TEST(FaultySystem, IsReportedBySomeCallsOfSimulateAndRecover) {
  expect_honest_faults(simulate(), 31);
  expect_honest_faults(recover(), 31);
}

class EveryFault : public ::testing::TestWithParam<FaultyCommand> {};

TEST_P(EveryFault, IsSaidOrDoneWithout) {
  CLOTHFIT_ONLY_IN_WHOLE_RUNS();
  expect_honest_faults(GetParam());
}

INSTANTIATE_TEST_SUITE_P(Of, EveryFault,
                         ::testing::Values(simulate(), fit(), track(), calibrate(), recover(),
                                           diagnose(), sheet(), check(), drape()));

}  // namespace
}  // namespace clothfit
