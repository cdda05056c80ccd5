#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "vision/detect/tag_samples.h"

namespace clothfit {

/// The loops over a tag's samples that cost the time, compiled for several instruction sets. Sums
/// run over 16 lanes and nothing is fused, so that all of them give the same bits.

/// A square grid of coefficients of a cubic B-spline, row by row.
struct SplineGrid {
  const float* coefficients = nullptr;
  int side = 0;
  float first = 0;     ///< tag coordinate of the first column and row
  float per_step = 0;  ///< columns per unit of tag coordinates
};

/// A shift on a grid with its weight.
struct GridShift {
  int columns = 0, rows = 0;  ///< >= 0
  float weight = 0;
};
/// Sets each of side x side numbers to a weighted sum of those of a square grid of `from_side`: of
/// those at the shifts from its own place. `side` is 16 or more.
void sum_of_shifts(const float* from, int from_side, std::span<const GridShift> shifts, int side,
                   float* to);

/// The unknowns of a tag's fit (TagUnknowns) and what they stand for, in single precision.
struct TagModel {
  SplineGrid grid;
  std::array<float, 10> bend_x{}, bend_y{};
  std::array<float, 3> offset{}, contrast{};
  std::array<float, 3> blur_change{};  ///< of the blur's unknowns since the grid was made
  std::array<float, 6> blur_slope{};
  /// How the pattern changes with each unknown of the blur: these times its second derivatives (xx,
  /// xy, yy).
  std::array<std::array<float, 3>, 3> by_blur{};
  std::array<float, 4> tag_by_pixel{};  ///< row by row
};

/// What the model says of each sample, and how far the picture is from it. The row of the Jacobian
/// is the by_* times the polynomials in the sample's tag coordinates. Grey levels.
struct TagRows {
  Eigen::ArrayXf by_x, by_y;              ///< of the place on the pattern
  std::array<Eigen::ArrayXf, 3> by_blur;  ///< of the blur's unknowns
  Eigen::ArrayXf white;                   ///< 0 to 1, of the contrast
  Eigen::ArrayXf residual;                ///< picture less model
  Eigen::ArrayXf gradient_u, gradient_v;  ///< of the model, per px
  Eigen::ArrayXf slope;                   ///< its length
  Eigen::ArrayXf robust;                  ///< robust weight, 0 to 1
  Eigen::ArrayXf weight;                  ///< inverse variance times robust weight

  void resize(Eigen::Index count);
  /// Returns the rows at those indices.
  TagRows at(std::span<const Eigen::Index> which) const;
};

/// Evaluates the model at each sample; leaves the weights alone.
void evaluate_rows(const TagModel& model, const TagSamples& samples, TagRows& rows);

/// How samples are weighed.
struct TagWeights {
  float noise_levels = 0, roughness_px = 0;  ///< variance: noise^2 + (roughness slope)^2
  float loss = 0;                            ///< scale of a Cauchy loss, in standard deviations
};
void weigh_rows(const TagWeights& weights, const TagSamples& samples, TagRows& rows);

/// Samples at or below all of these are flat: where they are, and how blurred, changes them by less
/// than 3 % of what it changes others. They tell nothing but the light.
struct FlatLimits {
  float slope = 0;
  std::array<float, 3> by_blur{};
};
FlatLimits flat_limits(const TagRows& rows);

/// A tag's normal equations, without a prior. Flat samples count as if they were wholly so.
struct NormalEquations {
  Eigen::Matrix<double, 35, 35> information;  ///< J' W J
  Eigen::Matrix<double, 35, 1> gradient;      ///< J' W r
};
NormalEquations normal_equations(const TagSamples& samples, const TagRows& rows);

/// The printed cells of a pattern, and how a cell's own grey level spreads under the blur.
struct CellGrid {
  int across = 0;
  float first = 0, per_unit = 0;  ///< tag coordinate of the first cell's edge, cells per unit
  const float* turned = nullptr;  ///< change of the white with the cell turned round: 1 or -1
  /// Share of a cell's own level along each axis at a step from its middle: kSteps to its edge.
  static constexpr int kSteps = 32;
  std::array<float, kSteps + 2> share_x{}, share_y{};
};

/// What samples say of their cells.
struct CellRows {
  std::vector<int> cell;       ///< of each sample; negative where it lies in none
  Eigen::ArrayXf information;  ///< of the amplitude of the cell's change, in squared sigmas
  Eigen::ArrayXf moment;       ///< the same times the amplitude
  /// Of the two edges that meet at each corner, in the order of TagDetection, edges along y first:
  /// sums of slopes across them, and of slopes times robust weights, near the corner.
  std::array<std::array<double, 2>, 4> slope{}, seen{};
};
CellRows cell_rows(const TagModel& model, const CellGrid& grid, const TagSamples& samples,
                   const TagRows& rows);

/// One row per sample, one column per sum of residuals, with the weight of each sample in it.
using ResidualSums = Eigen::Matrix<float, Eigen::Dynamic, 16, Eigen::RowMajor>;
/// Returns share * J * combination, with a share for each sample.
ResidualSums residual_sums(const TagSamples& samples, const TagRows& rows,
                           const Eigen::ArrayXf& share,
                           const Eigen::Matrix<float, 35, 16, Eigen::RowMajor>& combination);

/// Sums over pairs of samples that a straight line of products of residuals over products of
/// slopes needs.
struct PairSums {
  double pairs = 0, slopes = 0, square_slopes = 0, residuals = 0, mixed = 0;
};

/// Maps over the box of all samples, with zeros where there is none and kReach around it.
struct SampleMaps {
  static constexpr int kReach = 16;
  int stride = 0, rows = 0;  ///< of the box; a multiple of 16 with the reach
  Eigen::ArrayXf there, residual, gradient_u, gradient_v;
};
/// Adds up over the pairs whose second sample lies `across` (-kReach to kReach) and `down` (0 to
/// kReach) from the first.
PairSums pair_sums(const SampleMaps& maps, int across, int down);

/// Returns for each column the sum of weights[i] * weights[j] over pairs of samples, j being the
/// one that `sample_at` has `shift` after the place of i; a number past the last row is none.
Eigen::Matrix<double, 16, 1> paired_products(const ResidualSums& weights,
                                             std::span<const int> place,
                                             std::span<const int> sample_at, int shift);

}  // namespace clothfit
