#include "vision/detect/blurred_pattern.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace clothfit {
namespace {

using Weights = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// A shift by whole grid steps with its weight.
struct Shift {
  int columns = 0, rows = 0;
  float weight = 0;
};

/// The kernel that is left to do on the grid, and the variance along the axes that is not.
struct GridKernel {
  std::vector<Shift> shifts;
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
  std::vector<Shift> shifts() const {
    std::vector<Shift> result;
    for (int row = -reach_; row <= reach_; ++row)
      for (int column = -reach_; column <= reach_; ++column)
        if (const float weight = weights_(reach_ + row, reach_ + column); weight > 0)
          result.push_back({.columns = column, .rows = row, .weight = weight});
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
/// Gaussian. The first and the last cell reach on beyond the pattern.
Weights cell_weights(int places, double first, double step, int cells, double spread) {
  // Places are in cells from the pattern's edge.
  Weights weights(places, cells);
  constexpr double kReach = 5;  // standard deviations
  for (int place = 0; place < places; ++place) {
    double left = 0;  // share of the Gaussian left of the cell
    for (int cell = 0; cell < cells; ++cell) {
      const double u = (cell + 1 - (first + place * step)) / spread;
      double right = u > 0 ? 1 : 0;
      if (cell + 1 == cells)
        right = 1;
      else if (std::abs(u) < kReach)
        right = 0.5 * std::erfc(-u * M_SQRT1_2);
      weights(place, cell) = static_cast<float>(right - left);
      left = right;
    }
  }
  return weights;
}

/// Cubic B-spline weights of four coefficients at a share (0 to 1) between the inner two, with
/// first and second derivatives by the share.
struct SplineWeights {
  Eigen::Array4f value, slope, curvature;

  explicit SplineWeights(float t) {
    const float s = 1 - t;
    constexpr float kSixth = 1.0F / 6;
    value << kSixth * s * s * s, kSixth * (4 - t * t * (6 - 3 * t)),
        kSixth * (4 - s * s * (6 - 3 * s)), kSixth * t * t * t;
    slope << -0.5F * s * s, 0.5F * t * (3 * t - 4), 0.5F * s * (4 - 3 * s), 0.5F * t * t;
    curvature << s, 3 * t - 2, 3 * s - 2, t;
  }
};

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
  const double first_cell = -static_cast<double>(margin + kernel.reach) / per_cell;
  const Eigen::Map<const Weights> white(pattern.white.data(), pattern.total_cells,
                                        pattern.total_cells);
  const auto weights = [&](double axis_spread) {
    return cell_weights(places, first_cell, 1.0 / per_cell, pattern.total_cells,
                        axis_spread / per_cell);
  };
  const Grid along_axes = ((weights(spread.y()) * white) * weights(spread.x()).transpose()).array();
  coefficients_ = Grid::Zero(side, side);
  for (const Shift& shift : kernel.shifts)
    coefficients_ += shift.weight * along_axes.block(kernel.reach + shift.rows,
                                                     kernel.reach + shift.columns, side, side);
  first_ = -0.5 * pattern.cell() * pattern.total_cells - margin * step_;
}

BlurredPattern::Value BlurredPattern::at(double x, double y) const {
  const auto last = static_cast<double>(coefficients_.cols() - 1);
  // Beyond the margin the pattern is as white as at its end; a poor step may ask for any place.
  const auto grid_place = [&](double tag) {
    return std::clamp((tag - first_) / step_, 1.0, last - 2);
  };
  const double u = grid_place(x), v = grid_place(y);
  const auto column = static_cast<Eigen::Index>(u), row = static_cast<Eigen::Index>(v);
  const SplineWeights across(static_cast<float>(u - static_cast<double>(column)));
  const SplineWeights down(static_cast<float>(v - static_cast<double>(row)));
  Eigen::Array4f value = Eigen::Array4f::Zero(), slope = value, curvature = value;
  for (Eigen::Index j = 0; j < 4; ++j) {
    const Eigen::Map<const Eigen::Array4f> four(&coefficients_(row - 1 + j, column - 1));
    value += down.value[j] * four;
    slope += down.slope[j] * four;
    curvature += down.curvature[j] * four;
  }
  const auto per_step = static_cast<float>(1 / step_);
  return {.value = (across.value * value).sum(),
          .by_x = per_step * (across.slope * value).sum(),
          .by_y = per_step * (across.value * slope).sum(),
          .by_xx = per_step * per_step * (across.curvature * value).sum(),
          .by_xy = per_step * per_step * (across.slope * slope).sum(),
          .by_yy = per_step * per_step * (across.value * curvature).sum()};
}

}  // namespace clothfit
