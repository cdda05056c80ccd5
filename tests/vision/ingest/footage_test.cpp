// Checks which frames pictures are: by a rate, by times.csv, by the videos themselves.

#include "vision/ingest/footage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/input_error.h"
#include "tests/data/temporary_folder.h"
#include "tests/vision/ingest/written_video.h"
#include "vision/encode/encode_picture.h"

namespace clothfit {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A recording of cameras with videos, or with folders of pictures.
class Footages {
 public:
  Footages() { recording_.folder = folder_.path(); }

  void add_video(const std::string& name, const std::vector<double>& times_s) {
    WrittenVideo video;
    video.times_s = times_s;
    for (size_t n = 0; n < times_s.size(); ++n)
      video.pictures.emplace_back(32, 48, CV_8UC1,
                                  cv::Scalar(40.0 + 10.0 * static_cast<double>(n)));
    add(name, folder_ / (name + ".mp4"));
    write_video(video, folder_ / (name + ".mp4"));
  }
  void add_folder(const std::string& name, const std::vector<int>& numbers) {
    std::filesystem::create_directory(folder_ / name);
    for (const int number : numbers)
      write_png(cv::Mat(32, 48, CV_8UC1, cv::Scalar(40.0 + number)),
                folder_ / name / (std::to_string(number) + ".png"));
    add(name, folder_ / name);
  }
  Recording& recording() { return recording_; }
  void set_times(const std::vector<double>& times_s) {
    recording_.times_file = folder_ / "times.csv";
    recording_.times_s = times_s;
  }

  Footage open() const { return open_footage(recording_, names_); }
  /// Returns the frames of a camera's pictures.
  std::vector<int> frames(const std::string& name) const {
    const Footage footage = open();
    ImageSource& images = *footage.cameras.at(name);
    std::vector<int> frames;
    cv::Mat grey;
    while (images.next(grey)) frames.push_back(images.frame());
    return frames;
  }
  std::string refusal() const {
    try {
      open();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

 private:
  void add(const std::string& name, const std::filesystem::path& images) {
    recording_.cameras.push_back({.name = name, .images = images});
    names_.push_back(name);
  }
  TemporaryFolder folder_;
  Recording recording_;
  std::vector<std::string> names_;
};

const std::vector<double> kUneven{0, 0.02, 0.04, 0.08, 0.1};

TEST(OpenFootage, PutsPicturesOnTheGridOfADeclaredRate) {
  Footages footages;
  footages.add_video("front", kUneven);
  footages.recording().frame_rate_hz = 50;
  EXPECT_THAT(footages.frames("front"), ElementsAre(0, 1, 2, 4, 5));
  EXPECT_THAT(footages.open().findings.at(0).found, HasSubstr("1 of 6 frames have no picture: 3"));
  EXPECT_THAT(footages.open().times_s, IsEmpty());
}

TEST(OpenFootage, RefusesADeclaredRateThatTheVideoContradicts) {
  Footages footages;
  footages.add_video("front", kUneven);
  footages.recording().frame_rate_hz = 60;
  EXPECT_THAT(footages.refusal(), HasSubstr("frame_rate is 60, but"));
  EXPECT_THAT(footages.refusal(), HasSubstr("5 pictures in 0.1 s, 40 per second in the mean, with "
                                            "20 to 40 ms between them"));
}

TEST(OpenFootage, TakesTheTimesOfTheVideosWhereNoneAreDeclared) {
  Footages footages;
  footages.add_video("front", kUneven);
  footages.add_video("side", {0, 0.04, 0.08, 0.1});
  EXPECT_THAT(footages.open().times_s, testing::Pointwise(testing::DoubleNear(1e-9), kUneven));
  EXPECT_THAT(footages.frames("front"), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(footages.frames("side"), ElementsAre(0, 2, 3, 4));
}

TEST(OpenFootage, AsksForTimesThatNoPictureStates) {
  Footages footages;
  footages.add_video("front", kUneven);
  footages.add_folder("side", {0, 1, 2});
  EXPECT_THAT(footages.refusal(), HasSubstr("the pictures of camera 'side' have none"));
}

TEST(OpenFootage, GivesAFolderWithGapsATimeForEachPicture) {
  Footages footages;
  footages.add_folder("front", {0, 1, 3, 4});
  footages.set_times({0, 0.02, 0.06, 0.08});
  EXPECT_THAT(footages.frames("front"), ElementsAre(0, 1, 2, 3));
}

TEST(OpenFootage, MatchesPicturesWithTimesCsv) {
  Footages footages;
  footages.add_video("front", {0, 0.04, 0.08, 0.1});
  footages.add_folder("side", {0, 1, 3});
  footages.set_times(kUneven);
  EXPECT_THAT(footages.frames("front"), ElementsAre(0, 2, 3, 4)) << "by their times";
  EXPECT_THAT(footages.frames("side"), ElementsAre(0, 1, 3)) << "by their numbers";
  footages.add_folder("late", {2, 3, 4});
  EXPECT_THAT(footages.frames("late"), ElementsAre(2, 3, 4)) << "the first two are missing";

  footages.set_times({3, 3.5, 4, 4.5});
  EXPECT_THAT(footages.frames("front"), ElementsAre(0, 1, 2, 3)) << "a time each";
  footages.set_times({3, 3.5, 4, 4.5, 5});
  EXPECT_THAT(footages.frames("front"), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(footages.open().findings.at(0).found, HasSubstr("they are taken in order"));
  footages.set_times({3, 3.5, 4});
  EXPECT_THAT(footages.refusal(), HasSubstr("lists 3 frames, but"));
}

}  // namespace
}  // namespace clothfit
