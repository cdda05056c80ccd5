// Checks the rows, counts and refusals of a whole recording of a texture. Places and sigma are in
// texture_tracker_test.cpp.

#include "vision/track/track_texture.h"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <numeric>

#include "data/input_error.h"
#include "tests/data/temporary_folder.h"
#include "tests/vision/drawn_texture.h"
#include "vision/encode/encode_picture.h"
#include "vision/track/track.h"

namespace clothfit {
namespace {

constexpr int kMarkersAcross = 3;

/// A texture that shifts by 2 px a frame, with pictures of frames 0, 1, 2, 4 and 5: frame 2 is
/// black.
class TextureRecording : public ::testing::Test {
 protected:
  TextureRecording() {
    std::filesystem::create_directories(folder_ / "frames");
    for (const int frame : {0, 1, 2, 4, 5}) {
      const cv::Mat picture = texture_.draw(
          {110, 100},
          [&](const Eigen::Vector2d& y) -> Eigen::Vector2d {
            return y - Eigen::Vector2d(2 * frame, 0);
          },
          1, 40 + static_cast<std::uint64_t>(frame),
          [&](const auto&, double level) { return frame == 2 ? 0 : level; });
      write_png(picture, folder_ / fmt::format("frames/{}.png", frame));
    }
    recording_.folder = folder_.path();
    recording_.frame_rate_hz = 60;
    recording_.cloth.width_m = recording_.cloth.height_m = 0.1;
    recording_.markers_file = folder_ / "markers.csv";
    recording_.start = StartKind::unknown;
    recording_.markers.kind = MarkerKind::texture;
    std::ofstream rows(folder_ / "front.csv");
    rows << "frame,marker,u,v\n";
    for (int m = 0; m < kMarkersAcross * kMarkersAcross; ++m) {
      const std::string name = fmt::format("m{}", m);
      const int u = 30 + 20 * (m % kMarkersAcross), v = 30 + 20 * (m / kMarkersAcross);
      recording_.markers.index[name] = m;
      recording_.markers.markers.push_back(
          {.name = name, .s_m = 1e-3 * u, .t_m = 1e-3 * v, .tag = {}, .corner = {}});
      rows << "0," << name << ',' << u << ',' << v << '\n';
    }
    recording_.tracks2d["front"] = folder_ / "front.csv";
    recording_.cameras.push_back(
        {.name = "front", .file = {}, .images = folder_ / "frames", .calibration = {}});
  }
  TrackResult tracked() { return track(recording_, recording_.cameras[0], {}, {}); }
  void expect_refusal_of(const std::string& text) {
    try {
      tracked();
      ADD_FAILURE() << "was accepted, not refused with " << text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(text));
    }
  }

  DrawnTexture texture_{21};
  TemporaryFolder folder_;
  Recording recording_;
};

TEST_F(TextureRecording, HasARowOrACountForEveryMarkerAndFrame) {
  const TrackResult result = tracked();
  ASSERT_TRUE(result.usable) << result.message;
  constexpr int kMarkers = kMarkersAcross * kMarkersAcross, kFrames = 6;
  EXPECT_EQ(result.frames, kFrames);
  EXPECT_EQ(result.missing.at("no_picture"), kMarkers);
  EXPECT_EQ(result.missing.at("dark"), kMarkers);
  const int missing = std::accumulate(result.missing.begin(), result.missing.end(), 0,
                                      [](int sum, const auto& one) { return sum + one.second; });
  EXPECT_EQ(static_cast<int>(result.tracks.size()) + missing, kMarkers * kFrames);
  EXPECT_EQ(result.tracks.size(), 4U * kMarkers);
  for (const Position2d& row : result.tracks) {
    const Marker& marker = recording_.markers.markers[static_cast<size_t>(row.marker)];
    EXPECT_NEAR(row.position_px.x(), 1e3 * marker.s_m + 2 * row.frame, 0.1);
    EXPECT_NEAR(row.position_px.y(), 1e3 * marker.t_m, 0.1);
    EXPECT_GT(row.sigma_px, 0);
  }
  EXPECT_FALSE(result.overlay.empty());
}

TEST_F(TextureRecording, IsRefusedWithoutAWholePictureOfFrame0) {
  std::ofstream(folder_ / "frames/0.png", std::ios::trunc) << "no picture";
  expect_refusal_of("the picture of frame 0 is damaged");
}

TEST_F(TextureRecording, IsRefusedWithoutTexture) {
  write_png(cv::Mat(100, 110, CV_8UC1, cv::Scalar(130)), folder_ / "frames/0.png");
  expect_refusal_of("no marker has enough texture around it in the picture of frame 0");
}

TEST_F(TextureRecording, IsRefusedWithReferenceTagsOfNoFamily) {
  recording_.reference.push_back({.name = "r", .tag = 1, .corner = 0});
  expect_refusal_of("reference points carry tags of no family");
}

TEST_F(TextureRecording, StopsWhereProgressSaysSo) {
  const TrackResult result = track(recording_, recording_.cameras[0], {},
                                   [](const Progress& now) { return now.done < 2; });
  EXPECT_TRUE(result.cancelled);
}

}  // namespace
}  // namespace clothfit
