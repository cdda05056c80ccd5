// Runs `clothfit simulate` from outside and checks refusals, result files and their CSV. The other
// formats in detail: tests/data/mesh_sequence_test.cpp; the model's steps: tests/model; the fit
// that comes out again: program_end_to_end_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "data/recording.h"
#include "data/tracks.h"
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
using ::testing::Not;

/// Writes a model; `held`, `effects` and `more` are put in as they are. The sheet hangs, t
/// downwards.
std::string model_text(const std::string& held, const std::string& effects = "[]",
                       const std::string& more = "") {
  return "format: clothfit-model/1\n"
         "name: sheet\n"
         "cloth: {size: [0.4, 0.3], mass: 0.02, mesh: {columns: 9, rows: 7}}\n"
         "fabric: {tension_warp: 50, tension_weft: 50, shear: 20, flexion_warp: 10, "
         "flexion_weft: 10, damping_warp: 0.002, damping_weft: 0.002}\n"
         "held: " +
         held + "\neffects: " + effects +
         "\nstart: {kind: released_flat, position: [0, 0, 1], orientation: [0.70710678118654752, "
         "-0.70710678118654752, 0, 0]}\n"
         "time: {frame_rate: 50, duration: 0.4}\n" +
         more;
}

class Simulate : public ::testing::Test {
 protected:
  const test::ScratchFolder here_{std::string("simulate_") +
                                  ::testing::UnitTest::GetInstance()->current_test_info()->name()};

  void write(const std::string& text) { std::ofstream(here_.path() / "sheet.yaml") << text; }
  ProgramRun run(std::vector<std::string> options) const {
    options.insert(options.begin(), "simulate");
    return run_program(options, here_.path());
  }
  nlohmann::json result(const std::string& folder = "sheet.simulation") const {
    return nlohmann::json::parse(std::ifstream(here_.path() / folder / "simulation.json"));
  }
  /// Expects exit code 3 and a message; nothing but the model is there afterwards.
  void expect_refused(const std::vector<std::string>& options, const std::string& message) const {
    const ProgramRun refused = run(options);
    EXPECT_EQ(refused.exit_code, 3) << refused.error;
    EXPECT_THAT(refused.error, HasSubstr(message));
    EXPECT_THAT(names_in(here_.path()), ElementsAre("sheet.yaml"));
  }
};

constexpr const char* kCorners = "[{at: [0, 0], motion: fixed}, {at: [0.4, 0], motion: fixed}]";

TEST_F(Simulate, LetsAFreeSheetFallAsTheSchemeDoes) {
  write(model_text("[]"));

  const ProgramRun done = run({"sheet.yaml", "--format", "csv"});

  ASSERT_EQ(done.exit_code, 0) << done.error;
  const Recording recording = read_recording(here_.path() / "sheet.simulation");
  const Tracks3d tracks = read_tracks3d(*recording.tracks3d, recording.markers);
  const double h = result()["time_step"]["used_s"];
  const int substeps = result()["time_step"]["substeps"];
  EXPECT_NEAR(h * substeps, 0.02, 1e-12);
  ASSERT_EQ(tracks.size(), 21u * 63);
  double largest_m = 0;
  for (const Position3d& row : tracks) {
    const Marker& marker = recording.markers.markers[static_cast<size_t>(row.marker)];
    // V_n = n h g, P_n = P_0 + h (V_1 + ... + V_n): n (n + 1) / 2 instead of n^2 / 2.
    const double n = row.frame * substeps;
    const Eigen::Vector3d fallen(marker.s_m, 0, 1 - marker.t_m - 9.81 * h * h * n * (n + 1) / 2);
    largest_m = std::max(largest_m, (row.position_m - fallen).norm());
  }
  EXPECT_LT(largest_m, 1e-12);  // rounding of some thousand steps
}

