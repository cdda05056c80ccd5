// Checks pictures of sheets against closed forms and against the truth of true_markers, with our
// own tag detector as the judge of places. Tracking through a rendered sequence is in
// rendered_track_test.cpp; places on a sheet are in sheet_scene_test.cpp.

#include "vision/render/render_cloth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <functional>
#include <opencv2/core.hpp>

#include "data/input_error.h"
#include "tests/vision/tag_sheet.h"
#include "vision/detect/tag_detector.h"
#include "vision/render/true_markers.h"

namespace clothfit {
namespace {

using Shape = std::function<Eigen::Vector3d(double, double)>;

cv::Mat render_one(const CameraParameters& camera, const PlacedSheet& sheet,
                   const RenderOptions& options, std::uint64_t noise_seed = 0) {
  const std::vector<std::vector<PlacedSheet>> instants = {{sheet}};
  return render_cloth(CameraRays(camera), instants, options, noise_seed);
}

/// The errors of the corners that the detector finds.
struct CornerErrors {
  int seen = 0, found = 0;
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();
  double rms_px = 0;  ///< per coordinate
  double worst_px = 0;
};

/// Detects 5 x 5 tags about 44 px wide, without noise.
CornerErrors corner_errors(const CameraParameters& camera, int columns, const Shape& shape) {
  const MarkerSet markers = tag_markers(5, 0.3);
  const SheetPrint print(markers, 0.3, 0.3);
  const PlacedSheet sheet = place_sheet(print, columns, shape);
  const auto truth = true_markers(camera, {&sheet, 1}, 0, markers.markers);
  const cv::Mat picture = render_one(camera, sheet, {});

  CornerErrors errors;
  for (const TrueMarker& marker : truth) errors.seen += marker.sight == MarkerSight::seen;
  for (const TagDetection& tag : TagDetector("tag36h11").detect(picture)) {
    EXPECT_TRUE(tag.refined);
    for (size_t c = 0; c < 4; ++c) {
      const TrueMarker& marker = truth.at(static_cast<size_t>(4 * tag.id) + c);
      if (marker.sight != MarkerSight::seen) continue;
      const Eigen::Vector2d error_px = tag.corner_px[c] - marker.pixel_px;
      ++errors.found;
      errors.mean_px += error_px;
      errors.rms_px += error_px.squaredNorm() / 2;
      errors.worst_px = std::max(errors.worst_px, error_px.norm());
    }
  }
  errors.mean_px /= errors.found;
  errors.rms_px = std::sqrt(errors.rms_px / errors.found);
  testing::Test::RecordProperty("mean_u_px", std::to_string(errors.mean_px.x()));
  testing::Test::RecordProperty("mean_v_px", std::to_string(errors.mean_px.y()));
  testing::Test::RecordProperty("rms_px", std::to_string(errors.rms_px));
  testing::Test::RecordProperty("worst_px", std::to_string(errors.worst_px));
  return errors;
}

TEST(RenderCloth, ShowsTheTagsOfAFlatSheetWhereTheyAre) {
  // The view is head on, edges along the rows and columns of pixels: the worst case of samples on a
  // grid.
  const CornerErrors errors = corner_errors(camera_before(1, 1013, 400, 380), 2, hanging_flat(0.3));

  EXPECT_EQ(errors.seen, 100);
  EXPECT_EQ(errors.found, 100);
  EXPECT_LT(errors.mean_px.cwiseAbs().maxCoeff(), 0.002);  // half a pixel would be 0.5
  EXPECT_LT(errors.rms_px, 0.008);                         // rounding to 8 bits, samples
  EXPECT_LT(errors.worst_px, 0.03);
}

TEST(RenderCloth, BendsThePictureAsTheLensDoes) {
  for (const CameraModel model : {CameraModel::brown_conrady, CameraModel::kannala_brandt}) {
    SCOPED_TRACE(static_cast<int>(model));
    CameraParameters camera = camera_before(0.4, 400, 420, 400);
    camera.model = model;
    camera.distortion = {-0.3, 0.12, 2e-3, -1e-3};
    if (model == CameraModel::kannala_brandt) camera.distortion = {-0.2, 0.05, -0.01, 0.002};
    camera.centre_px += Eigen::Vector2d(3.3, -2.6);

    const CornerErrors errors = corner_errors(camera, 2, hanging_flat(0.3));

    EXPECT_EQ(errors.seen, 100);
    EXPECT_EQ(errors.found, 100);
    EXPECT_LT(errors.mean_px.cwiseAbs().maxCoeff(), 0.005);
    EXPECT_LT(errors.rms_px, 0.02);  // the detector's model of bending has to follow the lens
  }
}

TEST(RenderCloth, ShowsTheTagsOfACurvedSheetWhereTheyAre) {
  // Waves are 3 cm high over some 30 cm, bent to a radius of two tags at their crests. The mesh is
  // fine, as a caller refines it.
  const CornerErrors errors =
      corner_errors(camera_before(1, 1013, 400, 380), 121, [](double s, double t) {
        const double x = s - 0.15, z = 0.15 - t;
        return Eigen::Vector3d(x, 0.03 * std::sin(2 * M_PI * (0.8 * x + 0.3 * z) / 0.25), z);
      });

  EXPECT_GE(errors.found, 96);
  EXPECT_LT(errors.mean_px.cwiseAbs().maxCoeff(), 0.01);
  EXPECT_LT(errors.rms_px, 0.04);  // most of it from the detector's model of bending
}

/// Middle and variance along the axes (px, px^2) of the area darker than the paper.
struct DarkSpot {
  Eigen::Vector2d middle_px = Eigen::Vector2d::Zero(), variance_px2 = Eigen::Vector2d::Zero();
};

DarkSpot dark_spot(const cv::Mat& picture, double paper_level) {
  double weight = 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero(), square = Eigen::Vector2d::Zero();
  for (int v = 0; v < picture.rows; ++v) {
    for (int u = 0; u < picture.cols; ++u) {
      const Eigen::Vector2d at(u, v);
      const double dark = paper_level - picture.at<std::uint8_t>(v, u);
      weight += dark;
      mean += dark * at;
      square += dark * at.cwiseProduct(at);
    }
  }
  mean /= weight;
  return {mean, square / weight - mean.cwiseProduct(mean)};
}

/// A black dot of 12 px radius in the middle of white paper, which shows as level 250.
class Dot {
 public:
  Dot()
      : print_({.kind = MarkerKind::dots,
                .family = "",
                .markers = {{.name = "m", .s_m = 0.1, .t_m = 0.1}},
                .index = {}},
               0.2, 0.2, {.paper = 1, .ink = 0, .dot_radius_m = 0.012}) {}
  PlacedSheet shifted(double right_m) const {
    return place_sheet(print_, 2, [=](double s, double t) {
      return Eigen::Vector3d(hanging_flat(0.2)(s, t) + Eigen::Vector3d(right_m, 0, 0));
    });
  }
  const CameraParameters camera = camera_before(1, 1000, 70, 60);
  static constexpr double kPaperLevel = 250;
  static constexpr double kRadius_px = 12;

