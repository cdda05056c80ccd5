// Checks cached lines of sight against the program's projection. The scene along them is in
// sheet_scene_test.cpp and render_cloth_test.cpp.

#include "vision/render/camera_rays.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "calib/camera/projection.h"
#include "tests/vision/tag_sheet.h"

namespace clothfit {
namespace {

CameraParameters with_lens(CameraModel model, std::vector<double> distortion) {
  CameraParameters camera = camera_before(1, 330, 350, 260);
  camera.model = model;
  camera.distortion = std::move(distortion);
  camera.centre_px += Eigen::Vector2d(7.3, -4.1);
  return camera;
}

/// Returns the farthest that a line of sight projects from its pixel, over a grid of odd places.
double worst_error_px(const CameraParameters& camera) {
  const CameraRays rays(camera);
  std::vector<double> u_px;
  for (double u = -8.4; u < camera.image_width + 7; u += 2.37) u_px.push_back(u);
  std::vector<Eigen::Vector2d> direction(u_px.size());
  double worst = 0;
  for (double v = -8.4; v < camera.image_height + 7; v += 3.71) {
    rays.row(u_px, v, direction);
    for (size_t k = 0; k < u_px.size(); ++k) {
      const Eigen::Vector3d along = direction[k].homogeneous();
      worst = std::max(worst, (*project(camera, along) - Eigen::Vector2d(u_px[k], v)).norm());
    }
  }
  return worst;
}

TEST(CameraRays, ProjectToTheirPixelsWithEveryLens) {
  // A straight line is interpolated to rounding, lenses to the stated tolerance. Errors that the
  // middle between nodes does not show have room.
  EXPECT_LT(worst_error_px(with_lens(CameraModel::pinhole, {})), 1e-10);
  EXPECT_LT(worst_error_px(with_lens(CameraModel::brown_conrady, {-0.3, 0.1, 1e-3, -5e-4, -0.01})),
            2e-4);
  EXPECT_LT(worst_error_px(with_lens(CameraModel::brown_conrady,
                                     {0.4, -0.1, 1e-3, 1e-3, 0.02, 0.6, -0.05, 0.01})),
            2e-4);
  EXPECT_LT(worst_error_px(with_lens(CameraModel::kannala_brandt, {0.05, -0.02, 0.01, -0.002})),
            2e-4);
}

TEST(CameraRays, KnowWhereALensShowsNothing) {
  // x (1 - r2) turns back at r = 1/sqrt 3: nothing lies beyond (2/3) / sqrt 3 of the focal length.
  CameraParameters camera = with_lens(CameraModel::brown_conrady, {-1, 0, 0, 0});
  const double last_px = 2 / (3 * std::sqrt(3.0)) * camera.focal_px.x();
  const CameraRays rays(camera);
  const std::vector<double> u_px = {camera.centre_px.x(), camera.centre_px.x() + last_px - 1,
                                    camera.centre_px.x() + last_px + 1};
  std::vector<Eigen::Vector2d> direction(3);

  rays.row(u_px, camera.centre_px.y(), direction);

  EXPECT_NEAR(direction[0].norm(), 0, 1e-7);
  const Eigen::Vector3d steep = direction[1].homogeneous();
  EXPECT_NEAR(project(camera, steep)->x(), u_px[1], 1e-6) << "asked at the place itself";
  EXPECT_TRUE(std::isnan(direction[2].x()));
}

}  // namespace
}  // namespace clothfit
