// Checks that dots of rendered sheets are named and followed: by anchor tags, by a pattern, turned
// and mirrored, with something in front, across folds.

#include "vision/track/dot_tracks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "data/input_error.h"
#include "tests/vision/dot_sheet.h"
#include "tests/vision/synthetic_dots.h"
#include "tests/vision/tag_sheet.h"
#include "vision/render/render_cloth.h"
#include "vision/render/true_markers.h"
#include "vision/track/dot_bend.h"
#include "vision/track/dot_layout.h"

namespace clothfit {
namespace {

constexpr double kSpacing_m = 0.025, kMargin_m = 0.01;
constexpr int kAcross = 9;
constexpr double kSheet_m = (kAcross - 1) * kSpacing_m + 2 * kMargin_m;

/// A sheet before a camera that sees a spacing 24 px wide, and what it shows.
class DotScene {
 public:
  explicit DotScene(const MarkerSet& markers, std::vector<double> radii_m = {})
      : markers_(markers),
        print_(markers, kSheet_m, kSheet_m,
               {.dot_radius_m = 5e-3, .dot_radii_m = std::move(radii_m)}),
        camera_(camera_before(1.0, 960, 320, 320)),
        rays_(camera_) {}

  /// Moves the sheet to where it is in a frame: it swings and waves by some px per frame.
  void pose(int frame, double turn = 0, double wave_m = 0.008) {
    const double phase = 0.25 * frame;
    sheet_ = place_sheet(print_, 61, [&](double s, double t) {
      const double depth = 0.25 * std::sin(phase) * t + wave_m * std::sin(30 * s + 14 * t - phase);
      const double x = s - 0.5 * kSheet_m, z = 0.5 * kSheet_m - t;
      return Eigen::Vector3d(std::cos(turn) * x - std::sin(turn) * z, depth,
                             std::sin(turn) * x + std::cos(turn) * z);
    });
  }
  cv::Mat picture(double noise_levels = 2) const {
    const std::vector<std::vector<PlacedSheet>> instants = {{sheet_}};
    return render_cloth(rays_, instants, {.noise_levels = noise_levels}, 7);
  }
  std::vector<TrueMarker> truth() const {
    return true_markers(camera_, std::vector<PlacedSheet>{sheet_}, 0, markers_.markers);
  }
  const MarkerSet& markers() const { return markers_; }

 private:
  MarkerSet markers_;
  SheetPrint print_;
  CameraParameters camera_;
  CameraRays rays_;
  PlacedSheet sheet_;
};

/// Rows against the truth.
struct RowErrors {
  int rows = 0, false_rows = 0, unseen_rows = 0;
  double squares_px2 = 0, scaled_squares = 0;

