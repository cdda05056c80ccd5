// Checks the loops over a dot's pixels against plain arithmetic: the model against its formula,
// derivatives against differences, sums against dense products, and each instruction set against
// the others. How well dots are placed stands in dot_detector_test.cpp.

#include "vision/detect/dot_kernels.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/model/instruction_sets.h"

namespace clothfit {
namespace {

constexpr int kColumns = 23, kRows = 21;
constexpr DotWeights kWeights{.square_noise = 4, .square_roughness = 0.01F, .square_loss = 9};

/// A dot of radius 6 px and 5 px in a picture of noise, under a model that is a little off.
struct OddDot {
  OddDot() {
    std::mt19937_64 rng(5);
    std::normal_distribution<double> normal(0, 3);
    for (int v = 0; v < kRows; ++v)
      for (int u = 0; u < kColumns; ++u) {
        const double inside = std::hypot((u - 11.3) / 6, (v - 10.1) / 5) < 1 ? 1 : 0;
        picture.push_back(static_cast<std::uint8_t>(200 - 150 * inside + normal(rng)));
      }
    shape = {.x = 0.2F,
             .y = 0.3F,
             .inverse = {0.16F, 0.01F, 0.19F},
             .blur = {0.9F, 0.2F, 0.6F},
             .contrast = 0.7F,
             .light = {195, 4, -6},
             .per_light_scale = 0.1F};
  }

  PixelBox box() const {
    return {.first = picture.data(),
            .row_bytes = kColumns,
            .columns = kColumns,
            .rows = kRows,
            .left = -11,
            .top = -10};
  }
  DotReach reach() const {
    return {.x = shape.x, .y = shape.y, .inverse = shape.inverse, .beyond_px = 3, .ratio = 1.8F};
  }
  DotPixels pixels() const {
    DotPixels result;
    gather_dot(box(), reach(), result);
    return result;
  }
  DarkSums dark() const { return dark_sums(box(), reach(), 180, false); }

