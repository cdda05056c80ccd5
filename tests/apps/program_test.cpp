// Checks the program's answers to wrong usage and bad input: exit code, message, nothing left
// behind. Each reader's own refusals in detail: tests/data. Whole runs:
// program_end_to_end_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>

#include "data/camera_parameters.h"
#include "tests/apps/bundled_recordings.h"
#include "tests/apps/program_run.h"
#include "tests/apps/scratch_folder.h"
#include "vision/encode/encode_picture.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using test::names_in;
using test::ProgramRun;
using test::run_program;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::MatchesRegex;

void write_text(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

/// Writes recording.yaml of a small recording with pictures; `cloth` and `more` are put in as they
/// are.
std::string picture_recording(const std::string& camera,
                              const std::string& cloth = "{size: [0.4, 0.4], mass: 0.03}") {
  return "format: clothfit-recording/1\n"
         "name: small\n"
         "origin: made for a test\n"
         "cloth: " +
         cloth +
         "\n"
         "markers: {kind: apriltag, family: tag36h11, file: markers.csv}\n"
         "time: {frame_rate: 60.0}\n"
         "gravity: [0.0, 0.0, -9.81]\n"
         "cameras:\n"
         "  - " +
         camera +
         "\n"
         "observations: {}\n"
         "held: [{at: [0.0, 0.0], motion: fixed}]\n"
         "start: released_flat\n"
         "declared: []\n";
}

void write_grey_picture(const fs::path& file, int width, int height) {
  fs::create_directories(file.parent_path());
  write_png(cv::Mat(height, width, CV_8UC1, cv::Scalar(128)), file);
}

/// A folder to run in, with a recording beside it that a test spoils.
class Program : public ::testing::Test {
 protected:
  const test::ScratchFolder scratch_{
      std::string("program_") + ::testing::UnitTest::GetInstance()->current_test_info()->name()};
  const fs::path recording_ = scratch_.path() / "recording";
  const fs::path here_ = scratch_.path() / "here";
  void SetUp() override {
    fs::create_directories(here_);
    fs::create_directories(recording_);
  }

  /// Copies a bundled recording of tracks to spoil.
  void copy_bundled(const std::string& name) {
    fs::copy(kBundled / name, recording_,
             fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  }

  /// Replaces the first `from` in recording.yaml.
  void spoil_yaml(const std::string& from, const std::string& to) {
    std::ifstream in(recording_ / "recording.yaml");
    std::string text{std::istreambuf_iterator<char>(in), {}};
    const size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    write_text(recording_ / "recording.yaml", text);
  }

  /// Runs a verb on the recording; expects a refusal that says `message` and leaves nothing.
  void expect_refused(const std::string& verb, const std::string& message) {
    const ProgramRun run = run_program({verb, recording_.string()}, here_);
    EXPECT_EQ(run.exit_code, 3) << run.error;
    EXPECT_THAT(run.error, HasSubstr(message));
    EXPECT_THAT(names_in(here_), IsEmpty());
  }
};

TEST_F(Program, AnswersWrongUsageWithTwo) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{},
        {"nonsense"},
        {"fit"},
        {"fit", "a", "--no-such-option"},
        {"fit", "a", "--mesh", "17"},
        {"fit", "a", "--mesh", "1x1"},
        {"fit", "a", "--mesh", "4294967313x17"},
        {"fit", "a", "--mesh", "60000x60000"},
        {"fit", "a", "--seed", "x"},
        {"fit", "a", "--observations", "sounds"},
        {"fit", "a", "--search", "grid"},
        {"fit", "a", "--loss", "cubic"},
        {"fit", "a", "--springs", "louchet6"},
        {"fit", "a", "--resume"},
        {"fit", "a", "--start", "a.json", "--forecast", "b.json"},
        {"study", "foreign"},
        {"recover", "--tags", "4"},
        {"recover", "--render", "--markers", "4"},
        {"recover", "--render", "--picture", "640"},
        {"calibrate", "a", "--board", "chessboard:9x6"},
        {"calibrate", "a", "--board", "chessboard:2x2:0.1"},
        {"calibrate", "a", "--name", "../b"},
        {"calibrate", "a", "--model", "fisheye"}}) {
    const ProgramRun run = run_program(arguments, here_);
    EXPECT_EQ(run.exit_code, 2) << ::testing::PrintToString(arguments) << run.error;
    EXPECT_FALSE(run.error.empty());
  }
  EXPECT_THAT(names_in(here_), IsEmpty());
}

