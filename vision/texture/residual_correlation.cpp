#include "vision/texture/residual_correlation.h"

#include <algorithm>
#include <cmath>

namespace clothfit {
namespace {

using Grid = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Grid on_grid(const TexturePatch& patch, const Eigen::VectorXf& values) {
  Grid grid = Grid::Zero(patch.grid_columns, patch.grid_columns);
  for (size_t i = 0; i < patch.samples.size(); ++i)
    grid(patch.samples[i].row, patch.samples[i].column) = values[static_cast<Eigen::Index>(i)];
  return grid;
}

/// Returns the sum of products of entries that lie a lag apart; `rows` is not negative.
double lagged_sum(const Grid& one, const Grid& other, int columns, int rows) {
  const Eigen::Index height = one.rows() - rows, width = one.cols() - std::abs(columns);
  if (height <= 0 || width <= 0) return 0;
  const int left = std::max(0, -columns), right = std::max(0, columns);
  return double{one.block(0, left, height, width)
                    .cwiseProduct(other.block(rows, right, height, width))
                    .sum()};
}

}  // namespace

void ResidualCorrelation::add(const TexturePatch& patch, const PatchFit& fit) {
  const Grid residual = on_grid(patch, fit.residual);
  const Grid there = on_grid(patch, Eigen::VectorXf::Ones(fit.residual.size()));
  for (int rows = 0; rows <= kReach; ++rows)
    for (int columns = -kReach; columns <= kReach; ++columns) {
      products_(rows + kReach, columns + kReach) += lagged_sum(residual, residual, columns, rows);
      pairs_(rows + kReach, columns + kReach) += lagged_sum(there, there, columns, rows);
    }
}

double ResidualCorrelation::at(int columns, int rows) const {
  if (rows < 0) return at(-columns, -rows);
  if (rows == 0 && columns == 0) return 1;
  const double none = products_(kReach, kReach), pairs = pairs_(rows + kReach, columns + kReach);
  if (!(none > 0) || !(pairs > 0)) return 0;
  const double variance = none / pairs_(kReach, kReach);
  return std::clamp(products_(rows + kReach, columns + kReach) / pairs / variance, -1.0, 1.0);
}

double ResidualCorrelation::samples_alike() const {
  double sum = 0;
  for (int rows = -kReach; rows <= kReach; ++rows)
    for (int columns = -kReach; columns <= kReach; ++columns) sum += at(columns, rows);
  return std::max(1.0, sum);
}

Eigen::Matrix2d ResidualCorrelation::place_covariance_px2(const TexturePatch& patch,
                                                          const PatchFit& fit) const {
  const Grid u = on_grid(patch, fit.influence.col(0)), v = on_grid(patch, fit.influence.col(1));
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  for (int rows = 0; rows <= kReach; ++rows)
    for (int columns = -kReach; columns <= kReach; ++columns) {
      if (rows == 0 && columns < 0) continue;
      const double times = rows == 0 && columns == 0 ? 1 : 2;  // both signs of the lag
      const double weight = times * at(columns, rows);
      if (weight == 0) continue;
      sum(0, 0) += weight * lagged_sum(u, u, columns, rows);
      sum(1, 1) += weight * lagged_sum(v, v, columns, rows);
      sum(0, 1) +=
          weight * 0.5 * (lagged_sum(u, v, columns, rows) + lagged_sum(v, u, columns, rows));
    }
  sum(1, 0) = sum(0, 1);
  const double white_u = double{fit.influence.col(0).squaredNorm()};
  const double white_v = double{fit.influence.col(1).squaredNorm()};
  sum(0, 0) = std::max(sum(0, 0), white_u);
  sum(1, 1) = std::max(sum(1, 1), white_v);
  // The unknowns have taken up what as many independent samples err.
  constexpr double kLeastFreedom = 0.3;
  const double freedom =
      1 - align::kUnknowns * samples_alike() / static_cast<double>(patch.samples.size());
  return fit.residual_levels * fit.residual_levels / std::max(freedom, kLeastFreedom) * sum;
}

}  // namespace clothfit
