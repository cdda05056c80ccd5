#include "vision/detect/blurred_pattern.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace clothfit {
namespace {

using Weights = BlurredPattern::Coefficients;

/// Shifts that make up a part of the blur.
struct Shifts {
  std::vector<GridShift> list;  ///< from the corner at -reach; none where there is nothing to do
  int reach = 0;                ///< the largest shift
};

/// The kernel that is left to do on the grid, one part after the other, and the variance along the
/// axes that is not.
struct GridKernel {
  Shifts diagonal, line;
  Eigen::Vector2d axis_variance = Eigen::Vector2d::Zero();  ///< grid steps^2
  double left_out = 0;  ///< covariance of the axes that is in neither, grid steps^2
};

/// Spreads weighted places over the four grid points around each. This widens a kernel along the
/// axes; `widened` adds that up.
class ShiftTable {
 public:
  /// Takes places up to `farthest` along both axes.
  explicit ShiftTable(const Eigen::Vector2d& farthest)
      : reach_(2 + static_cast<int>(farthest.cwiseAbs().maxCoeff())),
        weights_(Eigen::ArrayXXf::Zero(2 * reach_ + 1, 2 * reach_ + 1)) {}

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
  Shifts shifts() const {
    Shifts result{.list = {}, .reach = reach_};
    for (int row = -reach_; row <= reach_; ++row)
      for (int column = -reach_; column <= reach_; ++column)
        if (const float weight = weights_(reach_ + row, reach_ + column); weight > 0)
          result.list.push_back(
              {.columns = reach_ + column, .rows = reach_ + row, .weight = weight});
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
  // A motion this short, by its variance over the lens's, spreads like more of a lens.
  constexpr double kShort = 0.3;
  // A correlation this small is worth no shifts: its square is what the fit's linear term lacks.
  constexpr double kLittle = 0.1;
  const Eigen::Matrix2d whole = grid_by_pixel * blur.covariance_px2() * grid_by_pixel.transpose();
  const bool is_short = blur.motion_px().squaredNorm() / 12 < kShort * blur.lens_variance_px2();
  if (is_short && std::abs(whole(0, 1)) < kLittle * std::sqrt(whole(0, 0) * whole(1, 1)))
    return {.axis_variance = whole.diagonal(), .left_out = whole(0, 1)};
  const Eigen::Vector2d line =
      is_short ? Eigen::Vector2d::Zero() : Eigen::Vector2d(grid_by_pixel * blur.motion_px());
  const int places = 1 + static_cast<int>(std::ceil(line.cwiseAbs().maxCoeff()));
  // Of the line's variance, that between places is left.
  const double taken = (1 - 1.0 / (places * places)) / 12;
  const Eigen::Matrix2d rest = whole - taken * line * line.transpose();
  const Eigen::Vector2d spread = rest.diagonal().cwiseSqrt();
  const double correlation = rest(0, 1) / (spread.x() * spread.y());
  const Eigen::Vector2d diagonal =
      std::sqrt(std::abs(correlation)) *
      Eigen::Vector2d(spread.x(), std::copysign(spread.y(), correlation));

  // Weights and places of three-point Gauss-Hermite quadrature.
  const double aside = std::sqrt(3.0);
  constexpr double kAsideWeight = 1.0 / 6;
  ShiftTable along_line(0.5 * line), along_diagonal(aside * diagonal);
  for (int i = 0; i < places; ++i) along_line.add(((i + 0.5) / places - 0.5) * line, 1.0 / places);
  along_diagonal.add(Eigen::Vector2d::Zero(), 1 - 2 * kAsideWeight);
  for (const double side : {-aside, aside}) along_diagonal.add(side * diagonal, kAsideWeight);
  return {.diagonal = along_diagonal.shifts(),
          .line = is_short ? Shifts{} : along_line.shifts(),
          .axis_variance = rest.diagonal() * (1 - std::abs(correlation)) - along_line.widened() -
                           along_diagonal.widened()};
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
  Weights product(weights.rows(), lines.cols());
  for (Eigen::Index row = 0; row < weights.rows(); ++row) {
    bool begun = false;
    for (Eigen::Index cell = 0; cell < weights.cols(); ++cell) {
      const float weight = weights(row, cell);
      if (weight == 0) continue;
      if (begun)
        product.row(row) += weight * lines.row(cell);
      else
        product.row(row) = weight * lines.row(cell);
      begun = true;
    }
    if (!begun) product.row(row).setZero();
  }
  return product;
}

/// Returns a square grid under some shifts, which take their reach off all sides.
Weights shifted(Weights grid, const Shifts& shifts) {
  if (shifts.list.empty()) return grid;
  const auto from = static_cast<int>(grid.rows()), side = from - 2 * shifts.reach;
  Weights result(side, side);
  sum_of_shifts(grid.data(), from, shifts.list, side, result.data());
  return result;
}

}  // namespace

BlurredPattern::BlurredPattern(const TagPattern& pattern, const Eigen::Matrix2d& pixel_by_tag,
                               const PictureBlur& blur) {
  const double cell_px = pattern.cell() * pixel_by_tag.colwise().norm().minCoeff();
  // Steps below the lens's blur leave the spline's own blur well within it.
  constexpr double kFinest_px = 0.2, kOfLens = 0.75;
  const double step_px = std::max(kFinest_px, kOfLens * std::sqrt(blur.lens_variance_px2()));
  constexpr int kFewestPerCell = 2, kMostPerCell = 64;
  const int per_cell = static_cast<int>(
      std::clamp(std::ceil(cell_px / step_px), 1.0 * kFewestPerCell, 1.0 * kMostPerCell));
  step_ = pattern.cell() / per_cell;
  const Eigen::Matrix2d pixel_by_grid = pixel_by_tag * step_;
  const GridKernel kernel = grid_kernel(pixel_by_grid.inverse(), blur);
  const Eigen::Matrix2d left_out = kernel.left_out * (Eigen::Matrix2d() << 0, 1, 1, 0).finished();
  covariance_px2_ = blur.covariance_px2() - pixel_by_grid * left_out * pixel_by_grid.transpose();

  // The spline adds a third of a squared step. What the axes cannot take away stays as it is.
  constexpr double kSplineVariance = 1.0 / 3, kLeast = 0.1;
  const Eigen::Vector2d spread =
      (kernel.axis_variance.array() - kSplineVariance).max(kLeast).sqrt().matrix();

  // A margin of one cell, four grid points for the spline, and the kernel's reach around the rest.
  const int margin = per_cell + 2;
  const int side = pattern.total_cells * per_cell + 2 * margin + 1;
  const int reach = kernel.diagonal.reach + kernel.line.reach;
  const int places = side + 2 * reach;
  const Eigen::Map<const Weights> white(pattern.white.data(), pattern.total_cells,
                                        pattern.total_cells);
  const auto weights = [&](double axis_spread) {
    return cell_weights(places, margin + reach, per_cell, pattern.total_cells, axis_spread);
  };
  const Weights lines = white * weights(spread.x()).transpose();
  coefficients_ =
      shifted(shifted(sparse_product(weights(spread.y()), lines), kernel.diagonal), kernel.line);
  side_ = side;
  first_ = -0.5 * pattern.cell() * pattern.total_cells - margin * step_;
}

}  // namespace clothfit