TEST_F(Program, NamesTheNearestVerb) {
  const ProgramRun run = run_program({"fitt", "a"}, here_);

  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.error, HasSubstr("did you mean `fit`?"));
}

TEST_F(Program, ExplainsEveryVerbWithAnExample) {
  for (const char* verb : {"calibrate", "track", "fit", "simulate", "experiment", "demo"}) {
    const ProgramRun run = run_program({verb, "--help"}, here_);
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_THAT(run.out, HasSubstr("Example"));
    EXPECT_THAT(run.out, HasSubstr(std::string("clothfit ") + verb));
  }
}

TEST_F(Program, TellsItsVersion) {
  const ProgramRun run = run_program({"--version"}, here_);

  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.out, MatchesRegex("clothfit [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

TEST_F(Program, RefusesARecordingThatIsNotThere) {
  for (const char* verb : {"fit", "track", "calibrate"}) expect_refused(verb, "recording");
}

TEST_F(Program, RefusesAnUnknownKeyAndNamesTheLineAndTheNearestKey) {
  copy_bundled("swing_plain");
  spoil_yaml("gravity:", "gravty:");

  expect_refused("fit", "recording.yaml:11: ");
  expect_refused("fit", "gravity");
}

TEST_F(Program, RefusesADeclaredEffectWithoutSuchAParameterAndNamesTheLine) {
  copy_bundled("swing_plain");
  spoil_yaml("declared: []", "declared: [{effect: wind, parameters: {speed: 3}}]");

  expect_refused("fit", "recording.yaml:19: effect wind has no parameter 'speed'");
}

TEST_F(Program, RefusesAClothWithoutRows) {
  copy_bundled("swing_plain");
  spoil_yaml("rows: 17", "rows: 0");

  expect_refused("fit", "recording.yaml:");
}

TEST_F(Program, RefusesAMarkerOutsideTheCloth) {
  copy_bundled("swing_plain");
  write_text(recording_ / "markers.csv", "marker,s,t\n0,0.1,0.1\n1,0.9,0.1\n");

  expect_refused("fit", "markers.csv:3: ");
}

TEST_F(Program, RefusesNanInTracks) {
  copy_bundled("swing_plain");
  fs::remove(recording_ / "tracks3d.csv.gz");
  spoil_yaml("tracks3d.csv.gz", "tracks3d.csv");
  write_text(recording_ / "tracks3d.csv", "frame,marker,x,y,z\n0,0,0.1,nan,0.2\n");

  expect_refused("fit", "tracks3d.csv:2: ");
}

TEST_F(Program, RefusesAFrameNumberThatIsOnlyMistyped) {
  copy_bundled("swing_plain");
  fs::remove(recording_ / "tracks3d.csv.gz");
  spoil_yaml("tracks3d.csv.gz", "tracks3d.csv");
  write_text(recording_ / "tracks3d.csv",
             "frame,marker,x,y,z\n0,m00_00,0,0,0\n2000000000,m00_00,0,0,0\n");

  expect_refused("fit", "tracks3d.csv:3: frame 2000000000 comes next after frame 0");
}

TEST_F(Program, RefusesAMissingColumn) {
  copy_bundled("swing_plain");
  fs::remove(recording_ / "tracks3d.csv.gz");
  spoil_yaml("tracks3d.csv.gz", "tracks3d.csv");
  write_text(recording_ / "tracks3d.csv", "frame,marker,x,y\n0,0,0.1,0.2\n");

  expect_refused("fit", "tracks3d.csv:1: ");
}

TEST_F(Program, ChecksARecordingAgainstItself) {
  copy_bundled("swing_plain");
  // A folder of the user's with any name is in nobody's way.
  fs::create_directories(here_ / (recording_.filename().string() + ".check"));
  const ProgramRun sound = run_program({"check", recording_.string()}, here_);
  EXPECT_EQ(sound.exit_code, 0) << sound.error;
  EXPECT_THAT(sound.out, HasSubstr("ok       units"));
  EXPECT_THAT(sound.out, HasSubstr("Nothing contradicts"));

  spoil_yaml("mass: 0.0347", "mass: 34.7");
  const ProgramRun wrong = run_program({"check", recording_.string()}, here_);
  EXPECT_EQ(wrong.exit_code, 3);
  EXPECT_THAT(wrong.out, HasSubstr("WRONG    mass"));
  EXPECT_THAT(wrong.out, HasSubstr("is it in grams? give kilograms"));
  EXPECT_EQ(names_in(here_).size(), 1u);
}

TEST_F(Program, FitsAndDiagnosesNothingThatContradictsItself) {
  copy_bundled("swing_plain");
  spoil_yaml("gravity: [0.0, 0.0, -9.81]", "gravity: [0.0, 0.0, 9.81]");
  for (const char* verb : {"fit", "diagnose"}) {
    const ProgramRun run = run_program({verb, recording_.string()}, here_);
    EXPECT_EQ(run.exit_code, 3) << verb;
    EXPECT_THAT(run.error, HasSubstr("recording.yaml: ")) << verb;
    EXPECT_THAT(run.error, HasSubstr("gravity turned round, [0, 0, -9.81],")) << verb;
    EXPECT_THAT(names_in(here_), IsEmpty()) << verb;
  }
}

TEST_F(Program, RefusesAnEmptyFolderOfPictures) {
  write_text(recording_ / "recording.yaml", picture_recording("{name: front, images: frames}"));
  write_text(recording_ / "markers.csv", "marker,s,t,tag,corner\na,0.1,0.1,0,0\n");
  fs::create_directories(recording_ / "frames");

  expect_refused("track", "frames");
}

TEST_F(Program, RefusesAVideoWithoutFrames) {
  write_text(recording_ / "recording.yaml", picture_recording("{name: front, images: cut.mp4}"));
  write_text(recording_ / "markers.csv", "marker,s,t,tag,corner\na,0.1,0.1,0,0\n");
  write_text(recording_ / "cut.mp4", "");

  expect_refused("track", "cut.mp4");
}

TEST_F(Program, RefusesACameraOfAnotherSizeThanThePictures) {
  write_text(recording_ / "recording.yaml",
             picture_recording("{name: front, file: front.yaml, images: frames}"));
  write_text(recording_ / "markers.csv", "marker,s,t,tag,corner\na,0.1,0.1,0,0\n");
  write_grey_picture(recording_ / "frames" / "000000.png", 320, 240);
  CameraParameters camera;
  camera.name = "front";
  camera.image_width = 640;
  camera.image_height = 480;
  camera.focal_px = {600, 600};
  camera.centre_px = {319.5, 239.5};
  camera.camera_from_world = CameraPose{};
  write_camera(camera, recording_ / "front.yaml");

  // The message names the user's file, not its copy in the folder that is gone afterwards.
  expect_refused("track", (recording_ / "front.yaml").string() + ": ");
  expect_refused("track", "640 x 480 px");
  expect_refused("fit", "320 x 240 px");
}

TEST_F(Program, RefusesATagFamilyThatNeverAppears) {
  write_text(recording_ / "recording.yaml", picture_recording("{name: front, images: frames}"));
  write_text(recording_ / "markers.csv", "marker,s,t,tag,corner\na,0.1,0.1,0,0\n");
  write_grey_picture(recording_ / "frames" / "000000.png", 320, 240);

  expect_refused("track", "tag36h11");
}

TEST_F(Program, RefusesAFitWhenNothingSaysWhereTheCameraStands) {
  copy_bundled("swing_plain");
  CameraParameters camera = read_camera(recording_ / "cameras" / "front.yaml");
  camera.camera_from_world.reset();
  write_camera(camera, recording_ / "cameras" / "front.yaml");

  const ProgramRun run =
      run_program({"fit", recording_.string(), "--observations", "tracks2d"}, here_);

  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.error, HasSubstr("camera_from_world"));
  EXPECT_THAT(names_in(here_), IsEmpty());
}

TEST_F(Program, RefusesStillsWithoutTheBoard) {
  write_grey_picture(recording_ / "0.png", 320, 240);

  const ProgramRun run =
      run_program({"calibrate", recording_.string(), "--board", "chessboard:9x6:0.025"}, here_);

  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.error, HasSubstr("none of the 1 stills shows the whole board"));
  EXPECT_THAT(names_in(here_), IsEmpty());
}