TEST_F(Simulate, LeavesARecordingOfTheSameClothThatReadsBack) {
  std::ofstream(here_.path() / "path.csv")
      << "time,x,y,z\n0,0.4,0,1\n0.2,0.35,0.05,1\n0.4,0.4,0,1\n";
  write(model_text("[{at: [0, 0], motion: fixed}, {at: [0.4, 0], motion: path, file: path.csv}]",
                   "[{effect: wind, parameters: {q: [0, 0.1, 0]}}]"));

  ASSERT_EQ(run({"sheet.yaml", "--format", "csv"}).exit_code, 0);

  const Recording recording = read_recording(here_.path() / "sheet.simulation");
  EXPECT_EQ(recording.name, "sheet");
  EXPECT_EQ(recording.cloth.mass_kg, 0.02);
  EXPECT_EQ(recording.frame_rate_hz, 50);
  EXPECT_EQ(recording.start, StartKind::released_flat);
  ASSERT_EQ(recording.held.size(), 2u);
  EXPECT_EQ(recording.held[1].motion, HeldMotion::path);
  EXPECT_EQ(read_held_path(*recording.held[1].file).position_m[1], Eigen::Vector3d(0.35, 0.05, 1));
  ASSERT_EQ(recording.declared.size(), 1u);
  const Tracks3d tracks = read_tracks3d(*recording.tracks3d, recording.markers);
  const int corner = recording.markers.index.at("0_8");
  const auto turning = std::ranges::find_if(
      tracks, [&](const Position3d& row) { return row.marker == corner && row.frame == 10; });
  ASSERT_NE(turning, tracks.end());
  EXPECT_LT((turning->position_m - Eigen::Vector3d(0.35, 0.05, 1)).norm(), 1e-9);
}

TEST_F(Simulate, RunsSpringsThatAreGivenTypeByType) {
  std::string text = model_text(kCorners);
  const size_t begin = text.find("fabric:"), end = text.find('\n', begin);
  text.replace(begin, end - begin,
               "springs: {natural_length: [0.05, 0.05, 0.07, 0.07, 0.1, 0.1], stiffness: [20, 20, "
               "10, 10, 5, 5], damping: [0.01, 0.01, 0, 0, 0, 0], critical_elongation: [0.1, 0.1, "
               "0.1, 0.1, 0.2, 0.2]}\nstrain_limit: {mode: consistent}");
  write(text);

  expect_refused({"sheet.yaml", "--mesh", "5x5"}, "those of one mesh");
  expect_refused({"sheet.yaml", "--set", "shear=3"}, "type by type");
  ASSERT_EQ(run({"sheet.yaml"}).exit_code, 0);

  EXPECT_EQ(result()["parameter_set"], "springs");
  EXPECT_TRUE(result()["continuum"].is_null());
  EXPECT_EQ(result()["parameters"][1]["name"], "natural_length_0");
  EXPECT_EQ(result()["strain_limit"]["elongation"][5], 0.2);
  EXPECT_LT(result()["largest_stretch"], 1.2 + 1.1e-3);  // the limit's tolerance is 1e-3
}

TEST_F(Simulate, BeginsInMotionWhereTheModelSays) {
  // A sheet in free flight, 1 m/s upwards
  std::string text = model_text("[]");
  const size_t begin = text.find("start:"), end = text.find('\n', begin);
  text.replace(begin, end - begin, "start: {kind: in_motion, file: start.csv}");
  text.replace(text.find("columns: 9, rows: 7"), 19, "columns: 2, rows: 2");
  std::ofstream(here_.path() / "start.csv")
      << "row,column,x,y,z,vx,vy,vz\n0,0,0,0,1,0,0,1\n0,1,0.4,0,1,0,0,1\n"
         "1,0,0,0.3,1,0,0,1\n1,1,0.4,0.3,1,0,0,1\n";
  write(text);

  ASSERT_EQ(run({"sheet.yaml", "--format", "csv"}).exit_code, 0);

  EXPECT_EQ(result()["start"], "in_motion");
  const Recording recording = read_recording(here_.path() / "sheet.simulation");
  EXPECT_EQ(recording.start, StartKind::unknown);
  const double h = result()["time_step"]["used_s"];
  for (const Position3d& row : read_tracks3d(*recording.tracks3d, recording.markers)) {
    // As a falling sheet, with the velocity of its start
    const double t = 0.02 * row.frame;
    EXPECT_NEAR(row.position_m.z(), 1 + t - 9.81 * t * (t + h) / 2, 1e-12);
  }
  // The result begins in motion too.
  ASSERT_EQ(run({"sheet.simulation", "--format", "csv", "--out", "again"}).exit_code, 0);
  EXPECT_EQ(result("again")["start"], "in_motion");
  EXPECT_EQ(run({"sheet.simulation", "--mesh", "3x3"}).exit_code, 3);
}

