// A template that follows exact tracks. What it makes of measured ones is for `clothfit study
// vision`.

#include "apps/study/vision/template_sheet.h"

#include <gtest/gtest.h>

#include <string>

#include "apps/terminal/exit_code.h"
#include "calib/camera/projection.h"

namespace clothfit {
namespace {

constexpr Mesh kMesh{6, 6, 0.5, 0.5};

/// The sheet turned about its upper edge, in front of a camera at the origin.
Eigen::Matrix3Xd turned(double angle_rad) {
  Eigen::Matrix3Xd position_m = flat_positions(kMesh);
  const Eigen::AngleAxisd turn(angle_rad, Eigen::Vector3d::UnitX());
  position_m = turn.toRotationMatrix() * position_m;
  return position_m.colwise() + Eigen::Vector3d(-0.25, -0.25, 1.2);
}

CameraParameters camera_at_origin() {
  return {.name = "camera",
          .image_width = 960,
          .image_height = 720,
          .focal_px = {900, 900},
          .centre_px = {480, 360},
          .camera_from_world = CameraPose()};
}

/// Markers at all vertices.
MarkerSet markers_at_vertices() {
  MarkerSet markers;
  const Eigen::Matrix3Xd flat_m = flat_positions(kMesh);
  for (int v = 0; v < kMesh.vertex_count(); ++v) {
    markers.markers.push_back(
        {.name = std::to_string(v), .s_m = flat_m(0, v), .t_m = flat_m(1, v)});
    markers.index.emplace(std::to_string(v), v);
  }
  return markers;
}

TEST(FollowTemplate, FindsASheetThatTurnsAboutItsHeldEdge) {
  const CameraParameters camera = camera_at_origin();
  const std::vector<double> angles_rad = {0.2, 0.25, 0.32, 0.4};
  Tracks2d tracks;
  for (int frame = 0; frame < 4; ++frame) {
    const Eigen::Matrix3Xd position_m = turned(angles_rad[static_cast<size_t>(frame)]);
    for (int v = 0; v < kMesh.vertex_count(); ++v)
      tracks.push_back(
          {.frame = frame, .marker = v, .position_px = *project(camera, position_m.col(v))});
  }
  tracks[50].position_px.x() += 40;
  tracks[50].rejected = "sigma";
  const TemplateSheet sheet{
      .mesh = kMesh, .position_m = turned(angles_rad[0]), .fixed = {0, kMesh.columns - 1}};

  const std::vector<Eigen::Matrix3Xd> shapes =
      follow_template(sheet, tracks, camera, markers_at_vertices(), {});

  ASSERT_EQ(shapes.size(), angles_rad.size());
  for (size_t frame = 0; frame < shapes.size(); ++frame)  // lengths and pixels agree exactly
    EXPECT_LT((shapes[frame] - turned(angles_rad[frame])).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(FollowTemplate, StopsWhereItsCallerAsks) {
  const TemplateSheet sheet{.mesh = kMesh, .position_m = turned(0.2), .fixed = {}};
  const Tracks2d tracks = {{.frame = 0, .marker = 0, .position_px = {300, 200}}};

  EXPECT_THROW(follow_template(sheet, tracks, camera_at_origin(), markers_at_vertices(),
                               [](const Progress&) { return false; }),
               Cancelled);
}

}  // namespace
}  // namespace clothfit
