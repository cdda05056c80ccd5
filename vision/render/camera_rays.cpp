#include "vision/render/camera_rays.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>

#include "calib/camera/projection.h"

namespace clothfit {
namespace {

constexpr double kSpacing_px = 4;

/// Returns the weights of four nodes for the cubic through their values. The place lies between the
/// second and third (0 <= x <= 1).
Eigen::Vector4d cubic_weights(double x) {
  return {-x * (x - 1) * (x - 2) / 6, (x + 1) * (x - 1) * (x - 2) / 2, -(x + 1) * x * (x - 2) / 2,
          (x + 1) * x * (x - 1) / 6};
}

Eigen::Vector2d exact_direction(const CameraParameters& camera, const Eigen::Vector2d& pixel) {
  const std::optional<Eigen::Vector3d> ray = unproject(camera, pixel);
  if (!ray) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  return ray->head<2>() / ray->z();
}

}  // namespace

CameraRays::CameraRays(const CameraParameters& camera, int margin_px)
    : margin_px_(margin_px), camera_(camera) {
  assert(margin_px >= 0 && camera.image_width > 0 && camera.image_height > 0);
  // Node [r, c] lies at pixel origin + spacing (c - 1, r - 1): one more on each side for the cubic.
  const auto cells = [&](int size_px) {
    return static_cast<int>(std::ceil((size_px + 2 * margin_px + 1) / kSpacing_px));
  };
  const int cell_columns = cells(camera.image_width), cell_rows = cells(camera.image_height);
  node_columns_ = cell_columns + 3;
  node_rows_ = cell_rows + 3;
  const double origin_px = -0.5 - margin_px;
  for (int r = 0; r < node_rows_; ++r) {
    for (int c = 0; c < node_columns_; ++c)
      nodes_.push_back(exact_direction(
          camera, {origin_px + kSpacing_px * (c - 1), origin_px + kSpacing_px * (r - 1)}));
  }

  constexpr double kOff_px = 1e-4;
  const double tolerance = kOff_px / camera.focal_px.maxCoeff();
  smooth_.assign(static_cast<size_t>(cell_rows * cell_columns), true);
  for (int r = 0; r < cell_rows; ++r) {
    const double v_px = origin_px + kSpacing_px * (r + 0.5);
    for (int c = 0; c < cell_columns; ++c) {
      const std::array<double, 1> u_px = {origin_px + kSpacing_px * (c + 0.5)};
      std::array<Eigen::Vector2d, 1> direction;
      row(u_px, v_px, direction);
      // A direction that is missing at a node makes this NaN, and the comparison false.
      smooth_[static_cast<size_t>(r * cell_columns + c)] =
          (direction[0] - exact_direction(camera, {u_px[0], v_px})).norm() < tolerance;
    }
  }
}

void CameraRays::row(std::span<const double> u_px, double v_px,
                     std::span<Eigen::Vector2d> direction) const {
  assert(u_px.size() == direction.size());
  const double origin_px = -0.5 - margin_px_;
  const int cell_columns = node_columns_ - 3, cell_rows = node_rows_ - 3;
  const double row_place = (v_px - origin_px) / kSpacing_px;
  assert(row_place >= 0 && row_place <= cell_rows);
  const int cell_row = std::min(static_cast<int>(row_place), cell_rows - 1);
  const Eigen::Vector4d down = cubic_weights(row_place - cell_row);
  const auto column_value = [&](int node_column) {
    Eigen::Vector2d value = Eigen::Vector2d::Zero();
    for (int k = 0; k < 4; ++k)
      value += down[k] * nodes_[static_cast<size_t>((cell_row + k) * node_columns_ + node_column)];
    return value;
  };

  // Values at the four node columns around the current cell.
  Eigen::Matrix<double, 2, 4> values = Eigen::Matrix<double, 2, 4>::Zero();
  int current = -1;
  for (size_t i = 0; i < u_px.size(); ++i) {
    const double place = (u_px[i] - origin_px) / kSpacing_px;
    assert(place >= 0 && place <= cell_columns);
    const int cell = std::min(static_cast<int>(place), cell_columns - 1);
    if (!smooth_[static_cast<size_t>(cell_row * cell_columns + cell)]) {
      direction[i] = exact_direction(camera_, {u_px[i], v_px});
      continue;
    }
    if (cell != current) {
      for (int k = 0; k < 4; ++k) values.col(k) = column_value(cell + k);
      current = cell;
    }
    direction[i] = values * cubic_weights(place - cell);
  }
}

}  // namespace clothfit
