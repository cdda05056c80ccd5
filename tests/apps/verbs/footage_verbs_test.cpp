// Runs `clothfit sheet`, `detect` and `init` from outside: what they write, and that what they
// refuse is named and leaves nothing. What is concluded from footage:
// tests/apps/steps/recording_draft_test.cpp; what pictures show: tests/vision/look_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "data/recording.h"
#include "tests/apps/program_run.h"
#include "tests/apps/scratch_folder.h"
#include "vision/encode/encode_picture.h"
#include "vision/ingest/decode_picture.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using test::names_in;
using test::ProgramRun;
using test::run_program;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class FootageVerbs : public ::testing::Test {
 protected:
  const test::ScratchFolder here_{std::string("footage_") +
                                  ::testing::UnitTest::GetInstance()->current_test_info()->name()};

  ProgramRun run(const std::vector<std::string>& options) const {
    return run_program(options, here_.path());
  }
  /// Expects exit code 3, a message that begins and goes on so, and that nothing new is there.
  void expect_refused(const std::vector<std::string>& options, const std::string& where,
                      const std::string& words) const {
    const std::vector<std::string> before = names_in(here_.path());
    const ProgramRun refused = run(options);
    EXPECT_EQ(refused.exit_code, 3) << refused.error;
    EXPECT_THAT(refused.error, HasSubstr("clothfit: error: " + where + ": "));
    EXPECT_THAT(refused.error, HasSubstr(words));
    EXPECT_THAT(refused.error, HasSubstr("; ")) << "what was expected";
    EXPECT_EQ(names_in(here_.path()), before);
  }
  /// Prints a sheet and films it, so many pictures of it at rest.
  void film(const std::vector<std::string>& what, const std::string& sheet,
            const std::string& folder, int pictures) const {
    std::vector<std::string> options = {"sheet"};
    options.insert(options.end(), what.begin(), what.end());
    for (const std::string& more :
         {std::string("--dpi"), std::string("80"), std::string("--out"), sheet})
      options.push_back(more);
    ASSERT_EQ(run(options).exit_code, 0);
    cv::Mat picture = decode_picture(here_.path() / sheet / "sheet.png").grey;
    cv::copyMakeBorder(picture, picture, 20, 20, 20, 20, cv::BORDER_CONSTANT, cv::Scalar(255));
    cv::GaussianBlur(picture, picture, {}, 1);
    fs::create_directory(here_.path() / folder);
    for (int n = 0; n < pictures; ++n)
      write_png(picture, here_.path() / folder / (std::to_string(n) + ".png"));
  }
};

const std::vector<std::string> kTags = {"tags", "--size", "0.2x0.2", "--grid", "4x4"};
const std::vector<std::string> kDots = {"dots", "--size", "0.2x0.2", "--grid", "6x6"};

TEST_F(FootageVerbs, PrintSheetsAndTheStartOfARecording) {
  const ProgramRun done = run({"sheet", "dots", "--size", "0.3x0.2", "--paper", "A3"});

  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_THAT(names_in(here_.path()), ElementsAre("dots_16x10.sheet"));
  EXPECT_THAT(names_in(here_.path() / "dots_16x10.sheet"),
              ElementsAre("markers.csv", "recording.yaml", "sheet.pdf", "sheet.png", "sheet.svg"));
  const Recording recording = read_recording(here_.path() / "dots_16x10.sheet");
  EXPECT_EQ(recording.markers.kind, MarkerKind::dots);
  EXPECT_EQ(recording.markers.markers.size(), 160U);
  EXPECT_FALSE(recording.frame_rate_hz) << "nobody has measured one";
  expect_refused({"sheet", "dots", "--size", "0.3x0.2"}, "dots_16x10.sheet", "is there already");
}

TEST_F(FootageVerbs, RefuseSheetsThatCannotBePrinted) {
  expect_refused({"sheet", "tags", "--size", "0.3x0x1"}, "--size", "'0.3x0x1'");
  expect_refused({"sheet", "tags", "--size", "300x300"}, "--size", "300 m");
  expect_refused({"sheet", "tags", "--grid", "8"}, "--grid", "COLUMNSxROWS");
  expect_refused({"sheet", "tags", "--first-id", "580"}, "--first-id", "ids within 0 to 586");
  expect_refused({"sheet", "tags", "--tag", "60mm"}, "--tag", "do not fit");
  expect_refused({"sheet", "dots", "--grid", "2x2"}, "--grid", "3 to 64");
  expect_refused({"sheet", "dots", "--grid", "16x8"}, "--grid", "such as 16x16");
  expect_refused({"sheet", "board", "--grid", "3x3"}, "--grid", "4 to 60");
  expect_refused({"sheet", "board", "--square", "20"}, "--square", "20 mm is 0.02");
  expect_refused({"sheet", "tags", "--dpi", "10"}, "--dpi", "50 to 1200");
  expect_refused({"sheet", "tags", "--out", "no/where"}, "no/where", "mkdir -p");
}