 private:
  SheetPrint print_;
};

TEST(RenderCloth, SpreadsADotByThePixelAndTheLens) {
  // Variances add: a disc's r^2 / 4, a pixel's 1/12, the lens' blur^2; and 1/12 of a squared
  // distance between samples for the area that each of them represents. An edge that is placed
  // within 0.005 px leaves r 0.005 / 2 = 0.03 px^2.
  const Dot dot;
  constexpr int kSamples = 4;
  for (const double blur_px : {0.0, 0.5, 1.2}) {
    SCOPED_TRACE(blur_px);
    const cv::Mat picture = render_one(dot.camera, dot.shifted(0.3e-3),
                                       {.ambient_levels = Dot::kPaperLevel,
                                        .direct_levels = 0,
                                        .samples = kSamples,
                                        .blur_px = blur_px});

    const DarkSpot spot = dark_spot(picture, Dot::kPaperLevel);

    EXPECT_LT((spot.middle_px - Eigen::Vector2d(34.5 + 0.3, 29.5)).norm(), 0.005);
    const double expected = Dot::kRadius_px * Dot::kRadius_px / 4 + 1.0 / 12 + blur_px * blur_px +
                            (blur_px > 0 ? 1.0 / (12 * kSamples * kSamples) : 0);
    EXPECT_NEAR(spot.variance_px2.x(), expected, 0.03);
    EXPECT_NEAR(spot.variance_px2.y(), expected, 0.03);
  }
}

TEST(RenderCloth, BlursMotionAroundTheMeanOfTheInstants) {
  // The dot moves 8 px to the right while the shutter is open, in nine instants that are not evenly
  // spaced.
  const Dot dot;
  const RenderOptions options{.ambient_levels = Dot::kPaperLevel, .direct_levels = 0};
  std::vector<std::vector<PlacedSheet>> instants;
  double mean = 0, square = 0;
  for (int k = 0; k < 9; ++k) {
    const double right_px = k + 0.1 * k * (k - 8) - 4;
    instants.push_back({dot.shifted(1e-3 * right_px)});
    mean += right_px / 9;
    square += right_px * right_px / 9;
  }

  const DarkSpot moving =
      dark_spot(render_cloth(CameraRays(dot.camera), instants, options, 0), Dot::kPaperLevel);
  const DarkSpot still =
      dark_spot(render_one(dot.camera, dot.shifted(0), options), Dot::kPaperLevel);

  EXPECT_LT((moving.middle_px - still.middle_px - Eigen::Vector2d(mean, 0)).norm(), 0.005);
  EXPECT_NEAR(moving.variance_px2.x() - still.variance_px2.x(), square - mean * mean, 0.03);
  EXPECT_NEAR(moving.variance_px2.y() - still.variance_px2.y(), 0, 0.03);
}

TEST(RenderCloth, LightsAPlaneByLambertsLaw) {
  const MarkerSet blank;
  const SheetPrint print(blank, 0.4, 0.4, {.paper = 0.8});
  const CameraParameters camera = camera_before(1, 200, 40, 30);
  for (const double tilt : {-1.0, -0.4, 0.0, 0.7, 2.5}) {  // 2.5: the back is seen
    for (const double light : {-0.9, 0.3, 1.4, 3.0}) {
      SCOPED_TRACE(testing::Message() << "tilt " << tilt << ", light " << light);
      const PlacedSheet sheet = place_sheet(print, 4, [&](double s, double t) {
        const double x = s - 0.2;
        return Eigen::Vector3d(x * std::cos(tilt), x * std::sin(tilt), 0.2 - t);
      });
      // Both turn about the vertical, from the direction to the camera; length is of no meaning.
      const RenderOptions options{.ambient_levels = 60,
                                  .direct_levels = 180,
                                  .towards_light = {5 * std::sin(light), -5 * std::cos(light), 0}};

      const cv::Mat picture = render_one(camera, sheet, options);

      const bool back = std::cos(tilt) < 0;
      const double cosine = (back ? -1 : 1) * std::cos(tilt - light);
      EXPECT_NEAR(picture.at<std::uint8_t>(14, 20), 0.8 * (60 + 180 * std::max(0.0, cosine)), 0.51);
    }
  }
}

TEST(RenderCloth, AddsNoiseOfTheStatedVariance) {
  const std::uint64_t seed = 5;
  SCOPED_TRACE(seed);
  const CameraParameters camera = camera_before(1, 500, 400, 300);
  const std::vector<std::vector<PlacedSheet>> nothing(1);
  const CameraRays rays(camera);
  for (const double shot_levels : {0.0, 0.05}) {
    const RenderOptions options{
        .background_level = 100.3, .noise_levels = 2, .shot_levels = shot_levels};

    const cv::Mat picture = render_cloth(rays, nothing, options, seed);
    const cv::Mat other = render_cloth(rays, nothing, options, seed + 1);

    cv::Scalar mean, deviation;
    cv::meanStdDev(picture, mean, deviation);
    // For 120 000 pixels the variance's own relative sigma is 0.4 %, the mean's 0.008 levels.
    const double variance = 2 * 2 + 100.3 * shot_levels + 1.0 / 12;  // and of rounding
    EXPECT_NEAR(mean[0], 100.3, 0.03);
    EXPECT_NEAR(deviation[0] * deviation[0], variance, 0.016 * variance);
    // Pictures and neighbouring rows have nothing to do with each other.
    cv::Mat a, b;
    picture.convertTo(a, CV_64F, 1, -mean[0]);
    other.convertTo(b, CV_64F, 1, -mean[0]);
    const double correlation_sigma = variance / std::sqrt(400 * 300);
    EXPECT_LT(std::abs(a.dot(b)) / (400 * 300), 4 * correlation_sigma);
    EXPECT_LT(std::abs(a.rowRange(1, 300).dot(a.rowRange(0, 299))) / (400 * 299),
              4 * correlation_sigma);
  }
}

TEST(RenderCloth, ShowsTheBackgroundWhereThereIsNothingElse) {
  const MarkerSet blank;
  const SheetPrint print(blank, 0.2, 0.2);
  const PlacedSheet behind = place_sheet(
      print, 2, [](double s, double t) { return Eigen::Vector3d(s - 0.1, -3, 0.1 - t); });
  CameraParameters camera = camera_before(1, 100, 60, 50);

  const cv::Mat picture = render_one(camera, behind, {.background_level = 77});
  EXPECT_EQ(cv::countNonZero(picture != 77), 0);

  // The lens shows nothing outside a circle of radius (2/3) / sqrt 3 focal lengths: 38 px.
  camera.model = CameraModel::brown_conrady;
  camera.distortion = {-1, 0, 0, 0};
  camera.image_width = 100;
  const PlacedSheet wall = place_sheet(print, 2, [](double s, double t) {
    return Eigen::Vector3d(100 * (s - 0.1), 0, 100 * (0.1 - t));
  });
  const cv::Mat circle = render_one(camera, wall, {.background_level = 0, .samples = 1});
  EXPECT_GT(circle.at<std::uint8_t>(25, 60), 50);
  EXPECT_EQ(circle.at<std::uint8_t>(25, 75), 0);
}

TEST(RenderCloth, GivesTheSameBytesOnOneThreadAndTwo) {
  const MarkerSet markers = tag_markers(3, 0.2);
  const SheetPrint print(markers, 0.2, 0.2);
  CameraParameters camera = camera_before(0.6, 500, 230, 210);
  camera.model = CameraModel::brown_conrady;
  camera.distortion = {-0.2, 0.05, 1e-3, 1e-3};
  std::vector<std::vector<PlacedSheet>> instants;
  for (const double phase : {0.0, 0.1}) {
    instants.push_back({place_sheet(print, 150, [&](double s, double t) {
      return Eigen::Vector3d(s - 0.1, 0.02 * std::sin(30 * s + 20 * t + phase), 0.1 - t);
    })});
  }
  const RenderOptions options{.noise_levels = 2, .shot_levels = 0.02};
  const auto render_with = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return render_cloth(CameraRays(camera), instants, options, 9);
  };