  std::vector<std::uint8_t> picture;
  DotShape shape;
};

/// The model's grey level at a pixel, by the formula.
double model_levels(const DotShape& shape, double x, double y) {
  Eigen::Matrix2d b, spread;
  b << shape.inverse[0], shape.inverse[1], shape.inverse[1], shape.inverse[2];
  spread << shape.blur[0], shape.blur[1], shape.blur[1], shape.blur[2];
  const Eigen::Vector2d q = b * (Eigen::Vector2d(x, y) - Eigen::Vector2d(shape.x, shape.y));
  const Eigen::Vector2d gradient = b * q.normalized();
  const Eigen::Vector2d normal = gradient.normalized();
  const double radius = std::sqrt(q.squaredNorm() + shape.across);
  const double distance = (radius - 1) / gradient.norm() / std::sqrt(normal.dot(spread * normal));
  const double light =
      shape.light[0] + shape.per_light_scale * (shape.light[1] * x + shape.light[2] * y);
  return light * (1 - shape.contrast * 0.5 * std::erfc(distance * M_SQRT1_2));
}

Eigen::VectorXd head(const DotRow& row, int count) {
  return Eigen::Map<const Eigen::VectorXf>(row.data(), count).cast<double>();
}

Eigen::MatrixXd jacobian(const DotRows& rows, int count) {
  Eigen::MatrixXd by(count, kDotUnknowns);
  for (int k = 0; k < kDotUnknowns; ++k)
    by.col(k) = head(rows.jacobian[static_cast<size_t>(k)], count);
  return by;
}

TEST(DotKernels, GathersThePixelsWithinReachRowByRow) {
  const OddDot dot;

  const DotPixels pixels = dot.pixels();

  ASSERT_GT(pixels.count, 150);
  ASSERT_LT(pixels.count, kColumns * kRows);
  float darkest = 255;
  for (size_t i = 0; i < static_cast<size_t>(pixels.count); ++i) {
    const int u = static_cast<int>(pixels.x[i]) + 11, v = static_cast<int>(pixels.y[i]) + 10;
    EXPECT_EQ(pixels.grey[i], dot.picture[static_cast<size_t>(v * kColumns + u)]);
    darkest = std::min(darkest, pixels.grey[i]);
    if (i == 0) continue;
    EXPECT_TRUE(pixels.y[i] > pixels.y[i - 1] ||
                (pixels.y[i] == pixels.y[i - 1] && pixels.x[i] > pixels.x[i - 1]));
  }
  EXPECT_EQ(pixels.darkest, darkest);
}

TEST(DotKernels, EvaluatesTheModelAndItsDerivatives) {
  OddDot dot;
  dot.shape.across = 0.02F;
  const DotPixels pixels = dot.pixels();
  DotRows rows;

  evaluate_dot(dot.shape, pixels, rows);

  const float step = 0.01F;
  for (size_t i = 0; i < static_cast<size_t>(pixels.count); ++i) {
    const double x = pixels.x[i], y = pixels.y[i];
    EXPECT_NEAR(rows.residual[i], pixels.grey[i] - model_levels(dot.shape, x, y), 2e-3);
    DotShape up = dot.shape, down = dot.shape;
    up.x += step;
    down.x -= step;
    const double by_x = (model_levels(up, x, y) - model_levels(down, x, y)) / (up.x - down.x);
    // What the derivative leaves out is a tenth near the outline of such an ellipse.
    EXPECT_NEAR(rows.jacobian[0][i], by_x, 0.1 * std::abs(by_x) + 3) << x << " " << y;
  }
}

TEST(DotKernels, EquationsAreThoseOfTheDerivatives) {
  const OddDot dot;
  const DotPixels pixels = dot.pixels();
  DotRows rows;
  evaluate_dot(dot.shape, pixels, rows);

  const DotEquations equations = dot_equations(pixels, kWeights, rows);

  const Eigen::MatrixXd by = jacobian(rows, pixels.count);
  const Eigen::VectorXd residual = head(rows.residual, pixels.count);
  const Eigen::ArrayXd variance = 4 + 0.01 * head(rows.slope, pixels.count).array().square();
  const Eigen::ArrayXd robust = (1 + residual.array().square() / (9 * variance)).inverse();
  const Eigen::VectorXd weight = robust / variance;
  EXPECT_NEAR(equations.explained, robust.mean(), 1e-5);
  const Eigen::MatrixXd information = by.transpose() * weight.asDiagonal() * by;
  const Eigen::VectorXd gradient = by.transpose() * weight.cwiseProduct(residual);
  for (int a = 0; a < kDotUnknowns; ++a) {
    const double scale = std::sqrt(information(a, a));
    const auto row = static_cast<size_t>(a);
    EXPECT_NEAR(equations.gradient[row] / scale, gradient[a] / scale, 1e-3);
    for (int b = 0; b <= a; ++b)
      EXPECT_NEAR(equations.information[row][static_cast<size_t>(b)] /
                      (scale * std::sqrt(information(b, b))),
                  information(a, b) / (scale * std::sqrt(information(b, b))), 1e-5);
  }
}

TEST(DotKernels, MediansAreRightToAThousandth) {
  const OddDot dot;
  const DotPixels pixels = dot.pixels();
  DotRows rows;
  evaluate_dot(dot.shape, pixels, rows);

  const DotResiduals residuals = dot_residuals(pixels, rows);

  std::vector<float> flat, steep;
  for (size_t i = 0; i < static_cast<size_t>(pixels.count); ++i) {
    if (rows.slope[i] < 0.1F * rows.steepest) flat.push_back(std::abs(rows.residual[i]));
    if (rows.slope[i] > 0.4F * rows.steepest)
      steep.push_back(std::abs(rows.residual[i]) / rows.slope[i]);
  }
  std::ranges::sort(flat);
  std::ranges::sort(steep);
  ASSERT_EQ(residuals.flat, static_cast<int>(flat.size()));
  ASSERT_EQ(residuals.steep, static_cast<int>(steep.size()));
  const float middle_levels = flat[flat.size() / 2], middle_px = steep[steep.size() / 2];
  EXPECT_NEAR(residuals.flat_levels, middle_levels, 1e-3F * middle_levels);
  EXPECT_NEAR(residuals.steep_px, middle_px, 1e-3F * middle_px);
}

TEST(DotKernels, GivesTheSameBitsOnEachInstructionSet) {
  const OddDot dot;
  const DotPixels pixels = dot.pixels();
  DotRows rows;
  evaluate_dot(dot.shape, pixels, rows);
  const DotResiduals residuals = dot_residuals(pixels, rows);
  const DotEquations equations = dot_equations(pixels, kWeights, rows);
  const DotWaves waves = dot_waves(dot.shape, pixels, rows);
  const DarkSums dark = dot.dark();
  ASSERT_GT(dark.weight, 0);
  for (const InstructionSet& set : instruction_sets()) {
    SCOPED_TRACE(set.name());
    const OnInstructionSet only(set);
    const DotPixels same = dot.pixels();
    ASSERT_EQ(same.count, pixels.count);
    EXPECT_EQ(head(same.x, same.count), head(pixels.x, same.count));
    DotRows here;
    evaluate_dot(dot.shape, same, here);
    EXPECT_EQ(jacobian(here, same.count), jacobian(rows, same.count));
    EXPECT_EQ(dot_residuals(same, here).flat_levels, residuals.flat_levels);
    EXPECT_EQ(dot_residuals(same, here).steep_px, residuals.steep_px);
    EXPECT_EQ(dot_residuals(same, here).square_slopes, residuals.square_slopes);
    const DotEquations again = dot_equations(same, kWeights, here);
    for (size_t a = 0; a < kDotUnknowns; ++a)
      for (size_t b = 0; b <= a; ++b)
        EXPECT_EQ(again.information[a][b], equations.information[a][b]);
    EXPECT_EQ(again.gradient, equations.gradient);
    const DotWaves other = dot_waves(dot.shape, same, here);
    EXPECT_EQ(other.square_residuals, waves.square_residuals);
    for (size_t k = 0; k < 3; ++k)
      for (size_t part = 0; part < 2; ++part) {
        EXPECT_EQ(other.waves[k][part].score, waves.waves[k][part].score);
        EXPECT_EQ(other.waves[k][part].information, waves.waves[k][part].information);
        EXPECT_EQ(other.waves[k][part].plain_score, waves.waves[k][part].plain_score);
        EXPECT_EQ(other.waves[k][part].plain_information, waves.waves[k][part].plain_information);
      }
    const DarkSums dark_here = dot.dark();
    EXPECT_EQ(dark_here.weight, dark.weight);
    EXPECT_EQ(dark_here.x, dark.x);
    EXPECT_EQ(dark_here.y, dark.y);
  }
}

}  // namespace
}  // namespace clothfit
