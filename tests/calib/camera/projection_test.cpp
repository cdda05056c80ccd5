// Checks projection through the camera models against closed forms and OpenCV. Does not check that
// a camera can be estimated: see calibrate_test.cpp. Nor does it check the detector's half pixel,
// which is vision's business.

#include "calib/camera/projection.h"

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <random>

namespace clothfit {
namespace {

CameraParameters make_camera(CameraModel model, std::vector<double> distortion) {
  CameraParameters camera;
  camera.model = model;
  camera.image_width = 960;
  camera.image_height = 720;
  camera.focal_px = {1012.3, 1009.1};
  camera.centre_px = {483.6, 355.2};
  camera.distortion = std::move(distortion);
  return camera;
}

/// Returns one camera of each kind, with distortion of a size that lenses have.
std::vector<CameraParameters> all_cameras() {
  return {
      make_camera(CameraModel::pinhole, {}),
      make_camera(CameraModel::brown_conrady, {-0.11, 0.035, 0.0008, -0.0005}),
      make_camera(CameraModel::brown_conrady, {-0.11, 0.035, 0.0008, -0.0005, 0.02}),
      make_camera(CameraModel::brown_conrady, {0.4, 0.06, 0.0008, -0.0005, 0.01, 0.5, 0.1, 0.02}),
      make_camera(CameraModel::kannala_brandt, {-0.02, 0.01, -0.004, 0.001})};
}

std::string name_of(const CameraParameters& camera) {
  return "model " + std::to_string(static_cast<int>(camera.model)) + " with " +
         std::to_string(camera.distortion.size()) + " coefficients";
}

Eigen::Vector3d random_point(std::mt19937_64& rng) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const double depth_m = 1.5 + uniform(rng);
  return {0.47 * depth_m * uniform(rng), 0.35 * depth_m * uniform(rng), depth_m};
}

TEST(Projection, PinholeByHand) {
  CameraParameters camera = make_camera(CameraModel::pinhole, {});
  camera.focal_px = {1000, 500};
  camera.centre_px = {480, 360};

  const auto pixel = project(camera, {0.1, -0.2, 2.0});

  ASSERT_TRUE(pixel);
  EXPECT_DOUBLE_EQ(pixel->x(), 480 + 1000 * 0.05);
  EXPECT_DOUBLE_EQ(pixel->y(), 360 - 500 * 0.1);
}

TEST(Projection, BrownConradyByHand) {
  CameraParameters camera = make_camera(CameraModel::brown_conrady, {0.1, 0.01, 0.002, 0.003});
  camera.focal_px = {1000, 1000};
  camera.centre_px = {0, 0};

  const auto pixel = project(camera, {0.3, 0.4, 1.0});

  // r2 = 0.25, radial = 1 + 0.025 + 0.000625
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 1000 * (0.3 * 1.025625 + 2 * 0.002 * 0.12 + 0.003 * (0.25 + 0.18)),
              1e-12);
  EXPECT_NEAR(pixel->y(), 1000 * (0.4 * 1.025625 + 0.002 * (0.25 + 0.32) + 2 * 0.003 * 0.12),
              1e-12);
}

TEST(Projection, KannalaBrandtWithoutCoefficientsIsEquidistant) {
  CameraParameters camera = make_camera(CameraModel::kannala_brandt, {0, 0, 0, 0});
  camera.focal_px = {1000, 1000};
  camera.centre_px = {0, 0};

  for (const double theta : {1e-9, 1e-5, 0.99e-4, 1.01e-4, 0.3, 1.4}) {
    SCOPED_TRACE(theta);
    const auto pixel = project(camera, {std::sin(theta), 0, std::cos(theta)});
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x() / (1000 * theta), 1, 1e-14);
  }
}

TEST(Projection, AgreesWithOpenCv) {
  std::mt19937_64 rng(1);
  SCOPED_TRACE("seed 1");
  for (const auto& camera : all_cameras()) {
    SCOPED_TRACE(name_of(camera));
    std::vector<cv::Point3d> points;
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d point = random_point(rng);
      points.emplace_back(point.x(), point.y(), point.z());
    }
    const cv::Matx33d matrix(camera.focal_px.x(), 0, camera.centre_px.x(), 0, camera.focal_px.y(),
                             camera.centre_px.y(), 0, 0, 1);
    std::vector<cv::Point2d> pixels;
    if (camera.model == CameraModel::kannala_brandt) {
      cv::fisheye::projectPoints(points, pixels, cv::Vec3d(), cv::Vec3d(), matrix,
                                 camera.distortion);
    } else {
      cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), matrix, camera.distortion, pixels);
    }
    for (size_t i = 0; i < points.size(); ++i) {
      const auto pixel = project(camera, {points[i].x, points[i].y, points[i].z});
      ASSERT_TRUE(pixel);
      EXPECT_NEAR(pixel->x(), pixels[i].x, 1e-9);
      EXPECT_NEAR(pixel->y(), pixels[i].y, 1e-9);
    }
  }
}

