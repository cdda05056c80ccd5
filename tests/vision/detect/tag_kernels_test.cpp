// Checks the loops over a tag's samples against plain arithmetic: derivatives against differences,
// sums against dense products, and the fit's own on each instruction set against the others.

#include "vision/detect/tag_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

#include "tests/model/instruction_sets.h"
#include "vision/detect/blurred_pattern.h"
#include "vision/detect/tag_family.h"

namespace clothfit {
namespace {

constexpr int kUnknowns = 35;
constexpr double kHalfSide_px = 20;

/// A tag 40 px wide under a model that is off everywhere a little, and its samples.
struct OddTag {
  OddTag()
      : pattern(printed_tag(*make_tag_family("tag36h11"), 3)),
        blurred(pattern, kHalfSide_px * Eigen::Matrix2d::Identity(),
                PictureBlur(PictureBlur::unknowns(0.6, {2, 1}))) {
    std::mt19937_64 rng(5);
    std::normal_distribution<float> normal;
    samples.count = 1500;  // not a multiple of what is taken together
    const Eigen::Index size = 1536;
    samples.x = samples.y = samples.grey = Eigen::ArrayXf::Zero(size);
    for (Eigen::Index i = 0; i < samples.count; ++i) {
      samples.x[i] = static_cast<float>(i % 39 - 19) / 18;
      samples.y[i] = static_cast<float>(i / 39 - 19) / 18;
      samples.grey[i] = 120 + 40 * normal(rng);
    }
    model.grid = blurred.grid();
    for (float& one : model.bend_x) one = 0.01F * normal(rng);
    for (float& one : model.bend_y) one = 0.01F * normal(rng);
    model.offset = {40, 3, -2};
    model.contrast = {150, -4, 5};
    model.by_blur = {{{4e-4F, 1e-4F, 5e-4F}, {2e-4F, 3e-4F, -1e-4F}, {-3e-4F, 2e-4F, 1e-4F}}};
    model.tag_by_pixel = {0.05F, 0, 0, 0.05F};
  }

  TagRows rows(const TagModel& of) const {
    TagRows result;
    evaluate_rows(of, samples, result);
    weigh_rows({.noise_levels = 2, .roughness_px = 0.1F, .loss = 3}, samples, result);
    return result;
  }