TEST_F(Program, RefusesStillsOfAnotherSizeThanThePictures) {
  write_text(recording_ / "recording.yaml",
             picture_recording("{name: front, images: frames, calibration: {images: stills, board: "
                               "{kind: chessboard, columns: 9, rows: 6, square: 0.025}}}"));
  write_text(recording_ / "markers.csv", "marker,s,t,tag,corner\na,0.1,0.1,0,0\n");
  write_grey_picture(recording_ / "frames" / "000000.png", 320, 240);
  write_grey_picture(recording_ / "stills" / "0.png", 640, 480);

  expect_refused("calibrate", "320 x 240 px");
}

TEST_F(Program, NeverWritesOverACheckpoint) {
  copy_bundled("swing_plain");
  write_text(here_ / "search.txt", "hours of searching");

  const ProgramRun run =
      run_program({"fit", recording_.string(), "--checkpoint", "search.txt"}, here_);

  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.error, HasSubstr("search.txt exists already"));
  EXPECT_THAT(run.error, HasSubstr("--resume"));
  EXPECT_THAT(names_in(here_), ::testing::ElementsAre("search.txt"));

  const ProgramRun resumed =
      run_program({"fit", recording_.string(), "--checkpoint", "search.txt", "--resume"}, here_);
  EXPECT_EQ(resumed.exit_code, 3);
  EXPECT_THAT(resumed.error, HasSubstr("search.txt:1: is no checkpoint of a search"));
}

