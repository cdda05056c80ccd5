// Checks the alignment of one patch on drawn textures: warps, light, blur, derivatives, sigma.
// Whole sheets are in texture_tracker_test.cpp, rendered cloth in
// apps/study/vision/judge_texture_test.cpp.

#include "vision/texture/align_patch.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "tests/vision/drawn_texture.h"
#include "vision/texture/residual_correlation.h"

namespace clothfit {
namespace {

constexpr double kBlur_px = 0.7;
const Eigen::Vector2d kMarker_px(60.3, 55.8);
const cv::Size kPatchPicture(120, 110);

bool everywhere(const Eigen::Vector2d&) {
  return true;
}

/// Returns the place of the first picture that a warp takes to `place_px`.
Eigen::Vector2d inverse(const PatchWarp& warp, const Eigen::Vector2d& place_px) {
  Eigen::Vector2d from = warp.linear.inverse() * (place_px - warp.place_px);
  for (int i = 0; i < 20; ++i) from -= warp.jacobian(from).inverse() * (warp.at(from) - place_px);
  return kMarker_px + from;
}

class AlignPatch : public ::testing::Test {
 protected:
  AlignPatch() {
    SCOPED_TRACE(kSeed);
    first_ = SmoothPicture(texture_.draw(kPatchPicture, [](const auto& y) { return y; }), kBlur_px);
    patch_ = make_texture_patch(first_, kMarker_px, 13, 1, everywhere);
  }
  cv::Mat warped(const PatchWarp& warp, double noise_levels = 0, std::uint64_t seed = 1,
                 const std::function<double(const Eigen::Vector2d&, double)>& light = {}) const {
    return texture_.draw(
        kPatchPicture, [&](const Eigen::Vector2d& y) { return inverse(warp, y); }, noise_levels,
        seed, light);
  }