  TagPattern pattern;
  BlurredPattern blurred;
  TagSamples samples;
  TagModel model;
};

/// Returns the unknown at a place in the order of TagUnknowns.
float* unknown(TagModel& model, int k) {
  if (k < 10) return &model.bend_x[static_cast<size_t>(k)];
  if (k < 20) return &model.bend_y[static_cast<size_t>(k - 10)];
  if (k < 23) return &model.blur_change[static_cast<size_t>(k - 20)];
  if (k < 29) return &model.blur_slope[static_cast<size_t>(k - 23)];
  if (k < 32) return &model.offset[static_cast<size_t>(k - 29)];
  return &model.contrast[static_cast<size_t>(k - 32)];
}

/// Returns the derivatives of the grey levels by differences.
Eigen::MatrixXd jacobian(const OddTag& tag) {
  Eigen::MatrixXd result(tag.samples.count, kUnknowns);
  for (int k = 0; k < kUnknowns; ++k) {
    TagModel up = tag.model, down = tag.model;
    const float step = k < 29 ? 2e-3F : 1.0F;
    *unknown(up, k) += step;
    *unknown(down, k) -= step;
    const double apart = static_cast<double>(*unknown(up, k)) - *unknown(down, k);
    result.col(k) = ((tag.rows(down).residual - tag.rows(up).residual).head(tag.samples.count) /
                     static_cast<float>(apart))
                        .matrix()
                        .cast<double>();
  }
  return result;
}

TEST(TagKernels, NormalEquationsAreThoseOfTheDerivatives) {
  const OddTag tag;
  const TagRows rows = tag.rows(tag.model);
  Eigen::MatrixXd by = jacobian(tag);
  const FlatLimits limits = flat_limits(rows);
  for (Eigen::Index i = 0; i < tag.samples.count; ++i) {
    bool flat = rows.slope[i] <= limits.slope;
    for (size_t k = 0; k < 3; ++k) flat = flat && std::abs(rows.by_blur[k][i]) <= limits.by_blur[k];
    if (flat) by.row(i).head<29>().setZero();
  }
  const Eigen::VectorXd weight = rows.weight.head(tag.samples.count).matrix().cast<double>();
  const Eigen::VectorXd residual = rows.residual.head(tag.samples.count).matrix().cast<double>();

  const NormalEquations equations = normal_equations(tag.samples, rows);

  const Eigen::MatrixXd information = by.transpose() * weight.asDiagonal() * by;
  const Eigen::VectorXd scale = information.diagonal().cwiseSqrt();
  EXPECT_LT((equations.information - information)
                .cwiseQuotient(scale * scale.transpose())
                .cwiseAbs()
                .maxCoeff(),
            3e-3);
  const Eigen::VectorXd gradient = by.transpose() * weight.cwiseProduct(residual);
  EXPECT_LT((equations.gradient - gradient).cwiseQuotient(scale).norm(),
            3e-3 * gradient.cwiseQuotient(scale).norm());
}

TEST(TagKernels, ResidualSumsAreSharesOfTheDerivatives) {
  const OddTag tag;
  const TagRows rows = tag.rows(tag.model);
  const Eigen::Matrix<float, 35, 16, Eigen::RowMajor> combination =
      Eigen::Matrix<float, 35, 16>::Random();
  const Eigen::ArrayXf share = Eigen::ArrayXf::LinSpaced(tag.samples.count, 0.5F, 2);

  const ResidualSums sums = residual_sums(tag.samples, rows, share, combination);

  const Eigen::MatrixXd expected =
      share.matrix().cast<double>().asDiagonal() * jacobian(tag) * combination.cast<double>();
  EXPECT_LT((sums.cast<double>() - expected).norm(), 3e-3 * expected.norm());
}

TEST(TagKernels, PairSumsRunOverAllPairsAtALag) {
  constexpr int kWidth = 21, kHeight = 13;
  SampleMaps maps{.stride = 32 + SampleMaps::kReach, .rows = kHeight};
  const Eigen::Index size = (kHeight + SampleMaps::kReach) * maps.stride + 2 * SampleMaps::kReach;
  maps.there = maps.residual = maps.gradient_u = maps.gradient_v = Eigen::ArrayXf::Zero(size);
  std::mt19937_64 rng(8);
  std::normal_distribution<float> normal;
  const auto at = [&](int u, int v) { return SampleMaps::kReach + v * maps.stride + u; };
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      maps.there[at(u, v)] = 1;
      for (Eigen::ArrayXf* map : {&maps.residual, &maps.gradient_u, &maps.gradient_v})
        (*map)[at(u, v)] = normal(rng);
    }
  for (const auto& [across, down] : {std::pair(0, 0), {3, 0}, {-6, 6}, {0, 12}}) {
    const PairSums sums = pair_sums(maps, across, down);
    double pairs = 0, mixed = 0;
    for (int v = 0; v + down < kHeight; ++v)
      for (int u = std::max(0, -across); u < kWidth && u + across < kWidth; ++u) {
        const int i = at(u, v), j = at(u + across, v + down);
        ++pairs;
        mixed +=
            maps.residual[i] * maps.residual[j] *
            (maps.gradient_u[i] * maps.gradient_u[j] + maps.gradient_v[i] * maps.gradient_v[j]);
      }
    EXPECT_EQ(sums.pairs, pairs) << across << " " << down;
    EXPECT_NEAR(sums.mixed, mixed, 1e-4 * pairs) << across << " " << down;
  }
}

TEST(TagKernels, ShiftsAddUpWithTheirWeights) {
  constexpr int kSide = 19, kFrom = 23;
  const Eigen::ArrayXf from = Eigen::ArrayXf::LinSpaced(kFrom * kFrom, 0, 1).square();
  const std::vector<GridShift> shifts = {{.columns = 0, .rows = 4, .weight = 0.25F},
                                         {.columns = 3, .rows = 1, .weight = 0.75F}};
  Eigen::ArrayXf to = Eigen::ArrayXf::Zero(kSide * kSide);

  sum_of_shifts(from.data(), kFrom, shifts, kSide, to.data());

  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column)
      EXPECT_NEAR(
          to[row * kSide + column],
          0.25F * from[(row + 4) * kFrom + column] + 0.75F * from[(row + 1) * kFrom + column + 3],
          1e-6);
}

TEST(TagKernels, GivesTheSameBitsOnEachInstructionSet) {
  const OddTag tag;
  const TagRows rows = tag.rows(tag.model);
  const NormalEquations equations = normal_equations(tag.samples, rows);
  for (const InstructionSet& set : instruction_sets()) {
    const OnInstructionSet only(set);
    const TagRows here = tag.rows(tag.model);
    EXPECT_TRUE((here.residual == rows.residual).all());
    EXPECT_TRUE((here.weight == rows.weight).all());
    EXPECT_TRUE((here.slope == rows.slope).all());
    const NormalEquations same = normal_equations(tag.samples, here);
    EXPECT_EQ(same.information, equations.information);
    EXPECT_EQ(same.gradient, equations.gradient);
  }
}

}  // namespace
}  // namespace clothfit
