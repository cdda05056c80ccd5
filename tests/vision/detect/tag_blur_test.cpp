// Checks tags under motion blur, in the dark, behind something, and of another border, on drawn
// pictures. Sharp tags are in tag_detector_test.cpp.

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "tests/vision/synthetic_tag.h"
#include "vision/degrade/brightness.h"
#include "vision/degrade/motion_blur.h"
#include "vision/detect/blurred_pattern.h"
#include "vision/detect/picture_blur.h"
#include "vision/detect/tag_detector.h"
#include "vision/detect/tag_family.h"

namespace clothfit {
namespace {

TEST(PictureBlur, IsTheBlurOfALensAndAMotion) {
  const Eigen::Vector2d motion(3, -4);

  const PictureBlur blur(PictureBlur::unknowns(0.6, motion));

  const Eigen::Matrix2d expected =
      0.36 * Eigen::Matrix2d::Identity() + motion * motion.transpose() / 12;
  EXPECT_TRUE(blur.covariance_px2().isApprox(expected, 1e-12));
  EXPECT_NEAR(blur.lens_variance_px2(), 0.36, 1e-12);
  EXPECT_NEAR(std::abs(blur.motion_px().dot(motion)), 25, 1e-9);
}

TEST(PictureBlur, HasTheSlopesOfItsCovariance) {
  for (const Eigen::Vector2d& motion : {Eigen::Vector2d(0, 0), Eigen::Vector2d(2, 5)}) {
    const PictureBlur::Unknowns at = PictureBlur::unknowns(0.5, motion);
    const auto slopes = PictureBlur(at).covariance_slopes();
    for (int k = 0; k < 3; ++k) {
      constexpr double kStep = 1e-5;
      const PictureBlur::Unknowns step = kStep * PictureBlur::Unknowns::Unit(k);
      const Eigen::Matrix2d numeric =
          (PictureBlur(at + step).covariance_px2() - PictureBlur(at - step).covariance_px2()) /
          (2 * kStep);
      EXPECT_LT((slopes[static_cast<size_t>(k)] - numeric).norm(), 1e-7) << k;
    }
  }
}

TEST(BlurredPattern, IsTheErrorFunctionAcrossALongEdge) {
  // Half of the plane is white: the edge runs along y at x = 0.
  TagPattern half{.border_cells = 8, .total_cells = 10, .white = {}};
  for (int i = 0; i < 100; ++i) half.white.push_back(i % 10 < 5 ? 0.0F : 1.0F);
  const Eigen::Matrix2d pixel_by_tag = 16 * Eigen::Matrix2d::Identity();

  const BlurredPattern blurred(half, pixel_by_tag,
                               PictureBlur(PictureBlur::unknowns(0.7, Eigen::Vector2d::Zero())));

  TagSamples places;
  places.count = 41;
  places.x = Eigen::ArrayXf::LinSpaced(TagSamples::kTogether, -2.0F / 16, 4.3F / 16);
  places.y = Eigen::ArrayXf::Constant(TagSamples::kTogether, 0.1F);
  places.grey = Eigen::ArrayXf::Zero(TagSamples::kTogether);
  TagRows rows;
  evaluate_rows({.grid = blurred.grid(), .contrast = {1, 0, 0}}, places, rows);
  for (Eigen::Index i = 0; i < places.count; ++i) {
    const double x_px = 16 * static_cast<double>(places.x[i]);
    EXPECT_NEAR(rows.white[i], 0.5 * std::erfc(-x_px / 0.7 * M_SQRT1_2), 0.004) << x_px;
  }
}

/// Errors of the corners of tags 30 to 40 px wide that move by `length_px` in any direction.
struct BlurErrors {
  double rms_px = 0, chi2 = 0;
  int tags = 0, missed = 0;
};

BlurErrors blurred_tags(double length_px, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const SyntheticCamera camera{.noise_levels = 0};
  TagDetector detector("tag36h11");
  BlurErrors errors;
  for (int i = 0; i < 40; ++i) {
    SyntheticTag tag = place_tag(camera, 32 + 8 * unit(rng), 2 * M_PI * unit(rng),
                                 (unit(rng) - 0.5) * M_PI / 3, {unit(rng), unit(rng)});
    tag.id = i;
    const cv::Mat blurred = blur_straight(render(tag, camera, rng), M_PI * unit(rng), length_px);
    const auto found = detector.detect(with_brightness(blurred, 1, 1, rng()));
    if (found.size() != 1 || !found[0].refined || !found[0].shows_tag) {
      ++errors.missed;
      continue;
    }
    ++errors.tags;
    const auto truth = true_corners(tag, camera);
    for (size_t c = 0; c < 4; ++c) {
      const double square = (found[0].corner_px[c] - truth[c]).squaredNorm() / 2;
      errors.rms_px += square / 4;
      errors.chi2 += square / (4 * found[0].sigma_px[c] * found[0].sigma_px[c]);
    }
  }
  errors.rms_px = std::sqrt(errors.rms_px / errors.tags);
  errors.chi2 /= errors.tags;
  return errors;
}

TEST(TagDetector, PlacesTagsThatMoveInAnyDirection) {
  for (const double length_px : {3.0, 6.0}) {
    const std::uint64_t seed = 11;
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << length_px << " px");

    const BlurErrors errors = blurred_tags(length_px, seed);

    EXPECT_GE(errors.tags, 25);  // the library reads no more of those that move by 6 px
    EXPECT_LT(errors.rms_px, 0.07);
    // Four corners of a tag are not independent; flat tags find the allowance for bending idle.
    EXPECT_GT(errors.chi2, 0.3);
    EXPECT_LT(errors.chi2, 1.6);
  }
}

TEST(TagDetector, FindsTagsThatTheLensBlursByHalfACell) {
  // Of these pictures themselves the library reads no tag.
  const SyntheticCamera camera{.blur_px = 2.2};
  const std::uint64_t seed = 15;
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  TagDetector detector("tag36h11");
  int found_tags = 0;
  for (int id = 0; id < 40; ++id) {
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", tag " << id);
    SyntheticTag tag = place_tag(camera, 30, 2 * M_PI * unit(rng), (unit(rng) - 0.5) * M_PI / 3,
                                 {unit(rng), unit(rng)});
    tag.id = id;

    const auto found = detector.detect(render(tag, camera, rng));

    for (const TagDetection& one : found) {
      EXPECT_EQ(one.id, id);
      EXPECT_TRUE(one.shows_tag);
      for (size_t c = 0; c < 4; ++c)
        EXPECT_LT((one.corner_px[c] - true_corners(tag, camera)[c]).norm(), 0.25) << c;
      ++found_tags;
    }
  }
  EXPECT_GE(found_tags, 25);
}

