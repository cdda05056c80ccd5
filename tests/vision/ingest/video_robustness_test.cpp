// Reads a set of small good and broken videos, whose every picture carries its number, and holds
// times, numbers and grey levels against what is known of them. The set is not bundled:
// CLOTHFIT_DATA names the folder that holds it.

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <opencv2/imgproc.hpp>
#include <set>

#include "data/csv_reader.h"
#include "data/input_error.h"
#include "vision/ingest/open_images.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

fs::path set_folder() {
  const char* data = std::getenv("CLOTHFIT_DATA");
  return data == nullptr ? fs::path() : fs::path(data) / "vision" / "video-robustness";
}

struct TruePicture {
  double time_s = 0;
  int id = 0;
};

/// Returns what other software decoded of each file, in the order shown.
std::map<std::string, std::vector<TruePicture>> true_pictures() {
  enum Column { kFile, kIndex, kTime, kId, kKind };
  CsvReader table(set_folder() / "frames.csv",
                  {{"file"}, {"index"}, {"pts_s"}, {"burnt_in_id"}, {"pict_type"}});
  std::map<std::string, std::vector<TruePicture>> pictures;
  while (table.next())
    pictures[std::string(table.text(kFile))].push_back(
        {table.number(kTime), table.whole_number(kId, 0)});
  return pictures;
}

/// Reads the number that a picture carries: 12 grey blocks, least bit first.
int id_of(const cv::Mat& grey) {
  int id = 0;
  for (int bit = 0; bit < 12; ++bit)
    if (cv::mean(grey(cv::Rect(8 + 20 * bit + 4, 8, 8, 8)))[0] > 160) id |= 1 << bit;
  return id;
}

/// Returns how far the 16 levels of the ramp at the bottom are from 0, 17, ..., 255 at most.
double ramp_error(const cv::Mat& grey) {
  const int step = (grey.cols + 15) / 16;
  double worst = 0;
  for (int r = 0; r < 16; ++r) {
    const double level =
        cv::mean(grey(cv::Rect(std::min(step * r + 8, grey.cols - 5), grey.rows - 10, 4, 4)))[0];
    worst = std::max(worst, std::abs(level - 17 * r));
  }
  return worst;
}

class VideoRobustness : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!fs::exists(set_folder() / "frames.csv"))
      GTEST_SKIP() << "CLOTHFIT_DATA names no folder with vision/video-robustness";
  }
  static fs::path file() { return set_folder() / GetParam(); }
};

/// Says that every picture is given, with its own number and time.
void expect_whole(const fs::path& file) {
  const std::vector<TruePicture> truth = true_pictures().at(file.filename().string());
  const auto images = open_images(file);
  ASSERT_EQ(images->count(), static_cast<int>(truth.size()));
  const std::vector<double> times_s = images->times_s();
  cv::Mat grey;
  for (size_t n = 0; n < truth.size(); ++n) {
    ASSERT_TRUE(images->next(grey)) << n;
    EXPECT_EQ(images->damage(), "") << n;
    EXPECT_EQ(images->frame(), static_cast<int>(n));
    EXPECT_EQ(id_of(grey), truth[n].id) << n;
    EXPECT_NEAR(times_s[n], truth[n].time_s, 1e-6) << n;
    EXPECT_LT(ramp_error(grey), 3) << n;
  }
  EXPECT_FALSE(images->next(grey));
}

class WholeVideo : public VideoRobustness {};
TEST_P(WholeVideo, GivesEveryPictureAtItsTime) {
  expect_whole(file());
  for (const auto& finding : open_images(file())->findings())
    EXPECT_EQ(finding.state, FindingState::passed) << finding.found;
}
INSTANTIATE_TEST_SUITE_P(
    Files, WholeVideo,
    testing::Values("good_h264_cfr30.mp4", "bframes_h264.mp4", "ntsc_2997_h264.mp4", "vfr_h264.mp4",
                    "vfr_jitter_h264.mkv", "rotate90_flag.mp4", "rotate180_flag.mp4",
                    "editlist_trim.mp4", "start_offset_1500ms.mkv", "mpegts.ts", "mpeg4.avi",
                    "mjpeg.avi", "ffv1_gray.mkv", "vp9.webm", "hevc.mp4", "h264_10bit.mp4",
                    "h264_fullrange.mp4", "h264_odd_321x241_444.mp4", "with_audio.mp4",
                    "one_frame.mp4"));

class UnreadableVideo : public VideoRobustness {};
TEST_P(UnreadableVideo, IsRefused) {
  try {
    open_images(file());
    ADD_FAILURE() << "was opened";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("picture can be read"));
  }
}
INSTANTIATE_TEST_SUITE_P(Files, UnreadableVideo,
                         testing::Values("truncated_60pct_no_moov.mp4", "zero_frames.mp4",
                                         "empty_file.mp4", "not_a_video.mp4", "audio_only.mp4"));

class DamagedVideo : public VideoRobustness {
 protected:
  /// Reads the file; notes the numbers of pictures that were given as whole, by frame.
  void read() {
    const auto images = open_images(file());
    cv::Mat grey;
    while (images->next(grey))
      if (images->damage().empty()) ids_[images->frame()] = id_of(grey);
    for (const Finding& finding : images->findings()) said_ += finding.found + "\n";
  }
  std::map<int, int> ids_;
  std::string said_;
};

TEST_P(DamagedVideo, GivesNoWrongPictureAndNamesThoseLeftOut) {
  read();
  const std::string name = GetParam();
  if (name == "corrupt_middle.mp4") {
    for (int n = 0; n < 60; ++n) EXPECT_EQ(ids_.count(n), n < 24 || n > 35 ? 1U : 0U) << n;
    EXPECT_THAT(said_, HasSubstr("12 of 60 pictures are damaged and left out: 24 to 35"));
  } else if (name == "ts_missing_packets.ts") {
    EXPECT_GE(ids_.size(), 26U);
    EXPECT_LT(ids_.rbegin()->first, 30) << "all later ones are made up by the decoder";
    EXPECT_THAT(said_, HasSubstr("damaged and left out"));
  } else {
    EXPECT_EQ(ids_.size(), 34U);
    EXPECT_THAT(said_, HasSubstr("breaks off after 34 of 60 pictures"));
  }
  for (const auto& [frame, id] : ids_) EXPECT_EQ(id, frame);
}
INSTANTIATE_TEST_SUITE_P(Files, DamagedVideo,
                         testing::Values("corrupt_middle.mp4", "ts_missing_packets.ts",
                                         "truncated_60pct_faststart.mp4"));

class InterlacedVideo : public VideoRobustness {};
TEST_P(InterlacedVideo, IsRefused) {
  try {
    open_images(file());
    ADD_FAILURE() << "was opened";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("interlaced, top field first"));
  }
}
INSTANTIATE_TEST_SUITE_P(Files, InterlacedVideo, testing::Values("interlaced_tff.mp4"));

}  // namespace
}  // namespace clothfit
