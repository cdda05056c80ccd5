// Checks how tags are followed from picture to picture, against searches of whole pictures.

#include "vision/track/tag_tracker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/vision/synthetic_tag.h"
#include "tests/vision/tag_sheet.h"
#include "vision/render/render_cloth.h"

namespace clothfit {
namespace {

constexpr int kAcross = 4;
constexpr double kSheet_m = 0.24;

/// A sheet of tags 50 px wide that swings by up to 3 px per picture.
struct SwingingSheet {
  SwingingSheet() {
    for (const Marker& marker : markers.markers) {
      layout[*marker.tag][static_cast<size_t>(*marker.corner)] = {marker.s_m, marker.t_m};
      listed.insert(*marker.tag);
    }
  }

  cv::Mat picture(int frame) const {
    const SheetPrint print(markers, kSheet_m, kSheet_m, {});
    const CameraRays rays(camera_before(0.6, 700, 400, 340));
    const double phase = 0.2 * frame;
    const std::vector<std::vector<PlacedSheet>> instants = {
        {place_sheet(print, 49, [&](double s, double t) {
          const double depth = 0.2 * std::sin(phase) * t + 0.004 * std::sin(25 * s - phase);
          return Eigen::Vector3d(s - 0.5 * kSheet_m + 0.05 * depth, depth, 0.5 * kSheet_m - t);
        })}};
    return render_cloth(rays, instants, {.samples = 2, .noise_levels = 2},
                        static_cast<std::uint64_t>(frame));
  }

  MarkerSet markers = tag_markers(kAcross, kSheet_m);
  TagLayout layout;
  std::set<int> listed;
};

TEST(TagTracker, PlacesTagsWhereASearchDoes) {
  const SwingingSheet sheet;
  TagTracker tracker(sheet.markers.family, sheet.layout, sheet.listed);
  TagDetector detector(sheet.markers.family);
  for (int frame = 0; frame < 6; ++frame) {
    const cv::Mat picture = sheet.picture(frame);

    const SheetTags followed = tracker.next(picture, frame);

    EXPECT_EQ(tracker.searched(), frame < 2);
    const SheetTags found = detect_on_sheet(detector, picture, sheet.layout);
    ASSERT_EQ(found.read.size(), sheet.listed.size());
    ASSERT_EQ(followed.read.size(), sheet.listed.size());
    for (size_t i = 0; i < found.read.size(); ++i) {
      EXPECT_EQ(followed.read[i].id, found.read[i].id);
      // Both stop within 0.3 of a standard deviation, which is 0.05 px here.
      for (size_t c = 0; c < 4; ++c)
        EXPECT_LT((followed.read[i].corner_px[c] - found.read[i].corner_px[c]).norm(), 0.04);
    }
  }
}

TEST(TagTracker, SearchesAfterAGapAndWhereManyTagsAreLost) {
  const SwingingSheet sheet;
  TagTracker tracker(sheet.markers.family, sheet.layout, sheet.listed);
  for (int frame = 0; frame < 3; ++frame) tracker.next(sheet.picture(frame), frame);
  EXPECT_FALSE(tracker.searched());

  EXPECT_EQ(tracker.next(sheet.picture(9), 9).read.size(), sheet.listed.size());
  EXPECT_TRUE(tracker.searched());

  const cv::Mat empty(340, 400, CV_8UC1, cv::Scalar(120));
  EXPECT_TRUE(tracker.next(empty, 10).read.empty());
  EXPECT_TRUE(tracker.searched());
  EXPECT_EQ(tracker.next(sheet.picture(11), 11).read.size(), sheet.listed.size());
}

TEST(TagTracker, SeeksATagThatNoOtherPredictsWhereItWas) {
  const SyntheticCamera camera;
  std::mt19937_64 rng(3);
  SyntheticTag second = place_tag(camera, 40, 0.1, 0);
  second.id = 1;
  const cv::Mat one = render(place_tag(camera, 40, 0.1, 0), camera, rng);
  cv::Mat both, half_hidden;
  cv::hconcat(one, render(second, camera, rng), both);
  cv::hconcat(one, cv::Mat(one.size(), CV_8UC1, cv::Scalar(120)), half_hidden);
  TagTracker tracker("tag36h11", {}, {0, 1});
  for (int frame = 0; frame < 3; ++frame) EXPECT_EQ(tracker.next(both, frame).read.size(), 2U);

  EXPECT_EQ(tracker.next(half_hidden, 3).read.size(), 1U);

  EXPECT_EQ(tracker.next(both, 4).read.size(), 2U);
  EXPECT_FALSE(tracker.searched());
}

}  // namespace
}  // namespace clothfit
