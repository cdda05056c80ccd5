// Checks the true places of markers and why a camera does not see them. Pictures are compared with
// this truth in render_cloth_test.cpp.

#include "vision/render/true_markers.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/vision/tag_sheet.h"

namespace clothfit {
namespace {

const MarkerSet kNoPrint;

std::vector<Marker> at(std::initializer_list<std::pair<double, double>> places) {
  std::vector<Marker> markers;
  for (const auto& [s_m, t_m] : places) markers.push_back({.name = "m", .s_m = s_m, .t_m = t_m});
  return markers;
}

TEST(TrueMarkers, AreWhereAPinholeByHandPutsThem) {
  const SheetPrint print(kNoPrint, 0.4, 0.4);
  const PlacedSheet sheet = place_sheet(print, 3, hanging_flat(0.4));
  const CameraParameters camera = camera_before(2, 1000, 640, 480);

  const auto truth = true_markers(camera, {&sheet, 1}, 0, at({{0.2, 0.2}, {0.3, 0.25}}));

  EXPECT_EQ(truth[0].sight, MarkerSight::seen);
  EXPECT_LT((truth[0].pixel_px - Eigen::Vector2d(319.5, 239.5)).norm(), 1e-9);
  EXPECT_EQ(truth[1].sight, MarkerSight::seen);
  EXPECT_LT((truth[1].pixel_px - Eigen::Vector2d(319.5 + 50, 239.5 + 25)).norm(), 1e-9);
}

TEST(TrueMarkers, SayWhichPartOfAFoldedClothHidesWhich) {
  // A cloth is folded over like a U about a horizontal line. t runs from 0 down to the fold at 0.2,
  // half a circle of 2 cm radius towards the camera, and up again in front of itself, where it
  // shows its back.
  const double r = 0.02, fold_m = 0.2;
  const SheetPrint print(kNoPrint, 0.4, 0.4);
  const PlacedSheet sheet = place_sheet(print, 161, [&](double s, double t) {
    const double x = s - 0.2;
    if (t < fold_m) return Eigen::Vector3d(x, 0, 0.1 - t);
    const double angle = (t - fold_m) / r;
    if (angle < M_PI)
      return Eigen::Vector3d(x, -r + r * std::cos(angle), 0.1 - fold_m - r * std::sin(angle));
    return Eigen::Vector3d(x, -2 * r, 0.1 - fold_m + (t - fold_m - M_PI * r));
  });
  const CameraParameters camera = camera_before(2, 1000, 640, 480);

  const auto truth = true_markers(camera, {&sheet, 1}, 0,
                                  at({{0.2, 0.01}, {0.2, 0.18}, {0.05, 0.1}, {0.2, 0.35}}));

  // The flap ends 0.4 - 0.2 - pi r = 0.137 m above the fold, 0.063 m below the upper edge.
  EXPECT_EQ(truth[0].sight, MarkerSight::seen);
  EXPECT_EQ(truth[1].sight, MarkerSight::hidden);
  EXPECT_EQ(truth[2].sight, MarkerSight::hidden);
  EXPECT_EQ(truth[3].sight, MarkerSight::facing_away);
}

TEST(TrueMarkers, TellOneReasonFromTheOther) {
  const SheetPrint print(kNoPrint, 3, 3), screen(kNoPrint, 0.2, 0.2);
  const std::vector<PlacedSheet> sheets = {
      // The sheet lies along the line of sight, from 1 m behind the camera to 2 m before it.
      place_sheet(print, 7,
                  [](double s, double t) { return Eigen::Vector3d(s - 1.5, 0 - t, -0.5); }),
      place_sheet(screen, 2,
                  [](double s, double t) { return Eigen::Vector3d(s - 0.1, -1, -0.15 - t); })};
  const CameraParameters camera = camera_before(2, 600, 640, 480);

  const auto truth =
      true_markers(camera, sheets, 0, at({{1.5, 2.5}, {1.5, 1.9}, {1.5, 0}, {0.9, 0.1}, {3, 0.1}}));

  EXPECT_EQ(truth[0].sight, MarkerSight::behind_camera);
  EXPECT_EQ(truth[1].sight, MarkerSight::outside_picture);
  EXPECT_EQ(truth[2].sight, MarkerSight::hidden);
  EXPECT_EQ(truth[3].sight, MarkerSight::seen);
  EXPECT_EQ(truth[4].sight, MarkerSight::outside_picture);
}

TEST(TrueMarkers, AreNotSeenThroughTheFoldOfALensFormula) {
  // x (1 - r2) puts x = 0.9 at 0.171, where x = 0.177 is seen.
  const SheetPrint print(kNoPrint, 4, 4);
  const PlacedSheet sheet = place_sheet(print, 5, hanging_flat(4));
  CameraParameters camera = camera_before(2, 600, 640, 480);
  camera.model = CameraModel::brown_conrady;
  camera.distortion = {-1, 0, 0, 0};

  const auto truth =
      true_markers(camera, {&sheet, 1}, 0, at({{2 + 2 * 0.9, 2}, {2 + 2 * 0.177, 2}}));

  EXPECT_EQ(truth[0].sight, MarkerSight::behind_camera);
  EXPECT_EQ(truth[1].sight, MarkerSight::seen);
}

}  // namespace
}  // namespace clothfit