  static constexpr std::uint64_t kSeed = 11;
  DrawnTexture texture_{kSeed};
  SmoothPicture first_;
  TexturePatch patch_;
};

PatchWarp near(const PatchWarp& warp, double off_px) {
  PatchWarp start;
  start.place_px = warp.place_px + Eigen::Vector2d(off_px, -0.7 * off_px);
  return start;
}

TEST_F(AlignPatch, RecoversTranslationsAffineAndQuadraticWarps) {
  PatchWarp translated, affine, quadratic;
  translated.place_px = {63.45, 52.31};
  affine.place_px = {58.7, 57.2};
  affine.linear << 0.9, 0.08, -0.12, 0.95;
  quadratic = affine;
  quadratic.second << 0.006, -0.003, 0.002, 0.001, 0.004, -0.005;  // up to half a px at the rim
  for (const PatchWarp& warp : {translated, affine, quadratic}) {
    const PatchFit fit =
        align_patch(SmoothPicture(warped(warp), kBlur_px), patch_, near(warp, 1.2));
    ASSERT_TRUE(fit.converged());
    EXPECT_LT((fit.warp.place_px - warp.place_px).norm(), 0.02);
    EXPECT_LT((fit.warp.linear - warp.linear).norm(), 0.01);
    EXPECT_GT(fit.explained, 0.97);
  }
}

TEST_F(AlignPatch, FollowsChangesOfLightAcrossThePatch) {
  PatchWarp warp;
  warp.place_px = {61.2, 54.9};
  const cv::Mat picture = warped(warp, 0, 1, [](const Eigen::Vector2d& y, double level) {
    return (0.55 + 0.004 * (y.x() - 60)) * level + 15;
  });
  const PatchFit fit = align_patch(SmoothPicture(picture, kBlur_px), patch_, near(warp, 1));
  ASSERT_TRUE(fit.converged());
  EXPECT_LT((fit.warp.place_px - warp.place_px).norm(), 0.02);
  EXPECT_NEAR(fit.gain, 0.55, 0.03);
}

TEST_F(AlignPatch, IsNotMovedByBlurAlongALine) {
  PatchWarp warp;
  warp.place_px = {61.2, 54.9};
  cv::Mat picture = warped(warp);
  const cv::Mat line = cv::Mat::ones(1, 3, CV_32F) / 3.0;
  cv::filter2D(picture, picture, -1, line);
  const PatchFit fit = align_patch(SmoothPicture(picture, kBlur_px), patch_, near(warp, 1));
  ASSERT_TRUE(fit.converged());
  EXPECT_LT((fit.warp.place_px - warp.place_px).norm(), 0.02);
  EXPECT_GT(fit.explained, 0.97);
}

TEST_F(AlignPatch, HasTheDerivativesOfItsResiduals) {
  PatchWarp warp;
  warp.place_px = {61.2, 54.9};
  warp.second << 0.004, -0.003, 0.002, 0.001, 0.004, -0.005;
  const SmoothPicture picture(warped(warp), kBlur_px);
  align::Unknowns at = align::to_unknowns(warp, patch_.radius_px);
  at.tail<7>() << 0.9, 0.05, -0.03, 120, 0.1, -0.2, 0.15;
  const align::Linearised here = align::linearise(picture, patch_, at);
  for (int k = 0; k < align::kUnknowns; ++k) {
    SCOPED_TRACE(k);
    constexpr double kStep = 0.02;  // places are single precision: 0.02 px is known to 1e-4
    align::Unknowns more = at, less = at;
    more[k] += kStep;
    less[k] -= kStep;
    const Eigen::VectorXf difference = (align::linearise(picture, patch_, more).residual -
                                        align::linearise(picture, patch_, less).residual) /
                                       (2 * static_cast<float>(kStep));
    const float scale = 1 + here.jacobian.col(k).cwiseAbs().maxCoeff();
    EXPECT_LT((difference - here.jacobian.col(k)).cwiseAbs().maxCoeff(), 0.01F * scale);
  }
}

TEST_F(AlignPatch, StatesASigmaThatIsHonestUnderNoise) {
  PatchWarp warp;
  warp.place_px = {62.37, 54.1};
  warp.linear << 0.97, 0.03, -0.05, 1.02;
  double scaled = 0;
  constexpr int kPictures = 60;
  for (int k = 0; k < kPictures; ++k) {
    const auto seed = static_cast<std::uint64_t>(100 + k);
    SCOPED_TRACE(seed);
    const PatchFit fit =
        align_patch(SmoothPicture(warped(warp, 5, seed), kBlur_px), patch_, near(warp, 0.5));
    ASSERT_TRUE(fit.converged());
    ResidualCorrelation correlation;
    correlation.add(patch_, fit);
    scaled += (fit.warp.place_px - warp.place_px).squaredNorm() /
              correlation.place_covariance_px2(patch_, fit).trace();
  }
  EXPECT_NEAR(std::sqrt(scaled / kPictures), 1, 0.25);
}

TEST_F(AlignPatch, LosesAPatchThatIsCoveredOrOutside) {
  PatchWarp warp;
  warp.place_px = kMarker_px;
  cv::Mat covered = warped(warp);
  cv::rectangle(covered, cv::Rect(40, 36, 40, 40), 90, cv::FILLED);
  const PatchFit fit = align_patch(SmoothPicture(covered, kBlur_px), patch_, warp);
  EXPECT_FALSE(fit.converged() && fit.explained > 0.5);
  PatchWarp outside;
  outside.place_px = {2, 50};
  EXPECT_EQ(align_patch(first_, patch_, outside).end, AlignEnd::outside);
}

TEST(SmoothPicture, RunsThroughASmoothPictureAndHasItsSlopes) {
  cv::Mat grey(40, 50, CV_8UC1);
  const auto wave = [](double u, double v) {
    return 128 + 100 * std::sin(0.5 * u) * std::cos(0.3 * v);
  };
  for (int v = 0; v < grey.rows; ++v)
    for (int u = 0; u < grey.cols; ++u)
      grey.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(std::lround(wave(u, v)));
  constexpr double kLittle_px = 0.2;  // blurs this wave by a hundredth
  const SmoothPicture picture(grey, kLittle_px);
  for (const Eigen::Vector2f& at : {Eigen::Vector2f(20.5F, 13.25F), Eigen::Vector2f(31, 22.75F)}) {
    const PictureSample sample = picture.at(at);
    const double u = double{at.x()}, v = double{at.y()};
    EXPECT_NEAR(double{sample.level}, wave(u, v), 1);
    EXPECT_NEAR(double{sample.slope.x()}, 50 * std::cos(0.5 * u) * std::cos(0.3 * v), 1.5);
    EXPECT_NEAR(double{sample.slope.y()}, -30 * std::sin(0.5 * u) * std::sin(0.3 * v), 1.5);
  }
}

TEST(TexturePatch, FindsNoPlaceInStripes) {
  cv::Mat stripes(60, 60, CV_8UC1);
  for (int v = 0; v < 60; ++v)
    for (int u = 0; u < 60; ++u)
      stripes.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(128 + 60 * std::sin(0.8 * u));
  const SmoothPicture picture(stripes, kBlur_px);
  const TexturePatch patch = make_texture_patch(picture, {30, 30}, 12, 1, everywhere);
  EXPECT_GT(attainable_sigma_px(patch, picture, 1.5), 1);
}

}  // namespace
}  // namespace clothfit