  const cv::Mat one = render_with(1);
  const cv::Mat two = render_with(2);

  EXPECT_EQ(cv::countNonZero(one != two), 0);
  cv::Scalar mean, deviation;
  cv::meanStdDev(one, mean, deviation);
  EXPECT_GT(deviation[0], 30) << "something is to be seen";
}

TEST(RenderCloth, RefusesWhatMakesNoPicture) {
  const std::vector<std::vector<PlacedSheet>> nothing(1);
  const auto expect_refused = [&](const std::string& part, CameraParameters camera,
                                  const RenderOptions& options) {
    SCOPED_TRACE(part);
    try {
      render_cloth(CameraRays(camera), nothing, options, 0);
      ADD_FAILURE() << "was accepted";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(part));
    }
  };
  const CameraParameters camera = camera_before(1, 100, 60, 50);
  expect_refused("samples", camera, {.samples = 0});
  expect_refused("noise_levels", camera, {.noise_levels = -1});
  expect_refused("towards_light", camera, {.towards_light = {0, 0, 0}});
  expect_refused("blur_px", camera, {.blur_px = 50});
  CameraParameters nowhere = camera;
  nowhere.camera_from_world.reset();
  expect_refused("has no pose", nowhere, {});
}

}  // namespace
}  // namespace clothfit