TEST_F(Simulate, WritesTheFormatsThatAreAskedFor) {
  write(model_text(kCorners));

  ASSERT_EQ(run({"sheet.yaml"}).exit_code, 0);
  EXPECT_THAT(names_in(here_.path() / "sheet.simulation"),
              ElementsAre(".clothfit", "markers.csv", "model.yaml", "obj", "recording.yaml",
                          "simulation.json", "tracks3d.csv"));
  EXPECT_EQ(names_in(here_.path() / "sheet.simulation" / "obj").size(), 21u);

  ASSERT_EQ(run({"sheet.yaml", "--format", "pc2,gltf"}).exit_code, 0);
  EXPECT_THAT(names_in(here_.path() / "sheet.simulation"),
              ElementsAre(".clothfit", "cloth.glb", "cloth.obj", "cloth.pc2", "model.yaml",
                          "simulation.json"));
  EXPECT_EQ(result()["stop"], "reached_end");
  EXPECT_EQ(result()["time_step"]["chosen_by"], "stability");
  EXPECT_EQ(result()["mesh"]["columns"], 9);
}

TEST_F(Simulate, GivesTheSameBytesAgainAndFromItsOwnModelFile) {
  write(model_text(kCorners));
  ASSERT_EQ(run({"sheet.yaml", "--format", "csv,pc2", "--out", "a"}).exit_code, 0);
  ASSERT_EQ(run({"sheet.yaml", "--format", "csv,pc2", "--out", "b"}).exit_code, 0);
  ASSERT_EQ(run({"a", "--format", "csv,pc2", "--out", "c"}).exit_code, 0);

  const auto text = [&](const std::string& file) {
    std::ifstream in(here_.path() / file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  for (const char* file : {"tracks3d.csv", "cloth.pc2", "recording.yaml", "model.yaml"}) {
    EXPECT_THAT(text(std::string("a/") + file), Not(IsEmpty()));
    EXPECT_TRUE(text(std::string("a/") + file) == text(std::string("b/") + file)) << file;
    EXPECT_TRUE(text(std::string("a/") + file) == text(std::string("c/") + file)) << file;
  }
}

TEST_F(Simulate, KeepsTheObstacleBesideTheResult) {
  fs::create_directories(here_.path() / "scene");
  std::ofstream(here_.path() / "scene" / "floor.obj")
      << "v -2 -2 0.6\nv 2 -2 0.6\nv 2 2 0.6\nv -2 2 0.6\nf 1 2 3 4\n";
  const std::string contact =
      "[{effect: contact_mesh, parameters: {stiffness: 2e4, damping: 20, friction: 0.3}}]";
  write(model_text("[]", contact, "obstacle: scene/floor.obj\n"));
  fs::create_directories(here_.path() / "far");
  const std::string there = (here_.path() / "far" / "sheet").string();

  const ProgramRun done = run({"sheet.yaml", "--format", "csv", "--out", there});

  ASSERT_EQ(done.exit_code, 0) << done.error;
  fs::remove_all(here_.path() / "scene");
  const Recording recording = read_recording(there);
  ASSERT_TRUE(recording.obstacle);
  EXPECT_EQ(recording.obstacle->vertex_m.col(2), Eigen::Vector3d(2, 2, 0.6));
  double lowest_m = 1;
  for (const Position3d& row : read_tracks3d(*recording.tracks3d, recording.markers))
    lowest_m = std::min(lowest_m, row.position_m.z());
  EXPECT_LT(lowest_m, 0.6);  // it touches: its lower edge began at 0.7
  EXPECT_GT(lowest_m, 0.6 - 0.02);
  const auto tracks = [&](const fs::path& folder) {
    std::ifstream in(here_.path() / folder / "tracks3d.csv");
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  ASSERT_EQ(run({there, "--format", "csv", "--out", "again"}).exit_code, 0);
  EXPECT_TRUE(tracks("again") == tracks(there));
}

TEST_F(Simulate, SaysWhenTheClothPassesThroughTheObstacle) {
  std::ofstream(here_.path() / "floor.obj") << "v -2 -2 0\nv 2 -2 0\nv 2 2 0\nf 1 2 3\n";
  write(model_text(kCorners, "[]", "obstacle: floor.obj\n"));

  const ProgramRun done = run({"sheet.yaml", "--format", "csv"});

  EXPECT_EQ(done.exit_code, 0);
  EXPECT_THAT(done.error, HasSubstr("the cloth passes through the obstacle: the effect contact_"));
}

TEST_F(Simulate, RefusesAStepThatIsNotStableAndNamesOneThatIs) {
  write(model_text(kCorners));

  expect_refused({"sheet.yaml", "--time-step", "0.02"}, "--time-step: steps of 0.0200 s would be ");
  const ProgramRun refused = run({"sheet.yaml", "--time-step", "0.02"});
  const std::string hint = "--time-step ";
  const size_t at = refused.error.rfind(hint);
  ASSERT_NE(at, std::string::npos);
  const std::string step =
      refused.error.substr(at + hint.size(), refused.error.find(',', at) - at - hint.size());

  const ProgramRun taken = run({"sheet.yaml", "--time-step", step});

  EXPECT_EQ(taken.exit_code, 0) << taken.error;
  EXPECT_THAT(taken.out, HasSubstr("as asked for"));
  write(model_text(kCorners, "[]", "time_step: 0.01\n"));
  const ProgramRun model = run({"sheet.yaml", "--out", "other"});
  EXPECT_EQ(model.exit_code, 3);
  EXPECT_THAT(model.error, HasSubstr("sheet.yaml:9: steps of 0.0100 s would be unstable"));
}

TEST_F(Simulate, ChoosesAStepAnewWhereTheModelsOwnWasForOtherSprings) {
  write(model_text(kCorners, "[]", "time_step: 0.0002\n"));
  ASSERT_EQ(run({"sheet.yaml", "--format", "pc2"}).exit_code, 0);
  EXPECT_EQ(result()["time_step"]["chosen_by"], "model");

  for (const std::vector<std::string>& change :
       {std::vector<std::string>{"--set", "shear=4000"}, {"--mesh", "25x19"}}) {
    std::vector<std::string> options = {"sheet.yaml", "--format", "pc2", "--duration", "0.1"};
    options.insert(options.end(), change.begin(), change.end());
    const ProgramRun done = run(options);
    ASSERT_EQ(done.exit_code, 0) << done.error;
    EXPECT_EQ(result()["time_step"]["chosen_by"], "stability");
    EXPECT_LT(result()["time_step"]["stable_s"], 0.0002);  // the model's own would not do
  }
}

TEST_F(Simulate, NamesTheSpringStepAndTimeOfADivergenceAndLeavesNothing) {
  write(model_text(kCorners));

  const ProgramRun diverged = run({"sheet.yaml", "--time-step", "0.01", "--allow-unstable"});

  EXPECT_EQ(diverged.exit_code, 4);
  EXPECT_THAT(diverged.error,
              ::testing::ContainsRegex(
                  "the run diverged: in step [0-9]+ \\(frame [0-9]+, t = [0-9.]+ s\\) the "
                  "[a-z]+ spring \\(type [0-5]\\) between nodes \\[[0-9]+, [0-9]+\\] "
                  "and \\[[0-9]+, [0-9]+\\] is [0-9.e+]+ m long, [0-9.e+]+ times "
                  "its natural 0\\.[0-9]+ m; try --time-step 0\\.000"));
  EXPECT_THAT(names_in(here_.path()), ElementsAre("sheet.yaml"));
}

TEST_F(Simulate, ExplainsADivergenceOfTheRunThatWasMade) {
  // The fabric remembers how it was let down: a run from rest goes another way without that.
  std::string text =
      model_text(kCorners, "[{effect: hysteresis, parameters: {ratio: 0.9, yield: 0.002}}]");
  text.replace(text.find("released_flat"), 13, "at_rest");
  write(text);

  const ProgramRun stable = run({"sheet.yaml", "--format", "csv"});
  ASSERT_EQ(stable.exit_code, 0) << stable.error;
  const double step_s = result()["time_step"]["stable_s"];
  const ProgramRun diverged =
      run({"sheet.yaml", "--time-step", std::to_string(3 * step_s), "--allow-unstable"});

  EXPECT_EQ(diverged.exit_code, 4);
  EXPECT_THAT(diverged.error, HasSubstr("try --time-step"));
}

TEST_F(Simulate, SaysHowTheStrainLimitWasKept) {
  for (const std::string mode : {"positions", "rates_first", "consistent"}) {
    SCOPED_TRACE(mode);
    std::string text =
        model_text(kCorners, "[]", "strain_limit: {mode: " + mode + ", elongation: 0.001}\n");
    text.replace(text.find("mass: 0.02"), 10, "mass: 0.5");
    write(text);

    const ProgramRun done = run({"sheet.yaml", "--format", "csv", "--out", mode});

    ASSERT_EQ(done.exit_code, 0) << done.error;
    const nlohmann::json limit = result(mode)["strain_limit"];
    EXPECT_EQ(limit["mode"], mode);
    EXPECT_EQ(limit["elongation"], 0.001);
    const bool one_sweep = mode != "consistent";
    EXPECT_EQ(limit["largest_excess"].get<double>() > 0.01, one_sweep);
    EXPECT_EQ(
        done.error.find("where the strain limit allows 0.100 %: one sweep") != std::string::npos,
        one_sweep);
    if (!one_sweep) {
      EXPECT_LE(limit["largest_excess"].get<double>(), 1e-3 + 1e-9);
    }
  }
}

TEST_F(Simulate, RefusesBadInputWithItsPlace) {
  write(model_text("[{at: [0.5, 0], motion: fixed}]"));
  expect_refused({"sheet.yaml"}, "sheet.yaml:5: held[0].at = [0.5, 0] lies outside the cloth; ");
  write(model_text(kCorners, "[{effect: wnid}]"));
  expect_refused({"sheet.yaml"}, "sheet.yaml:6: there is no effect 'wnid'; known effects: ");
  write(model_text(kCorners, "[{effect: contact_mesh}]"));
  expect_refused({"sheet.yaml"}, "sheet.yaml:6: effect 'contact_mesh' has no obstacle to touch; ");
  write(model_text(kCorners, "[]", "obstacle: table.obj\n"));
  expect_refused({"sheet.yaml"}, "sheet.yaml:9: obstacle = table.obj: there is no such file; ");

  write(model_text(kCorners));
  expect_refused({"sheet.yaml", "--set", "shear=-1"}, "shear: -1 N/m; 0 or more");
  expect_refused({"sheet.yaml", "--set", "sheer=1"}, "did you mean `shear`?");
  expect_refused({"sheet.yaml", "--set", "wnid.c=1"}, "there is no effect 'wnid'");
  expect_refused({"sheet.yaml", "--set", "wind.b=1"}, "effect wind has no parameter 'b'");
  expect_refused({"sheet.yaml", "--duration", "0.001"}, "--duration: 0.001 s at 50 frames");
  expect_refused({"sheet.yaml", "--duration", "1e9"}, "--duration: ");
  expect_refused({"sheet.yaml", "--set", "tension_warp=0", "--set", "tension_weft=0", "--set",
                  "shear=0", "--set", "flexion_warp=0", "--set", "flexion_weft=0"},
                 "every stiffness is 0");
  expect_refused({"--fit", "nothing.fit"}, "nothing.fit");
  expect_refused({"nothing.yaml"}, "nothing.yaml");
  expect_refused({}, "there is nothing to simulate");
  expect_refused({(kBundled / "swing_plain").string()},
                 "a recording has no parameters, and nobody gave tension_warp, ");
}

TEST_F(Simulate, AnswersWrongUsageWithTwo) {
  write(model_text(kCorners));
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{"sheet.yaml", "--format", "fbx"},
        {"sheet.yaml", "--format", ""},
        {"sheet.yaml", "--time-step", "0"},
        {"sheet.yaml", "--time-step", "nan"},
        {"sheet.yaml", "--duration", "-1"},
        {"sheet.yaml", "--duration", "inf"},
        {"sheet.yaml", "--set", "shear"},
        {"sheet.yaml", "--set", "shear=much"},
        {"sheet.yaml", "--mesh", "1x1"}})
    EXPECT_EQ(run(options).exit_code, 2) << ::testing::PrintToString(options);
  EXPECT_THAT(names_in(here_.path()), ElementsAre("sheet.yaml"));
}

TEST_F(Simulate, TakesARecordingWithParametersFromAModelFile) {
  write(model_text(kCorners, "[{effect: viscous_damping, parameters: {rate: 0.5}}]"));

  const ProgramRun done =
      run({(kBundled / "swing_plain").string(), "--model", "sheet.yaml", "--set", "shear=33",
           "--mesh", "9x9", "--duration", "0.2", "--format", "csv"});

  ASSERT_EQ(done.exit_code, 0) << done.error;
  const nlohmann::json json = result("swing_plain.simulation");
  EXPECT_EQ(json["frames"], 13);
  EXPECT_EQ(json["mesh"]["rows"], 9);
  EXPECT_EQ(json["parameters"][3]["value"], 33);
  EXPECT_EQ(json["parameters"][1]["value"], 50);
  EXPECT_EQ(json["effects"][0]["parameters"][0]["value"], 0.5);
  const Recording recording = read_recording(here_.path() / "swing_plain.simulation");
  EXPECT_EQ(recording.cloth.mass_kg, 0.0347);
  EXPECT_EQ(recording.held.size(), 2u);
}

TEST_F(Simulate, NeedsWhatARecordingDeclaresAndLeavesToAFit) {
  fs::copy(kBundled / "swing_plain", here_.path() / "recording", fs::copy_options::recursive);
  const fs::path yaml = here_.path() / "recording" / "recording.yaml";
  std::ifstream in(yaml);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::string from = "declared: []";
  text.replace(text.find(from), from.size(),
               "declared: [{effect: wind, parameters: {q: [0, 0.1, 0]}}]");
  std::ofstream(yaml) << text;
  write(model_text(kCorners));

  const ProgramRun refused = run({"recording", "--model", "sheet.yaml"});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.error, HasSubstr("recording.yaml:19: wind.c is left to a fit"));
  const ProgramRun done = run({"recording", "--model", "sheet.yaml", "--set", "wind.c=0.02",
                               "--mesh", "5x5", "--duration", "0.1", "--format", "csv"});
  EXPECT_EQ(done.exit_code, 0) << done.error;
  EXPECT_EQ(result("swing_plain.simulation")["effects"][0]["parameters"].size(), 4u);
}

}  // namespace
}  // namespace clothfit