  void add(const DotFrame& frame, const std::vector<TrueMarker>& truth) {
    for (const DotRow& row : frame.dots) {
      const TrueMarker& marker = truth[static_cast<size_t>(row.marker)];
      const double square = (row.pixel_px - marker.pixel_px).squaredNorm();
      ++rows;
      unseen_rows += marker.sight != MarkerSight::seen ? 1 : 0;
      false_rows += square > 9 ? 1 : 0;
      squares_px2 += square / 2;
      scaled_squares += square / 2 / (row.sigma_px * row.sigma_px);
    }
  }
  double rms_px() const { return std::sqrt(squares_px2 / rows); }
  double error_over_sigma() const { return std::sqrt(scaled_squares / rows); }
};

DotScene anchored_scene() {
  return DotScene(anchored_dot_markers(kAcross, kAcross, kSpacing_m, kMargin_m));
}

DotScene pattern_scene() {
  return DotScene(dot_markers(kAcross, kAcross, kSpacing_m, kMargin_m),
                  pattern_radii_m(make_dot_pattern(kAcross, kAcross), kSpacing_m));
}

TEST(DotTracker, FollowsTheDotsOfASwingingSheetWithinTheStatedSigma) {
  DotScene scene = anchored_scene();
  DotTracker tracker(scene.markers(), "markers.csv");
  RowErrors errors;
  constexpr int kFrames = 6;
  for (int frame = 0; frame < kFrames; ++frame) {
    scene.pose(frame);
    const DotFrame found = tracker.next(scene.picture());
    EXPECT_EQ(found.searched_whole, frame == 0);
    EXPECT_EQ(found.tags.size(), 4U);
    errors.add(found, scene.truth());
  }
  EXPECT_EQ(errors.rows, kFrames * (kAcross * kAcross - 4));
  EXPECT_EQ(errors.false_rows, 0);
  EXPECT_LT(errors.rms_px(), 0.015);
  EXPECT_NEAR(errors.error_over_sigma(), 1, 0.35);
}

TEST(DotTracker, NamesDotsByTheirPatternInEveryTurnAndMirrored) {
  DotScene scene = pattern_scene();
  for (int quarter = 0; quarter < 4; ++quarter) {
    SCOPED_TRACE(quarter);
    scene.pose(0, quarter * M_PI / 2 + 0.2);
    cv::Mat picture = scene.picture();
    std::vector<TrueMarker> truth = scene.truth();
    if (quarter % 2 == 1) {
      cv::flip(picture, picture, 1);
      for (TrueMarker& marker : truth) marker.pixel_px.x() = picture.cols - 1 - marker.pixel_px.x();
    }
    RowErrors errors;
    errors.add(DotTracker(scene.markers(), "markers.csv").next(picture), truth);
    EXPECT_EQ(errors.rows, kAcross * kAcross);
    EXPECT_EQ(errors.false_rows, 0);
    EXPECT_LT(errors.rms_px(), 0.02);
  }
}

TEST(DotTracker, ReportsCoveredDotsMissingAndFindsTheOthers) {
  for (const bool pattern : {false, true}) {
    SCOPED_TRACE(pattern);
    DotScene scene = pattern ? pattern_scene() : anchored_scene();
    DotTracker tracker(scene.markers(), "markers.csv");
    scene.pose(0);
    tracker.next(scene.picture());
    scene.pose(1);
    cv::Mat picture = scene.picture();
    const cv::Rect hand(150, 150, 170, 170);
    cv::rectangle(picture, hand, 120, cv::FILLED);
    const DotFrame found = tracker.next(picture);
    const std::vector<TrueMarker> truth = scene.truth();
    RowErrors errors;
    errors.add(found, truth);
    EXPECT_EQ(errors.false_rows, 0);
    EXPECT_LT(errors.rms_px(), 0.03);
    int free = 0;
    for (size_t i = 0; i < truth.size(); ++i) {
      const Eigen::Vector2d& at = truth[i].pixel_px;
      free += !scene.markers().markers[i].tag && std::min(at.x(), at.y()) < hand.x - 8 ? 1 : 0;
    }
    for (const DotRow& row : found.dots)
      EXPECT_LT(std::min(row.pixel_px.x(), row.pixel_px.y()), hand.x);
    EXPECT_GE(errors.rows, 0.98 * free);
    EXPECT_EQ(errors.rows + static_cast<int>(found.missing.size()),
              kAcross * kAcross - (pattern ? 0 : 4));
  }
}

TEST(DotTracker, ComesBackAfterTheClothWasOutOfThePicture) {
  DotScene scene = anchored_scene();
  DotTracker tracker(scene.markers(), "markers.csv");
  scene.pose(0);
  const cv::Mat picture = scene.picture();
  const size_t before = tracker.next(picture).dots.size();
  const DotFrame empty = tracker.next(cv::Mat(picture.size(), CV_8UC1, cv::Scalar(60)));
  EXPECT_TRUE(empty.dots.empty());
  EXPECT_EQ(empty.missing.size(), before);
  scene.pose(0, 0.5);
  EXPECT_EQ(tracker.next(scene.picture()).dots.size(), before);
}

TEST(DotTracker, SaysWhichDotsAreBeyondTheBorder) {
  DotScene scene = anchored_scene();
  DotTracker tracker(scene.markers(), "markers.csv");
  scene.pose(0);
  const cv::Mat picture = scene.picture();
  const DotFrame found = tracker.next(picture(cv::Rect(0, 0, 240, 320)).clone());
  EXPECT_GT(found.missing_counts()[dot_missing::kOutside], kAcross - 1);
  EXPECT_EQ(found.missing_counts()[dot_missing::kCovered], 0);
}

TEST(DotTracker, GivesTheSameWhateverTheSheetDidBefore) {
  // A picture alone and the same one after another agree within sigma.
  DotScene scene = anchored_scene();
  scene.pose(1);
  const cv::Mat second = scene.picture();
  scene.pose(0);
  DotTracker tracker(scene.markers(), "markers.csv");
  tracker.next(scene.picture());
  const DotFrame followed = tracker.next(second);
  const DotFrame alone = DotTracker(scene.markers(), "markers.csv").next(second);
  ASSERT_EQ(followed.dots.size(), alone.dots.size());
  for (size_t i = 0; i < alone.dots.size(); ++i)
    EXPECT_LT((followed.dots[i].pixel_px - alone.dots[i].pixel_px).norm(), alone.dots[i].sigma_px);
}

TEST(DotTracker, RefusesDotsThatNothingNames) {
  MarkerSet markers = dot_markers(4, 4, kSpacing_m, kMargin_m);
  markers.markers.pop_back();
  EXPECT_THROW(DotTracker(markers, "markers.csv"), InputError);
  EXPECT_THROW(DotTracker(dot_markers(2, 2, kSpacing_m, kMargin_m), "markers.csv"), InputError);
}

TEST(DotTracker, RefusesAnchorsThatTheFamilyLacks) {
  MarkerSet markers = anchored_scene().markers();
  for (Marker& marker : markers.markers)
    if (marker.tag) *marker.tag += 587;  // tag36h11 ends at 586
  EXPECT_THROW(DotTracker(markers, "markers.csv"), InputError);
}

TEST(DotBend, IsTheShiftOfABentDotsOutline) {
  std::mt19937_64 rng(3);
  const auto unit = [&] { return std::uniform_real_distribution<double>(-1, 1)(rng); };
  constexpr double kRadius = 0.2;  // spacings
  double shifts = 0, left = 0;
  for (int i = 0; i < 40; ++i) {
    SyntheticDotPicture picture;
    picture.noise_levels = 0;
    SyntheticDot dot = tilted_dot({32 + unit(), 32 + unit()}, 6, 0.5 + 0.5 * unit(), 3 * unit());
    for (Eigen::Matrix2d& bend : dot.bend_px) {
      const double mixed = 0.3 * unit();
      bend << 0.6 * unit(), mixed, mixed, 0.6 * unit();
    }
    picture.dots = {dot};
    const DotOutline start{.centre_px = dot.centre_px,
                           .shape_px2 = dot.px_per_radius * dot.px_per_radius.transpose()};
    const Dot fitted = refine_dot(render(picture, rng), {.outline = start});
    LocalMap map;
    map.jacobian_px = dot.px_per_radius / kRadius;
    map.scale_px = 6 / kRadius;
    for (size_t c = 0; c < 2; ++c) map.bend_px[c] = dot.bend_px[c] / (kRadius * kRadius);
    const Eigen::Vector2d shift = fitted.outline.centre_px - dot.centre_px;
    shifts += shift.squaredNorm();
    left += (shift - dot_bend_shift_px(map, kRadius)).squaredNorm();
  }
  EXPECT_GT(std::sqrt(shifts / 40), 0.1);
  EXPECT_LT(std::sqrt(left / shifts), 0.25);
}

}  // namespace
}  // namespace clothfit