TEST(Projection, DerivativeAgreesWithCentralDifferencesAndWithJets) {
  std::mt19937_64 rng(2);
  SCOPED_TRACE("seed 2");
  for (const auto& camera : all_cameras()) {
    SCOPED_TRACE(name_of(camera));
    for (int trial = 0; trial < 50; ++trial) {
      // The second and third points lie where kannala_brandt leaves its series near the axis.
      const Eigen::Vector3d point = trial == 0   ? Eigen::Vector3d(0, 0, 1.2)
                                    : trial == 1 ? Eigen::Vector3d(0.9e-4, 1e-5, 1)
                                    : trial == 2 ? Eigen::Vector3d(1.1e-4, 1e-5, 1)
                                                 : random_point(rng);
      Eigen::Matrix<double, 2, 3> derivative;
      const auto pixel = project(camera, point, &derivative);
      ASSERT_TRUE(pixel);
      EXPECT_EQ(*pixel, *project(camera, point));

      constexpr double kStep = 1e-5;  // m: error of order 1e-10 of the derivative, in rounding too
      for (int axis = 0; axis < 3; ++axis) {
        Eigen::Vector3d ahead = point, behind = point;
        ahead[axis] += kStep;
        behind[axis] -= kStep;
        const Eigen::Vector2d difference =
            (*project(camera, ahead) - *project(camera, behind)) / (2 * kStep);
        EXPECT_LT((derivative.col(axis) - difference).norm(), 2e-6 * camera.focal_px.x());
      }

      using Jet = ceres::Jet<double, 3>;
      const auto values = intrinsics_of(camera);
      std::array<Jet, kMaxIntrinsics> intrinsics;
      for (size_t i = 0; i < values.size(); ++i) intrinsics[i] = Jet(values[i]);
      Eigen::Matrix<Jet, 3, 1> jet_point;
      for (int axis = 0; axis < 3; ++axis) jet_point[axis] = Jet(point[axis], axis);
      const auto jet_pixel = project<Jet>(camera.model, intrinsics.data(),
                                          static_cast<int>(camera.distortion.size()), jet_point);
      for (int row = 0; row < 2; ++row) {
        EXPECT_NEAR(jet_pixel[row].a, (*pixel)[row], 1e-10);
        EXPECT_LT((jet_pixel[row].v.transpose() - derivative.row(row)).norm(), 1e-9);
      }
    }
  }
}

TEST(Projection, NothingBehindTheCamera) {
  const CameraParameters camera = make_camera(CameraModel::pinhole, {});

  EXPECT_FALSE(project(camera, {0.1, 0.1, -1}));
  EXPECT_FALSE(project(camera, {0.1, 0.1, 0}));
  EXPECT_FALSE(project(camera, {0.1, 0.1, std::nan("")}));
}

TEST(Unprojection, IsInvertedByProjectionOverTheWholeImage) {
  for (const auto& camera : all_cameras()) {
    SCOPED_TRACE(name_of(camera));
    for (int y = 0; y < camera.image_height; y += 60) {
      for (int x = 0; x < camera.image_width; x += 60) {
        const Eigen::Vector2d pixel(x, y);
        const auto direction = unproject(camera, pixel);
        ASSERT_TRUE(direction) << x << ", " << y;
        EXPECT_NEAR(direction->norm(), 1, 1e-14);
        EXPECT_LT((*project(camera, *direction) - pixel).norm(), 1e-9);
      }
    }
  }
}

TEST(Unprojection, InvertsProjection) {
  std::mt19937_64 rng(3);
  SCOPED_TRACE("seed 3");
  for (const auto& camera : all_cameras()) {
    SCOPED_TRACE(name_of(camera));
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector3d point = random_point(rng);
      const auto direction = unproject(camera, *project(camera, point));
      ASSERT_TRUE(direction);
      EXPECT_LT((*direction - point.normalized()).norm(), 1e-11);
    }
  }
}

TEST(Unprojection, NothingBeyondTheFoldOfTheDistortion) {
  // r (1 - r2 / 3) has its largest value, 2 / 3, at r = 1: pixels further out are never reached.
  CameraParameters camera = make_camera(CameraModel::brown_conrady, {-1.0 / 3, 0, 0, 0});
  camera.focal_px = {1000, 1000};
  camera.centre_px = {0, 0};

  EXPECT_TRUE(unproject(camera, {600, 0}));
  EXPECT_FALSE(unproject(camera, {700, 0}));
  EXPECT_FALSE(unproject(camera, {std::nan(""), 0}));
}

TEST(Projection, PoseOfTheCameraFileIsATransform) {
  CameraParameters camera = make_camera(CameraModel::pinhole, {});
  camera.camera_from_world = CameraPose{};
  camera.camera_from_world->translation_m = {1, 2, 3};

  EXPECT_EQ(camera_from_world(camera) * Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 2, 4));
}

}  // namespace
}  // namespace clothfit
