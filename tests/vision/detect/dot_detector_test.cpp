// Checks dots drawn at known places: bias, sigma against scatter, blur, cuts, and what is found in
// a whole picture.

#include "vision/detect/dot_detector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <random>

#include "data/input_error.h"
#include "tests/vision/synthetic_dots.h"

namespace clothfit {
namespace {

using Change = std::function<void(SyntheticDotPicture&, std::mt19937_64&)>;

double unit(std::mt19937_64& rng) {
  return std::uniform_real_distribution<double>(0, 1)(rng);
}

Eigen::Vector2d direction(std::mt19937_64& rng) {
  const double angle = 2 * M_PI * unit(rng);
  return {std::cos(angle), std::sin(angle)};
}

/// Fits of many dots 8 to 10 px wide, tilted up to 57 degrees, at all places within a pixel.
struct Fits {
  std::vector<Dot> dots;
  std::vector<Eigen::Vector2d> error_px;
  int unsettled = 0;

  Eigen::Vector2d mean() const {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& error : error_px) sum += error;
    return sum / static_cast<double>(error_px.size());
  }
  double rms() const {
    double sum = 0;
    for (const Eigen::Vector2d& error : error_px) sum += error.squaredNorm() / 2;
    return std::sqrt(sum / static_cast<double>(error_px.size()));
  }
  /// Root of the mean squared error over the stated variance.
  double error_over_sigma() const {
    std::vector<const Dot*> all;
    for (const Dot& dot : dots) all.push_back(&dot);
    double sum = 0;
    for (size_t i = 0; i < dots.size(); ++i)
      sum += error_px[i].dot(dots[i].covariance_px2.inverse() * error_px[i]) / 2;
    return std::sqrt(sum / static_cast<double>(dots.size()) / covariance_factor(all));
  }
};

Fits fit_many(int count, std::uint64_t seed, const Change& change, double post_blur_px = 0) {
  std::mt19937_64 rng(seed);
  Fits fits;
  for (int i = 0; i < count; ++i) {
    SyntheticDotPicture picture;
    picture.width = picture.height = 40;
    const Eigen::Vector2d centre(20 + unit(rng), 20 + unit(rng));
    picture.dots = {tilted_dot(centre, 4 + unit(rng), unit(rng), M_PI * unit(rng))};
    change(picture, rng);
    cv::Mat grey = render(picture, rng);
    if (post_blur_px > 0) cv::GaussianBlur(grey, grey, {}, post_blur_px);
    const SyntheticDot& truth = picture.dots[0];
    DotStart start;
    start.outline.centre_px = truth.centre_px + direction(rng);
    start.outline.shape_px2 =
        (0.8 + 0.4 * unit(rng)) * truth.px_per_radius * truth.px_per_radius.transpose();
    const Dot dot = fit_dot(grey, start, {});
    if (!dot.good()) {
      ++fits.unsettled;
      continue;
    }
    fits.dots.push_back(dot);
    fits.error_px.push_back(dot.outline.centre_px - truth.centre_px);
  }
  return fits;
}

TEST(RefineDot, PutsPixelZeroAtTheCentreOfTheTopLeftPixel) {
  SyntheticDotPicture picture;
  picture.noise_levels = 0;
  picture.dots = {tilted_dot({30, 28}, 5, 0, 0)};
  std::mt19937_64 rng(1);
  const Dot dot = refine_dot(
      render(picture, rng),
      {.outline = {.centre_px = {31, 27.5}, .shape_px2 = 20 * Eigen::Matrix2d::Identity()}});
  ASSERT_TRUE(dot.good());
  EXPECT_NEAR((dot.outline.centre_px - Eigen::Vector2d(30, 28)).norm(), 0, 0.002);
  EXPECT_NEAR(dot.outline.radii_px()[0], 5, 0.01);
  EXPECT_NEAR(dot.outline.radii_px()[1], 5, 0.01);
  EXPECT_NEAR(dot.contrast, 0.9, 0.01);
}

TEST(RefineDot, IsUnbiasedInLightThatVaries) {
  const Fits fits = fit_many(120, 2, [](SyntheticDotPicture& picture, std::mt19937_64&) {
    picture.light_slope = {0.02, 0.01};  // per px: a fifth over a dot
  });
  EXPECT_EQ(fits.unsettled, 0);
  EXPECT_LT(fits.mean().norm(), 0.0025);
  EXPECT_LT(fits.rms(), 0.007);
}

TEST(RefineDot, IsUnbiasedUnderMotionBlurInAnyDirection) {
  for (const double motion_px : {3.0, 6.0}) {
    SCOPED_TRACE(motion_px);
    const Fits fits = fit_many(80, 3, [&](SyntheticDotPicture& picture, std::mt19937_64& rng) {
      picture.motion_px = motion_px * direction(rng);
    });
    EXPECT_LE(fits.unsettled, 2);
    EXPECT_LT(fits.mean().norm(), 0.004);
    EXPECT_LT(fits.rms(), 0.012);
  }
}

TEST(RefineDot, ErrsByItsSigmaUnderWhiteNoise) {
  const Fits fits = fit_many(
      200, 4, [](SyntheticDotPicture& picture, std::mt19937_64&) { picture.noise_levels = 8; });
  EXPECT_EQ(fits.unsettled, 0);
  EXPECT_LT(fits.rms(), 0.026);
  EXPECT_NEAR(fits.error_over_sigma(), 1, 0.15);
}

TEST(RefineDot, ErrsByItsSigmaWherePixelsErrTogether) {
  // Noise that a lens or a scaler blurred, and that of a codec.
  const Change noisy = [](SyntheticDotPicture& picture, std::mt19937_64&) {
    picture.noise_levels = 8;
  };
  EXPECT_NEAR(fit_many(200, 5, noisy, 0.8).error_over_sigma(), 1, 0.25);
  const Change compressed = [](SyntheticDotPicture& picture, std::mt19937_64&) {
    picture.noise_levels = 2;
    picture.jpeg_quality = 40;
  };
  EXPECT_NEAR(fit_many(200, 6, compressed).error_over_sigma(), 1, 0.25);
}

TEST(RefineDot, ShowsThatADotIsCutBeforeItsPlaceIsWrong) {
  const Fits whole = fit_many(60, 7, [](SyntheticDotPicture&, std::mt19937_64&) {});
  double most_px = 0;
  for (const Dot& dot : whole.dots) most_px = std::max(most_px, dot.waves_px);
  const Fits cut = fit_many(120, 8, [](SyntheticDotPicture& picture, std::mt19937_64& rng) {
    const SyntheticDot& dot = picture.dots[0];
    const Eigen::Vector2d normal = direction(rng);
    const double radius_px = (dot.px_per_radius.transpose() * normal).norm();
    picture.covers = {{.point_px = dot.centre_px + unit(rng) * radius_px * normal,
                       .normal = normal,
                       .level = unit(rng) < 0.5 ? 190.0 : 50.0}};
  });
  int moved = 0, unnoticed = 0;
  for (size_t i = 0; i < cut.dots.size(); ++i) {
    if (cut.error_px[i].norm() < 0.15) continue;
    ++moved;
    unnoticed += cut.dots[i].waves_px < 1.2 * most_px ? 1 : 0;
  }
  EXPECT_GT(moved, 30);
  EXPECT_EQ(unnoticed, 0);
}

TEST(FitDot, SaysWhyADotIsDoubted) {
  std::mt19937_64 rng(9);
  SyntheticDotPicture picture;
  picture.dots = {tilted_dot({1, 30}, 5, 0, 0)};
  const DotStart at_border{
      .outline = {.centre_px = {1, 30}, .shape_px2 = 25 * Eigen::Matrix2d::Identity()}};
  EXPECT_EQ(fit_dot(render(picture, rng), at_border, {}).doubt, DotDoubt::border);

  picture.dots = {tilted_dot({30, 30}, 5, 0, 0)};
  picture.ink = 0.9;
  DotStart in_middle = at_border;
  in_middle.outline.centre_px = {30, 30};
  EXPECT_EQ(fit_dot(render(picture, rng), in_middle, {}).doubt, DotDoubt::faint);
}

TEST(FindDots, FindsAllAndNothingElseInNoiseAndShade) {
  std::mt19937_64 rng(10);
  SyntheticDotPicture picture;
  picture.width = 200;
  picture.height = 160;
  picture.noise_levels = 6;
  picture.light_slope = {0.003, 0.002};
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 8; ++column)
      picture.dots.push_back(tilted_dot({14.3 + 24.1 * column, 14.7 + 25.3 * row}, 3 + 0.5 * row,
                                        0.15 * column, 0.4 * row));
  std::vector<Dot> good;
  for (const Dot& dot : find_dots(render(picture, rng)))
    if (dot.good()) good.push_back(dot);
  ASSERT_EQ(good.size(), picture.dots.size());
  for (const SyntheticDot& dot : picture.dots) {
    double nearest_px = 1e9;
    for (const Dot& found : good)
      nearest_px = std::min(nearest_px, (found.outline.centre_px - dot.centre_px).norm());
    EXPECT_LT(nearest_px, 0.12);
  }
}

TEST(FindDots, FindsBrightDotsWhereTheyAreAskedFor) {
  std::mt19937_64 rng(11);
  SyntheticDotPicture picture;
  picture.dots = {tilted_dot({30.4, 31.2}, 5, 0.5, 1)};
  const cv::Mat inverse = 255 - render(picture, rng);
  EXPECT_TRUE(find_dots(inverse).empty());
  const std::vector<Dot> dots = find_dots(inverse, {.bright = true});
  ASSERT_EQ(dots.size(), 1U);
  EXPECT_LT((dots[0].outline.centre_px - Eigen::Vector2d(30.4, 31.2)).norm(), 0.03);
}

TEST(FindDots, RefusesOptionsOutOfRange) {
  EXPECT_THROW(find_dots(cv::Mat::zeros(9, 9, CV_8UC1), {.smallest_radius_px = 0}), InputError);
}

}  // namespace
}  // namespace clothfit
