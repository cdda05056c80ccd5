// Checks tags rendered at known corners: order, pixel centres, bias, sigma. Tracking of detections
// over time is checked in track_test.cpp.

#include "vision/detect/tag_detector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "data/input_error.h"
#include "tests/vision/synthetic_tag.h"
#include "vision/detect/tag_family.h"

namespace clothfit {
namespace {

constexpr double kRightAngle = M_PI / 2;

/// Errors of many detections against the truth.
struct Errors {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double rms = 0;   ///< per coordinate
  double chi2 = 0;  ///< mean of (error / sigma)^2 per coordinate
  int corners = 0;

  void add(const TagDetection& found, const std::array<Eigen::Vector2d, 4>& truth) {
    for (size_t c = 0; c < 4; ++c) {
      const Eigen::Vector2d error = found.corner_px[c] - truth[c];
      mean += error;
      rms += error.squaredNorm() / 2;
      chi2 += error.squaredNorm() / 2 / (found.sigma_px[c] * found.sigma_px[c]);
      ++corners;
    }
  }
  void finish() {
    mean /= corners;
    rms = std::sqrt(rms / corners);
    chi2 /= corners;
  }
};

/// Detects tags 25 to 45 px wide in all turns, tilted up to 45 degrees, at all places within a
/// pixel.
Errors detect_many(int tags, double radius, std::uint64_t seed, const SyntheticCamera& camera) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  TagDetector detector("tag36h11");
  Errors errors;
  int missed = 0;
  for (int i = 0; i < tags; ++i) {
    SyntheticTag tag = place_tag(camera, 25 + 20 * unit(rng), 2 * M_PI * unit(rng),
                                 (unit(rng) - 0.5) * M_PI / 2, {unit(rng), unit(rng)});
    tag.id = i;
    tag.radius = radius;
    const std::vector<TagDetection> found = detector.detect(render(tag, camera, rng));
    if (found.size() != 1 || !found[0].refined) {
      ++missed;
      continue;
    }
    EXPECT_EQ(found[0].id, i);
    errors.add(found[0], true_corners(tag, camera));
  }
  EXPECT_LE(missed, tags / 10);
  errors.finish();
  return errors;
}

TEST(TagDetector, NumbersCornersFromTheBottomLeftOfTheUprightTag) {
  // On an upright tag the bottom left corner lies at the left and below in the picture.
  const SyntheticCamera camera;
  std::mt19937_64 rng(1);
  for (const std::string family : {"tag36h11", "tag25h9", "tag16h5", "tagStandard41h12"}) {
    TagDetector detector(family);
    for (int quarter = 0; quarter < 4; ++quarter) {
      SCOPED_TRACE(family + ", quarter turns: " + std::to_string(quarter));
      SyntheticTag tag = place_tag(camera, 60, quarter * kRightAngle, 0);
      tag.family = family;
      tag.id = 3;

      const std::vector<TagDetection> found = detector.detect(render(tag, camera, rng));

      // A code of 16 bits is read into other things, too, with corrected bits.
      const auto tag_3 = std::find_if(found.begin(), found.end(), [](const TagDetection& d) {
        return d.id == 3 && d.corrected_bits == 0;
      });
      ASSERT_NE(tag_3, found.end());
      EXPECT_TRUE(tag_3->refined);
      const auto truth = true_corners(tag, camera);
      if (quarter == 0) {
        EXPECT_LT(truth[0].x(), truth[1].x());
        EXPECT_GT(truth[0].y(), truth[3].y());
      }
      for (size_t c = 0; c < 4; ++c)
        EXPECT_LT((tag_3->corner_px[c] - truth[c]).norm(), 0.2) << "corner " << c;
    }
  }
}

TEST(TagDetector, PutsPixelZeroAtTheCentreOfTheTopLeftPixel) {
  // A picture turned by half a turn maps pixel u to width - 1 - u. Places that are half a pixel off
  // both ways would come out a whole pixel apart.
  const SyntheticCamera camera;
  std::mt19937_64 rng(2);
  const SyntheticTag tag = place_tag(camera, 50, 0.3, 0.2, {0.4, -0.3});
  const cv::Mat picture = render(tag, camera, rng);
  cv::Mat turned;
  cv::rotate(picture, turned, cv::ROTATE_180);
  TagDetector detector("tag36h11");

  const auto upright = detector.detect(picture);
  const auto around = detector.detect(turned);

  ASSERT_EQ(upright.size(), 1U);
  ASSERT_EQ(around.size(), 1U);
  for (size_t c = 0; c < 4; ++c) {
    const Eigen::Vector2d sum = upright[0].corner_px[c] + around[0].corner_px[c];
    EXPECT_NEAR(sum.x(), camera.width - 1, 0.02);
    EXPECT_NEAR(sum.y(), camera.height - 1, 0.02);
  }
}

TEST(TagDetector, IsUnbiasedAndStatesHonestSigmaOnFlatTags) {
  const std::uint64_t seed = 3;
  SCOPED_TRACE(seed);

  const Errors errors = detect_many(100, INFINITY, seed, SyntheticCamera{});

  RecordProperty("rms_px", std::to_string(errors.rms));
  RecordProperty("chi2", std::to_string(errors.chi2));
  EXPECT_LT(errors.mean.norm(), 0.03);
  EXPECT_LT(errors.rms, 0.06);
  // There are 800 coordinates; the allowance for the next degree of bending is idle on a flat tag.
  EXPECT_GT(errors.chi2, 0.4);
  EXPECT_LT(errors.chi2, 1.4);
}

TEST(TagDetector, KeepsItsWordOnNoisierAndSofterPictures) {
  const std::uint64_t seed = 4;
  SCOPED_TRACE(seed);

  const Errors errors =
      detect_many(100, INFINITY, seed, SyntheticCamera{.blur_px = 1.1, .noise_levels = 6});

  EXPECT_LT(errors.mean.norm(), 0.05);
  EXPECT_GT(errors.chi2, 0.4);
  EXPECT_LT(errors.chi2, 1.4);
}

TEST(TagDetector, FollowsBentTagsWithinItsSigma) {
  // The radius is two tag widths. An edge that runs around the bend is off its chord by 3 % of the
  // tag where it is seen askew.
  for (const double radius : {4.0, 8.0}) {
    const std::uint64_t seed = 5;
    SCOPED_TRACE(testing::Message() << "seed " << seed << " radius " << radius);

    const Errors errors = detect_many(60, radius, seed, SyntheticCamera{});

    EXPECT_LT(errors.mean.norm(), 0.03);
    EXPECT_LT(errors.rms, 0.1);
    EXPECT_LT(errors.chi2, 1.6);
  }
}

TEST(TagDetector, TrustsAHiddenCornerLess) {
  const SyntheticCamera camera;
  std::mt19937_64 rng(6);
  const SyntheticTag tag = place_tag(camera, 60, 0, 0);
  cv::Mat picture = render(tag, camera, rng);
  const auto truth = true_corners(tag, camera);
  TagDetector detector("tag36h11");
  const auto clear = detector.detect(picture);
  ASSERT_EQ(clear.size(), 1U);

  // A grey patch lies over corner 2, small enough for the code to be read.
  const cv::Point corner(static_cast<int>(truth[2].x()), static_cast<int>(truth[2].y()));
  cv::rectangle(picture, corner + cv::Point(-7, -7), corner + cv::Point(7, 7), cv::Scalar(125),
                cv::FILLED);
  const auto hidden = detector.detect(picture);

  ASSERT_EQ(hidden.size(), 1U);
  ASSERT_TRUE(hidden[0].refined);
  EXPECT_LT(hidden[0].explained, clear[0].explained);
  EXPECT_GT(hidden[0].sigma_px[2], 1.15 * clear[0].sigma_px[2]);
  EXPECT_LT((hidden[0].corner_px[2] - truth[2]).norm(), 5 * hidden[0].sigma_px[2]);
}

TEST(TagDetector, KnowsItsFamiliesAndRefusesOthers) {
  EXPECT_THAT(tag_families(), testing::IsSupersetOf({"tag16h5", "tag25h9", "tag36h11",
                                                     "tagStandard41h12", "tagCircle21h7"}));
  try {
    TagDetector detector("tag36h12");
    FAIL() << "was accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("unknown tag family 'tag36h12'"));
    EXPECT_THAT(error.what(), testing::HasSubstr("tag36h11"));
  }
}

TEST(TagDetector, FindsNothingWhereThereIsNothing) {
  TagDetector detector("tag36h11");

  EXPECT_TRUE(detector.detect(cv::Mat(100, 100, CV_8UC1, cv::Scalar(128))).empty());
}

}  // namespace
}  // namespace clothfit
