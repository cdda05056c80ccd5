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

/// Returns maps of noise over a box of samples.
SampleMaps noise_maps(int width, int height) {
  SampleMaps maps{.stride = 32 + SampleMaps::kReach, .rows = height};
  const Eigen::Index size = (height + SampleMaps::kReach) * maps.stride + 2 * SampleMaps::kReach;
  maps.there = maps.residual = maps.gradient_u = maps.gradient_v = Eigen::ArrayXf::Zero(size);
  std::mt19937_64 rng(8);
  std::normal_distribution<float> normal;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const int at = SampleMaps::kReach + v * maps.stride + u;
      maps.there[at] = 1;
      for (Eigen::ArrayXf* map : {&maps.residual, &maps.gradient_u, &maps.gradient_v})
        (*map)[at] = normal(rng);
    }
  return maps;
}

TEST(TagKernels, PairSumsRunOverAllPairsAtALag) {
  constexpr int kWidth = 21, kHeight = 13;
  const SampleMaps maps = noise_maps(kWidth, kHeight);
  const auto at = [&](int u, int v) { return SampleMaps::kReach + v * maps.stride + u; };
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

/// Calls every kernel and lists all numbers that come out.
std::vector<double> all_results(const OddTag& tag) {
  std::vector<double> all;
  const auto keep = [&](const auto& numbers) {
    for (const auto number : numbers.reshaped()) all.push_back(static_cast<double>(number));
  };
  const TagRows rows = tag.rows(tag.model);
  for (const auto* row : {&rows.by_x, &rows.by_y, &rows.by_blur[0], &rows.by_blur[1],
                          &rows.by_blur[2], &rows.white, &rows.residual, &rows.gradient_u,
                          &rows.gradient_v, &rows.slope, &rows.robust, &rows.weight})
    keep(*row);
  const NormalEquations equations = normal_equations(tag.samples, rows);
  keep(equations.information);
  keep(equations.gradient);

  const Eigen::Matrix<float, 35, 16, Eigen::RowMajor> combination =
      Eigen::ArrayXf::LinSpaced(35 * 16, -1, 2).sin().reshaped<Eigen::RowMajor>(35, 16);
  const ResidualSums sums = residual_sums(
      tag.samples, rows, Eigen::ArrayXf::LinSpaced(tag.samples.count, 0.5F, 2), combination);
  keep(sums);
  std::vector<int> place, sample_at(2000, static_cast<int>(tag.samples.count));
  for (int i = 0; i < tag.samples.count; ++i) {
    place.push_back(i + i / 39);  // rows of 39, one apart
    sample_at[static_cast<size_t>(place.back())] = i;
  }
  for (const int shift : {0, 1, 41}) keep(paired_products(sums, place, sample_at, shift));
  const PairSums pairs = pair_sums(noise_maps(21, 13), -6, 6);
  all.insert(all.end(),
             {pairs.pairs, pairs.slopes, pairs.square_slopes, pairs.residuals, pairs.mixed});

  CellGrid grid{.across = 10, .first = -1.25F, .per_unit = 4};
  const std::vector<float> turned(100, -1);
  grid.turned = turned.data();
  for (size_t s = 0; s < grid.share_x.size(); ++s)
    grid.share_x[s] = grid.share_y[s] = 1 - static_cast<float>(s) / 40;
  const CellRows cells = cell_rows(tag.model, grid, tag.samples, rows);
  all.insert(all.end(), cells.cell.begin(), cells.cell.end());
  keep(cells.information);
  keep(cells.moment);
  for (size_t corner = 0; corner < 4; ++corner) {
    all.insert(all.end(), cells.slope[corner].begin(), cells.slope[corner].end());
    all.insert(all.end(), cells.seen[corner].begin(), cells.seen[corner].end());
  }
  Eigen::ArrayXf shifted = Eigen::ArrayXf::Zero(19 * 19);
  const Eigen::ArrayXf from = Eigen::ArrayXf::LinSpaced(23 * 23, 0, 1).square();
  sum_of_shifts(from.data(), 23,
                std::vector<GridShift>{{.columns = 0, .rows = 4, .weight = 0.3F},
                                       {.columns = 3, .rows = 1, .weight = 0.7F}},
                19, shifted.data());
  keep(shifted);
  return all;
}

TEST(TagKernels, GivesTheSameBitsOnEachInstructionSet) {
  const OddTag tag;
  const std::vector<double> here = all_results(tag);
  for (const InstructionSet& set : instruction_sets()) {
    SCOPED_TRACE(set);
    const OnInstructionSet only(set);
    const std::vector<double> there = all_results(tag);
    ASSERT_EQ(there.size(), here.size());
    size_t different = 0;
    for (size_t i = 0; i < here.size(); ++i) different += there[i] == here[i] ? 0 : 1;
    EXPECT_EQ(different, 0u) << "of " << here.size();
  }
}

}  // namespace
}  // namespace clothfit