TEST_F(Program, NeverWritesOverTheJournalOfAStudy) {
  copy_bundled("swing_plain");
  write_text(here_ / "hours", "of fits");

  const ProgramRun run =
      run_program({"study", "recordings", recording_.string(), "--journal", "hours"}, here_);

  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.error, HasSubstr("hours"));
  EXPECT_THAT(run.error, HasSubstr("--resume"));
  EXPECT_THAT(names_in(here_), ::testing::ElementsAre("hours"));
}

TEST_F(Program, RefusesToDiagnoseWhatNothingJudges) {
  copy_bundled("swing_plain");
  const auto refusal = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"diagnose", recording_.string()});
    const ProgramRun run = run_program(more, here_);
    EXPECT_EQ(run.exit_code, 3);
    return run.error;
  };

  EXPECT_THAT(refusal({"--whole"}), HasSubstr("--whole: no recording judges"));
  EXPECT_THAT(refusal({"--held-out", recording_.string()}), HasSubstr("is named twice"));
  EXPECT_THAT(names_in(here_), IsEmpty());
}

TEST_F(Program, KnowsLengthsByTheirUnit) {
  copy_bundled("swing_plain");
  const auto fit_with_offsets = [&](const char* length) {
    return run_program(
        {"fit", recording_.string(), "--observations", "tracks2d", "--marker-offsets", length},
        here_);
  };

  EXPECT_EQ(fit_with_offsets("10feet").exit_code, 2);
  EXPECT_EQ(fit_with_offsets("-3mm").exit_code, 3);
  EXPECT_THAT(fit_with_offsets("-3mm").error, HasSubstr("--marker-offsets"));
  const ProgramRun of_pixels = fit_with_offsets("10mm");
  EXPECT_EQ(of_pixels.exit_code, 3);
  EXPECT_THAT(of_pixels.error, HasSubstr("the fit looks at pixels"));
}

TEST_F(Program, NeverReplacesAFolderOfTheUsers) {
  copy_bundled("swing_plain");
  write_text(here_ / "mine" / "thesis.txt", "years of work");

  const ProgramRun run = run_program({"fit", recording_.string(), "--out", "mine"}, here_);

  EXPECT_EQ(run.exit_code, 3);
  EXPECT_TRUE(fs::exists(here_ / "mine" / "thesis.txt"));
}

}  // namespace
}  // namespace clothfit
