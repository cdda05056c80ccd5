#include "vision/detect/blurred_pattern.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace clothfit {
namespace {

using Weights = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// The kernel that is left to do on the grid, and the variance along the axes that is not.
struct GridKernel {
  std::vector<GridShift> shifts;                            ///< from the corner at -reach
  int reach = 0;                                            ///< the largest shift
  Eigen::Vector2d axis_variance = Eigen::Vector2d::Zero();  ///< grid steps^2
};

/// Spreads weighted places over the four grid points around each. This widens a kernel along the
/// axes; `widened` adds that up.
class ShiftTable {
 public:
  explicit ShiftTable(int reach)
      : reach_(reach), weights_(Eigen::ArrayXXf::Zero(2 * reach + 1, 2 * reach + 1)) {}

  void add(const Eigen::Vector2d& place, double weight) {
    const int column = static_cast<int>(std::floor(place.x()));
    const int row = static_cast<int>(std::floor(place.y()));
    const double u = place.x() - column, v = place.y() - row;
    for (const int j : {0, 1})
      for (const int i : {0, 1})
        weights_(reach_ + row + j, reach_ + column + i) +=
            static_cast<float>(weight * (i == 1 ? u : 1 - u) * (j == 1 ? v : 1 - v));
    widened_ += weight * Eigen::Vector2d(u * (1 - u), v * (1 - v));
  }

  const Eigen::Vector2d& widened() const { return widened_; }
  /// Returns the shifts from the corner at -reach.
  std::vector<GridShift> shifts() const {
    std::vector<GridShift> result;
    for (int row = -reach_; row <= reach_; ++row)
      for (int column = -reach_; column <= reach_; ++column)
        if (const float weight = weights_(reach_ + row, reach_ + column); weight > 0)
          result.push_back({.columns = reach_ + column, .rows = reach_ + row, .weight = weight});
    return result;
  }

 private:
  int reach_;
  Eigen::ArrayXXf weights_;
  Eigen::Vector2d widened_ = Eigen::Vector2d::Zero();
};

/// Takes a blur apart: places along the line of motion, each spread over three along the diagonal
/// for the correlation of the lens's blur between the axes, and the rest along the axes.
GridKernel grid_kernel(const Eigen::Matrix2d& grid_by_pixel, const PictureBlur& blur) {
  const Eigen::Vector2d line = grid_by_pixel * blur.motion_px();
  const int places = 1 + static_cast<int>(std::ceil(line.cwiseAbs().maxCoeff()));
  const double missing = 1.0 / (12 * places * places);  // of the line's variance, between places
  const Eigen::Matrix2d rest =
      blur.lens_variance_px2() * grid_by_pixel * grid_by_pixel.transpose() +
      missing * line * line.transpose();
  const Eigen::Vector2d spread = rest.diagonal().cwiseSqrt();
  const double correlation = rest(0, 1) / (spread.x() * spread.y());
  const Eigen::Vector2d diagonal =
      std::sqrt(std::abs(correlation)) *
      Eigen::Vector2d(spread.x(), std::copysign(spread.y(), correlation));

  // Weights and places of three-point Gauss-Hermite quadrature.
  const double aside = std::sqrt(3.0);
  constexpr double kAsideWeight = 1.0 / 6;
  GridKernel kernel;
  kernel.reach =
      2 + static_cast<int>((0.5 * line.cwiseAbs() + aside * diagonal.cwiseAbs()).maxCoeff());
  ShiftTable table(kernel.reach);
  for (int i = 0; i < places; ++i) {
    const Eigen::Vector2d place = ((i + 0.5) / places - 0.5) * line;
    table.add(place, (1 - 2 * kAsideWeight) / places);
    for (const double side : {-aside, aside})
      table.add(place + side * diagonal, kAsideWeight / places);
  }
  kernel.shifts = table.shifts();
  kernel.axis_variance = rest.diagonal() * (1 - std::abs(correlation)) - table.widened();
  return kernel;
}

/// Weighs the pattern's cells (columns) at the grid's places (rows) along one axis under a
/// Gaussian of that spread (grid steps). The first place lies `before` steps before the first cell.
/// The first and the last cell reach on beyond the pattern.
Weights cell_weights(int places, int before, int per_cell, int cells, double spread) {
  constexpr double kReach = 5;  // standard deviations
  const int reach = static_cast<int>(std::ceil(kReach * spread));
  // Edges lie on places, so that one table serves all of them.
  std::vector<float> left_of_edge(static_cast<size_t>(2 * reach + 1));
  for (int k = -reach; k <= reach; ++k)
    left_of_edge[static_cast<size_t>(k + reach)] =
        static_cast<float>(0.5 * std::erfc(k / spread * M_SQRT1_2));
  Weights weights(places, cells);
  for (int place = 0; place < places; ++place) {
    float left = 0;  // share of the Gaussian left of the cell
    for (int cell = 0; cell < cells; ++cell) {
      const int beyond = place - before - (cell + 1) * per_cell;  // the cell's right edge
      float right = beyond > 0 ? 0 : 1;
      if (cell + 1 == cells)
        right = 1;
      else if (std::abs(beyond) <= reach)
        right = left_of_edge[static_cast<size_t>(beyond + reach)];
      weights(place, cell) = right - left;
      left = right;
    }
  }
  return weights;
}

/// Returns weights * lines, where most weights are 0.
Weights sparse_product(const Weights& weights, const Weights& lines) {
  Weights product = Weights::Zero(weights.rows(), lines.cols());
  for (Eigen::Index row = 0; row < weights.rows(); ++row)
    for (Eigen::Index cell = 0; cell < weights.cols(); ++cell)
      if (const float weight = weights(row, cell); weight != 0)
        product.row(row) += weight * lines.row(cell);
  return product;
}

}  // namespace

