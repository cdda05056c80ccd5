// Checks frames by times: the grid of a rate, its tolerance, and cameras with clocks of their own.

#include "vision/ingest/frame_times.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "data/input_error.h"

namespace clothfit {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Times of frames at a rate, rounded as containers do.
std::vector<double> even(int frames, double rate_hz, double tick_s = 1e-6, double start_s = 0) {
  std::vector<double> times_s;
  for (int f = 0; f < frames; ++f)
    times_s.push_back(std::round((start_s + f / rate_hz) / tick_s) * tick_s);
  return times_s;
}

FrameNumbers number(const std::vector<double>& times_s, double rate_hz) {
  return number_by_rate(times_s, rate_hz, "film.mp4", "recording.yaml");
}

std::string refusal(const std::vector<double>& times_s, double rate_hz) {
  try {
    number(times_s, rate_hz);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(NumberByRate, AcceptsARateInTicksOfAMillisecond) {
  for (const double rate_hz : {24.0, 30.0, 59.94, 120.0, 240.0}) {
    const FrameNumbers numbers = number(even(500, rate_hz, 1e-3, 1.5), rate_hz);
    for (int f = 0; f < 500; ++f) EXPECT_EQ(numbers.frame_of_picture[static_cast<size_t>(f)], f);
    EXPECT_THAT(numbers.findings, IsEmpty());
  }
}

TEST(NumberByRate, LeavesFramesEmptyThatACameraDropped) {
  std::vector<double> times_s = even(8, 60);
  times_s.erase(times_s.begin() + 5);
  times_s.erase(times_s.begin() + 2);
  const FrameNumbers numbers = number(times_s, 60);
  EXPECT_THAT(numbers.frame_of_picture, ElementsAre(0, 1, 3, 4, 6, 7));
  ASSERT_EQ(numbers.findings.size(), 1U);
  EXPECT_THAT(numbers.findings[0].found, HasSubstr("2 of 8 frames have no picture: 2, 5"));
}

TEST(NumberByRate, RefusesAnotherRateWithBothNumbers) {
  for (const double stated_hz : {30.0, 59.0, 61.0, 120.0, 47.5}) {
    const std::string text = refusal(even(200, stated_hz), 60);
    EXPECT_THAT(text, HasSubstr("frame_rate is 60")) << stated_hz;
    EXPECT_THAT(text, HasSubstr("per second in the mean")) << stated_hz;
  }
  EXPECT_THAT(refusal(even(72, 30), 240), HasSubstr("plays slower than it was filmed"));
}

TEST(NumberByRate, RefusesNtscForThirtyOnceItIsATenthOfAFrameOff) {
  // 30 against 30000/1001: 1/1001 of an interval per frame, half of it to either side of the
  // middle.
  const double ntsc_hz = 30000.0 / 1001;
  EXPECT_EQ(refusal(even(120, ntsc_hz), 30), "");
  EXPECT_THAT(refusal(even(400, ntsc_hz), 30), HasSubstr("29.97 per second in the mean"));
}

TEST(NumberByRate, RefusesTimesThatJitter) {
  std::vector<double> times_s = even(60, 30);
  for (size_t f = 0; f < 60; ++f) times_s[f] += 0.012 * std::sin(1.7 * static_cast<double>(f));
  EXPECT_THAT(refusal(times_s, 30), HasSubstr("leave `time` out"));
}

TEST(NumberByRate, TakesASinglePicture) {
  EXPECT_THAT(number({1.5}, 30).frame_of_picture, ElementsAre(0));
}

TEST(JoinTimes, FindsAPictureThatOneCameraDropped) {
  const std::vector<double> whole_s = even(6, 50, 1e-6, 2);
  std::vector<double> dropped_s = whole_s;
  dropped_s.erase(dropped_s.begin() + 3);
  const JointTimes joint = join_times({{"a", dropped_s}, {"b", whole_s}}, "recording.yaml");
  EXPECT_EQ(joint.times_s, whole_s);
  EXPECT_THAT(joint.frame_of_picture.at("a"), ElementsAre(0, 1, 2, 4, 5));
  EXPECT_THAT(joint.frame_of_picture.at("b"), ElementsAre(0, 1, 2, 3, 4, 5));
}

TEST(JoinTimes, CountsClocksThatStartApartFromTheirFirstPictures) {
  const JointTimes joint =
      join_times({{"a", even(6, 50)}, {"b", even(5, 50, 1e-3, 1.5)}}, "recording.yaml");
  EXPECT_THAT(joint.frame_of_picture.at("b"), ElementsAre(0, 1, 2, 3, 4));
}

TEST(JoinTimes, RefusesCamerasThatTakePicturesApart) {
  EXPECT_THROW(join_times({{"a", even(60, 50)}, {"b", even(36, 30)}}, "recording.yaml"),
               InputError);
}

TEST(NumberByTimes, TakesTheNearestFrameOrNone) {
  const std::vector<double> frames_s{0, 0.02, 0.05, 0.07};
  const auto found = number_by_times(frames_s, {0.001, 0.049, 0.071});
  ASSERT_TRUE(found);
  EXPECT_THAT(*found, ElementsAre(0, 2, 3));
  EXPECT_FALSE(number_by_times(frames_s, {0, 0.035, 0.07}));
}

TEST(JoinTimes, KeepsTheFramesThatEachOfTwoCamerasDropped) {
  const std::vector<double> whole_s = even(8, 50);
  std::vector<double> a_s = whole_s, b_s = whole_s;
  a_s.erase(a_s.begin() + 2);
  b_s.erase(b_s.begin() + 5);
  const JointTimes joint = join_times({{"a", a_s}, {"b", b_s}}, "recording.yaml");
  EXPECT_EQ(joint.times_s, whole_s);
  EXPECT_THAT(joint.frame_of_picture.at("a"), ElementsAre(0, 1, 3, 4, 5, 6, 7));
  EXPECT_THAT(joint.frame_of_picture.at("b"), ElementsAre(0, 1, 2, 3, 4, 6, 7));
  EXPECT_TRUE(joint.findings.empty());
}

TEST(JoinTimes, SayWhatOffsetTheyAssume) {
  const JointTimes joint =
      join_times({{"a", even(6, 50)}, {"b", even(5, 50, 1e-3, 1.5)}}, "recording.yaml");
  ASSERT_EQ(joint.findings.size(), 1U);
  EXPECT_NE(joint.findings[0].found.find("1.5 s apart"), std::string::npos)
      << joint.findings[0].found;
}

}  // namespace
}  // namespace clothfit