TEST_F(FootageVerbs, ListWhatPicturesShow) {
  film(kDots, "d.sheet", "dots", 2);
  const ProgramRun dots = run({"detect", "dots"});
  ASSERT_EQ(dots.exit_code, 0) << dots.error;
  EXPECT_THAT(dots.out, HasSubstr("a pattern of 6 x 6"));
  const auto json =
      nlohmann::json::parse(std::ifstream(here_.path() / "dots.detections" / "detect.json"));
  EXPECT_EQ(json["dots"][0]["named"], 72);

  film(kTags, "t.sheet", "tags", 1);
  const ProgramRun tags = run({"detect", "tags"});
  ASSERT_EQ(tags.exit_code, 0) << tags.error;
  EXPECT_THAT(tags.out, HasSubstr("0 to 15"));
}

TEST_F(FootageVerbs, SayWhatPicturesAreThatShowNothing) {
  fs::create_directory(here_.path() / "blank");
  write_png(cv::Mat(90, 120, CV_8UC1, cv::Scalar(200)), here_.path() / "blank" / "0.png");
  const ProgramRun nothing = run({"detect", "blank"});
  EXPECT_EQ(nothing.exit_code, 4);
  EXPECT_THAT(nothing.error, HasSubstr("blank: 1 picture of 120 x 90 px"));
  EXPECT_THAT(names_in(here_.path()), ElementsAre("blank"));
  expect_refused({"detect", "blank", "--family", "tag99"}, "markers", "unknown tag family");
  expect_refused({"detect", "blank", "--every", "0"}, "--every", "1 or more");
  expect_refused({"detect", "none"}, "none", "there is nothing at this path");
  std::ofstream(here_.path() / "blank" / "0.png") << "no picture";
  expect_refused({"detect", "blank"}, "blank/0.png", "cannot be decoded");
}

TEST_F(FootageVerbs, WriteARecordingOfWhatWasFilmed) {
  film(kDots, "d.sheet", "dots", 4);
  const ProgramRun done =
      run({"init", "dots", "--sheet", "d.sheet", "--frame-rate", "50", "--mass", "32.5g"});
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_THAT(done.out, HasSubstr("36 of the 36 dots"));
  const Recording recording = read_recording(here_.path() / "dots.recording");
  EXPECT_EQ(recording.cloth.mass_kg, 0.0325);
  EXPECT_EQ(recording.frame_rate_hz, 50);
  EXPECT_EQ(recording.markers.kind, MarkerKind::dots);
}

TEST_F(FootageVerbs, RefuseToDescribeAnotherSheetOrHalfOfWhatIsNeeded) {
  film(kTags, "t.sheet", "tags", 2);
  ASSERT_EQ(
      run({"sheet", "tags", "--grid", "2x8", "--size", "0.05x0.2", "--out", "other"}).exit_code, 0);
  ASSERT_EQ(run({"sheet", "board", "--out", "board"}).exit_code, 0);
  const auto init = [](const std::vector<std::string>& options) {
    std::vector<std::string> all = {"init", "tags", "--frame-rate", "50"};
    all.insert(all.end(), options.begin(), options.end());
    return all;
  };
  expect_refused({"init", "tags", "--sheet", "t.sheet"}, "tags", "give --frame-rate");
  expect_refused(init({"--sheet", "other"}), "tags", "neighbours do not lie as it says");
  expect_refused(init({}), "--sheet", "16 tags of tag36h11: 0 to 15");
  expect_refused(init({"--sheet", "board"}), "board", "holds no recording.yaml");
  expect_refused(init({"--sheet", "t.sheet", "--mass", "32 ounces"}), "--mass", "32.5g");
  expect_refused(init({"--sheet", "t.sheet", "--mass", "-1"}), "--mass", "kilograms above 0");
  expect_refused(init({"--sheet", "t.sheet", "--out", "no/where"}), "no/where", "mkdir -p");
  fs::create_directory(here_.path() / "tags.recording");
  expect_refused(init({"--sheet", "t.sheet"}), "tags.recording", "is there already");
}

}  // namespace
}  // namespace clothfit