TEST(TagDetector, ReadsAPredictedTagAndInventsNone) {
  const SyntheticCamera camera;
  std::mt19937_64 rng(12);
  const SyntheticTag tag = place_tag(camera, 50, 0.2, 0.3);
  const cv::Mat picture = render(tag, camera, rng);
  const auto truth = true_corners(tag, camera);
  std::array<Eigen::Vector2d, 4> guess = truth;
  for (Eigen::Vector2d& corner : guess) corner += Eigen::Vector2d(2.5, -2);  // half a cell
  const PredictedTag there{.id = 0, .corner_px = guess, .motion_px = {}};
  PredictedTag other = there;
  other.id = 1;
  TagDetector detector("tag36h11");

  const auto read = detector.read_predicted(picture, std::array{there});

  ASSERT_EQ(read.size(), 1U);
  for (size_t c = 0; c < 4; ++c) EXPECT_LT((read[0].corner_px[c] - truth[c]).norm(), 0.15);
  EXPECT_TRUE(detector.read_predicted(picture, std::array{other}).empty());
  const cv::Mat empty(picture.size(), CV_8UC1, cv::Scalar(128));
  EXPECT_TRUE(detector.read_predicted(with_brightness(empty, 1, 2, 3), std::array{there}).empty());
}

TEST(TagDetector, DoesNotTakeHalfATagForAnother) {
  // Tags 8 and 19 differ in 2 cells of their left halves.
  const SyntheticCamera camera;
  std::mt19937_64 rng(14);
  SyntheticTag tag = place_tag(camera, 60, 0, 0);
  tag.id = 19;
  cv::Mat picture = render(tag, camera, rng);
  const auto truth = true_corners(tag, camera);
  const PredictedTag as_19{.id = 19, .corner_px = truth, .motion_px = {}};
  const PredictedTag as_8{.id = 8, .corner_px = truth, .motion_px = {}};
  constexpr std::array kIds = {8, 19};
  TagDetector detector("tag36h11");
  EXPECT_EQ(detector.read_predicted(picture, std::array{as_19}, kIds).size(), 1U);

  const cv::Point middle(static_cast<int>((truth[0].x() + truth[1].x()) / 2), 0);
  cv::rectangle(picture, middle, cv::Point(picture.cols, picture.rows), cv::Scalar(125),
                cv::FILLED);

  EXPECT_TRUE(detector.read_predicted(picture, std::array{as_8}, kIds).empty());
}

TEST(TagDetector, ReadsNothingWhereATagIsExpectedEdgeOn) {
  const cv::Mat picture(200, 200, CV_8UC1, cv::Scalar(128));
  const PredictedTag edge_on{
      .id = 0,
      .corner_px = {Eigen::Vector2d(20, 100), {180, 100.4}, {182, 100}, {22, 99.6}},
      .motion_px = {}};
  const PredictedTag crossed{
      .id = 0,
      .corner_px = {Eigen::Vector2d(50, 150), {150, 150}, {50, 50}, {150, 50}},
      .motion_px = {}};

  EXPECT_TRUE(
      TagDetector("tag36h11").read_predicted(picture, std::array{edge_on, crossed}).empty());
}

TEST(TagDetector, SaysWhichCornerIsHidden) {
  const SyntheticCamera camera;
  std::mt19937_64 rng(13);
  const SyntheticTag tag = place_tag(camera, 60, 0, 0);
  cv::Mat picture = render(tag, camera, rng);
  const auto truth = true_corners(tag, camera);
  const cv::Point corner(static_cast<int>(truth[2].x()), static_cast<int>(truth[2].y()));
  cv::rectangle(picture, corner + cv::Point(-12, -12), corner + cv::Point(12, 12), cv::Scalar(150),
                cv::FILLED);
  const PredictedTag there{.id = 0, .corner_px = truth, .motion_px = {}};

  const auto read = TagDetector("tag36h11").read_predicted(picture, std::array{there});

  ASSERT_EQ(read.size(), 1U);
  EXPECT_LT(read[0].corner_seen[2], 0.4);
  for (const size_t c : {0U, 1U, 3U}) {
    EXPECT_GT(read[0].corner_seen[c], 0.8);
    EXPECT_LT((read[0].corner_px[c] - truth[c]).norm(), 0.15);
  }
}

}  // namespace
}  // namespace clothfit