BlurredPattern::BlurredPattern(const TagPattern& pattern, const Eigen::Matrix2d& pixel_by_tag,
                               const PictureBlur& blur) {
  const double cell_px = pattern.cell() * pixel_by_tag.colwise().norm().minCoeff();
  // Steps below the lens's blur leave the spline's own blur well within it.
  constexpr double kFinest_px = 0.2, kWidest_px = 0.45, kOfLens = 0.75;
  const double step_px =
      std::clamp(kOfLens * std::sqrt(blur.lens_variance_px2()), kFinest_px, kWidest_px);
  constexpr int kFewestPerCell = 2, kMostPerCell = 64;
  const int per_cell = static_cast<int>(
      std::clamp(std::ceil(cell_px / step_px), 1.0 * kFewestPerCell, 1.0 * kMostPerCell));
  step_ = pattern.cell() / per_cell;
  const GridKernel kernel = grid_kernel(pixel_by_tag.inverse() / step_, blur);

  // The spline adds a third of a squared step. What the axes cannot take away stays as it is.
  constexpr double kSplineVariance = 1.0 / 3, kLeast = 0.1;
  const Eigen::Vector2d spread =
      (kernel.axis_variance.array() - kSplineVariance).max(kLeast).sqrt().matrix();

  // A margin of one cell, four grid points for the spline, and the kernel's reach around the rest.
  const int margin = per_cell + 2;
  const int side = pattern.total_cells * per_cell + 2 * margin + 1;
  const int places = side + 2 * kernel.reach;
  const Eigen::Map<const Weights> white(pattern.white.data(), pattern.total_cells,
                                        pattern.total_cells);
  const auto weights = [&](double axis_spread) {
    return cell_weights(places, margin + kernel.reach, per_cell, pattern.total_cells, axis_spread);
  };
  const Weights lines = white * weights(spread.x()).transpose();
  const Weights along_axes = sparse_product(weights(spread.y()), lines);
  coefficients_.resize(static_cast<size_t>(side * side));
  sum_of_shifts(along_axes.data(), places, kernel.shifts, side, coefficients_.data());
  side_ = side;
  first_ = -0.5 * pattern.cell() * pattern.total_cells - margin * step_;
}

}  // namespace clothfit
