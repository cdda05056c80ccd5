// Checks videos: times, numbers of pictures, turns, damage and what is refused.

#include "vision/ingest/video_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgproc.hpp>

#include "data/input_error.h"
#include "tests/data/expect_refused.h"
#include "tests/data/file_bytes.h"
#include "tests/data/temporary_folder.h"
#include "tests/vision/ingest/written_video.h"

namespace clothfit {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A picture that shows its number as the place of a bar, on a pattern that takes bits to code.
cv::Mat numbered(int number) {
  cv::Mat grey(96, 128, CV_8UC1);
  cv::RNG random(static_cast<std::uint64_t>(number) + 1);
  random.fill(grey, cv::RNG::UNIFORM, 90, 166);
  cv::GaussianBlur(grey, grey, {}, 2);
  grey(cv::Rect(0, 0, 128, 16)).setTo(0);
  grey(cv::Rect(2 * number, 0, 2, 16)).setTo(255);
  return grey;
}

int number_in(const cv::Mat& grey) {
  cv::Point place;
  cv::minMaxLoc(grey.row(8), nullptr, nullptr, nullptr, &place);
  return place.x / 2;
}

WrittenVideo film(int pictures, double interval_s = 0.04) {
  WrittenVideo video;
  for (int n = 0; n < pictures; ++n) {
    video.pictures.push_back(numbered(n));
    video.times_s.push_back(n * interval_s);
  }
  return video;
}

struct Seen {
  std::vector<int> frames, numbers, damaged;
};

Seen watch(ImageSource& images) {
  Seen seen;
  cv::Mat grey;
  while (images.next(grey)) {
    if (!images.damage().empty()) {
      seen.damaged.push_back(images.frame());
      continue;
    }
    seen.frames.push_back(images.frame());
    seen.numbers.push_back(number_in(grey));
  }
  return seen;
}

TEST(VideoFile, GivesPicturesAndTheTimesOfItsContainer) {
  const TemporaryFolder folder;
  for (const char* name : {"film.mp4", "film.mkv"}) {
    WrittenVideo video = film(8);
    video.times_s = {0, 0.033, 0.067, 0.134, 0.167, 0.2, 0.301, 0.334};
    if (std::string(name) == "film.mkv")
      for (double& time_s : video.times_s) time_s += 1.5;
    write_video(video, folder / name);
    const auto images = open_video(folder / name);
    EXPECT_EQ(images->count(), 8) << name;
    EXPECT_THAT(images->times_s(), testing::Pointwise(testing::DoubleNear(1e-9), video.times_s));
    const Seen seen = watch(*images);
    EXPECT_THAT(seen.frames, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7)) << name;
    EXPECT_THAT(seen.numbers, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7)) << name;
    EXPECT_THAT(images->findings(), IsEmpty()) << name;
  }
}

TEST(VideoFile, SaysOnceThatATurnIsNotApplied) {
  const TemporaryFolder folder;
  WrittenVideo video = film(3);
  video.turn_deg = 90;
  write_video(video, folder / "film.mp4");
  const auto images = open_video(folder / "film.mp4");
  EXPECT_THAT(watch(*images).numbers, ElementsAre(0, 1, 2));
  ASSERT_EQ(images->findings().size(), 1U);
  EXPECT_EQ(images->findings()[0].state, FindingState::passed);
  EXPECT_THAT(images->findings()[0].found, HasSubstr("by 90 degrees clockwise"));
}

TEST(VideoFile, RefusesInterlacedVideo) {
  const TemporaryFolder folder;
  WrittenVideo video = film(4);
  video.interlaced = true;
  write_video(video, folder / "film.mp4");
  expect_refused(folder, "film.mp4: the video is interlaced, top field first",
                 [&] { watch(*open_video(folder / "film.mp4")); });
}

TEST(VideoFile, LeavesDamagedPicturesOutUpToTheNextThatNeedsNoOther) {
  const TemporaryFolder folder;
  write_video(film(40), folder / "film.mkv");
  std::fstream file(folder / "film.mkv", std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(0, std::ios::end);
  const std::streamoff middle = file.tellg() / 2;
  file.seekp(middle);
  file << std::string(300, '\x55');
  file.close();

  const auto images = open_video(folder / "film.mkv");
  const Seen seen = watch(*images);

  // Key pictures are 12 apart, so one group is lost at most, and no wrong picture is given.
  EXPECT_EQ(seen.frames, seen.numbers);
  EXPECT_GE(seen.frames.size(), 40U - 13);
  EXPECT_LT(seen.frames.size(), 40U);
  ASSERT_EQ(images->findings().size(), 1U);
  EXPECT_THAT(images->findings()[0].found, HasSubstr("are damaged and left out"));
}

TEST(VideoFile, TellsOfDamageTheSameWayInEveryRun) {
  const TemporaryFolder folder;
  write_video(film(40), folder / "film.mkv");
  std::string bytes = file_bytes(folder / "film.mkv");
  bytes.replace(bytes.size() / 3, 60, std::string(60, '\x13'));
  write_bytes(bytes, folder / "film.mkv");
  const Seen first = watch(*open_video(folder / "film.mkv"));
  for (int run = 0; run < 5; ++run)
    EXPECT_EQ(watch(*open_video(folder / "film.mkv")).frames, first.frames);
}

TEST(VideoFile, RefusesPicturesThatAreStoredOutOfOrderWithoutATimeEach) {
  const TemporaryFolder folder;
  write_video(film(20), folder / "film.avi");  // of B frames, and a container of one time a packet
  expect_refused(folder, "film.avi: ", [&] { open_video(folder / "film.avi"); });
}

TEST(VideoFile, SaysWhereAVideoBreaksOff) {
  const TemporaryFolder folder;
  write_video(film(40), folder / "film.mkv");
  std::filesystem::resize_file(folder / "film.mkv",
                               std::filesystem::file_size(folder / "film.mkv") * 6 / 10);
  const auto images = open_video(folder / "film.mkv");
  const Seen seen = watch(*images);
  EXPECT_EQ(seen.frames, seen.numbers) << "those before the end of the file are whole";
  EXPECT_GT(seen.frames.size(), 15U);
  ASSERT_FALSE(images->findings().empty());
  EXPECT_THAT(images->findings().back().found, HasSubstr("s before its container states"));
}

TEST(VideoFile, OpensNoOtherFile) {
  const TemporaryFolder folder;
  write_video(film(3), folder / "film.mkv");
  folder.write("list.mp4", "ffconcat version 1.0\nfile 'film.mkv'\n");
  folder.write("list.m3u8", "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nfilm.mkv\n");
  expect_refused(folder, "list.mp4: no picture can be read from it",
                 [&] { open_video(folder / "list.mp4"); });
  expect_refused(folder, "list.m3u8: no picture can be read from it",
                 [&] { open_video(folder / "list.m3u8"); });
}

}  // namespace
}  // namespace clothfit
