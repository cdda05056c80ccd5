#include "apps/study/vision/template_sheet.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include "apps/terminal/exit_code.h"
#include "calib/camera/projection.h"

namespace clothfit {
namespace {

using Vertex = Eigen::Map<const Eigen::Vector3d>;

/// Writes a block of a Jacobian as Ceres has it, row by row.
template <int Rows>
void set_block(double* block, const Eigen::Matrix<double, Rows, 3>& value) {
  for (int row = 0; row < Rows; ++row)
    for (int column = 0; column < 3; ++column) block[3 * row + column] = value(row, column);
}

/// A point of the sheet, between the four vertices of a cell.
struct OnSheet {
  std::array<int, 4> vertex;
  Eigen::Vector4d weight;
  Eigen::Matrix<double, 4, 2> by_cell;  ///< derivative by the place in cells along s and t
};

OnSheet on_sheet(const Mesh& mesh, const Eigen::Vector2d& at_cells) {
  const int j = std::clamp(static_cast<int>(at_cells.x()), 0, mesh.columns - 2);
  const int i = std::clamp(static_cast<int>(at_cells.y()), 0, mesh.rows - 2);
  const double x = at_cells.x() - j, y = at_cells.y() - i;
  OnSheet point{.vertex = {mesh.vertex(i, j), mesh.vertex(i, j + 1), mesh.vertex(i + 1, j),
                           mesh.vertex(i + 1, j + 1)},
                .weight = {(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y},
                .by_cell = {}};
  point.by_cell << y - 1, x - 1, 1 - y, -x, -y, 1 - x, y, x;
  return point;
}

/// Finds the point of the sheet in frame 0 that a pixel shows, by Newton's method.
std::optional<OnSheet> seen_at(const TemplateSheet& sheet, const CameraParameters& camera,
                               const Eigen::Vector2d& pixel_px, const Marker& marker) {
  const Mesh& mesh = sheet.mesh;
  const Eigen::Vector2d most(mesh.columns - 1, mesh.rows - 1);
  Eigen::Vector2d at_cells(marker.s_m / mesh.spacing_s_m(), marker.t_m / mesh.spacing_t_m());
  const Rigid3 camera_from = camera_from_world(camera);
  constexpr int kIterations = 20;
  constexpr double kFound_px = 1e-6;
  for (int n = 0; n < kIterations; ++n) {
    const OnSheet point = on_sheet(mesh, at_cells);
    const Eigen::Matrix<double, 3, 4> corners_m = sheet.position_m(Eigen::all, point.vertex);
    Eigen::Matrix<double, 2, 3> by_point;
    const auto seen = project(camera, camera_from * (corners_m * point.weight), &by_point);
    if (!seen) return std::nullopt;
    const Eigen::Vector2d off_px = pixel_px - *seen;
    if (off_px.norm() < kFound_px) return point;
    const Eigen::Matrix2d by_cell =
        by_point * camera_from.rotation.toRotationMatrix() * corners_m * point.by_cell;
    at_cells = (at_cells + by_cell.inverse() * off_px).cwiseMax(0).cwiseMin(most);
  }
  return std::nullopt;
}

/// A track's distance from what the camera sees of the sheet, px.
class SeenCost final : public ceres::SizedCostFunction<2, 3, 3, 3, 3> {
 public:
  SeenCost(const CameraParameters& camera, const Eigen::Vector4d& weight,
           const Eigen::Vector2d& pixel_px)
      : camera_(camera),
        camera_from_(camera_from_world(camera)),
        weight_(weight),
        pixel_px_(pixel_px) {}

  bool Evaluate(double const* const* vertices, double* residuals,
                double** jacobians) const override {
    Eigen::Vector3d at_m = Eigen::Vector3d::Zero();
    for (int k = 0; k < 4; ++k) at_m += weight_[k] * Vertex(vertices[k]);
    Eigen::Matrix<double, 2, 3> by_point;
    const auto seen = project(camera_, camera_from_ * at_m, &by_point);
    if (!seen) return false;
    Eigen::Map<Eigen::Vector2d>(residuals, 2) = *seen - pixel_px_;
    if (jacobians == nullptr) return true;
    const Eigen::Matrix<double, 2, 3> by_world =
        by_point * camera_from_.rotation.toRotationMatrix();
    for (int k = 0; k < 4; ++k)
      if (jacobians[k] != nullptr) set_block<2>(jacobians[k], weight_[k] * by_world);
    return true;
  }

 private:
  const CameraParameters& camera_;
  Rigid3 camera_from_;
  Eigen::Vector4d weight_;
  Eigen::Vector2d pixel_px_;
};

/// What a length differs by, as a share of it over what it may.
class LengthCost final : public ceres::SizedCostFunction<1, 3, 3> {
 public:
  LengthCost(double length_m, double share) : length_m_(length_m), unit_m_(share * length_m) {}

  bool Evaluate(double const* const* ends, double* residuals, double** jacobians) const override {
    const Eigen::Vector3d along = Vertex(ends[1]) - Vertex(ends[0]);
    const double length_m = along.norm();
    if (!(length_m > 0)) return false;
    residuals[0] = (length_m - length_m_) / unit_m_;
    for (int k = 0; jacobians != nullptr && k < 2; ++k)
      if (jacobians[k] != nullptr)
        set_block<1>(jacobians[k], (k == 0 ? -1 : 1) * along.transpose() / (length_m * unit_m_));
    return true;
  }

 private:
  double length_m_, unit_m_;
};

/// The second difference of three vertices in a line, over what is usual.
class BendCost final : public ceres::SizedCostFunction<3, 3, 3, 3> {
 public:
  bool Evaluate(double const* const* vertices, double* residuals,
                double** jacobians) const override {
    constexpr double kUsual_m = 2e-3;
    constexpr std::array kWeight{1 / kUsual_m, -2 / kUsual_m, 1 / kUsual_m};
    Eigen::Map<Eigen::Vector3d> residual(residuals);
    residual.setZero();
    for (size_t k = 0; k < 3; ++k) {
      residual += kWeight[k] * Vertex(vertices[k]);
      if (jacobians != nullptr && jacobians[k] != nullptr)
        set_block<3>(jacobians[k], kWeight[k] * Eigen::Matrix3d::Identity());
    }
    return true;
  }
};

/// Adds what keeps the sheet's lengths, its shape smooth, and its fixed vertices in their places.
void add_sheet(const TemplateSheet& sheet, Eigen::Matrix3Xd& position_m, ceres::Problem& problem) {
  constexpr double kStretch = 0.005, kShear = 0.05;
  const SpringNet springs = make_springs(sheet.mesh);
  for (size_t type = 0; type < springs.size(); ++type)
    for (const auto& [a, b] : springs[type]) {
      double* const ends[] = {position_m.col(a).data(), position_m.col(b).data()};
      if (type >= flexion_t) {
        problem.AddResidualBlock(new BendCost, nullptr, ends[0], position_m.col((a + b) / 2).data(),
                                 ends[1]);
        continue;
      }
      const double length_m = (sheet.position_m.col(b) - sheet.position_m.col(a)).norm();
      problem.AddResidualBlock(new LengthCost(length_m, type <= structural_s ? kStretch : kShear),
                               nullptr, ends[0], ends[1]);
    }
  for (const int vertex : sheet.fixed)
    problem.SetParameterBlockConstant(position_m.col(vertex).data());
}

/// Returns where the markers of frame 0 lie on the sheet.
std::map<int, OnSheet> places_of(const TemplateSheet& sheet, const Tracks2d& tracks,
                                 const CameraParameters& camera, const MarkerSet& markers) {
  std::map<int, OnSheet> places;
  for (const Position2d& row : tracks) {
    if (row.frame > 0 || !row.rejected.empty()) continue;
    const Marker& marker = markers.markers[static_cast<size_t>(row.marker)];
    if (const auto place = seen_at(sheet, camera, row.position_px, marker))
      places.emplace(row.marker, *place);
  }
  return places;
}

}  // namespace

std::vector<Eigen::Matrix3Xd> follow_template(const TemplateSheet& sheet, const Tracks2d& tracks,
                                              const CameraParameters& camera,
                                              const MarkerSet& markers,
                                              const ProgressCallback& progress) {
  const std::map<int, OnSheet> places = places_of(sheet, tracks, camera, markers);
  const int frames = tracks.empty() ? 0 : tracks.back().frame + 1;
  std::vector<Eigen::Matrix3Xd> shapes;
  Eigen::Matrix3Xd position_m = sheet.position_m;
  auto row = tracks.begin();
  for (int frame = 0; frame < frames; ++frame) {
    if (progress && !progress({.stage = "bend the template",
                               .done = static_cast<double>(frame),
                               .total = static_cast<double>(frames),
                               .unit = "frames",
                               .note = {}}))
      throw Cancelled();
    ceres::Problem problem;
    add_sheet(sheet, position_m, problem);
    for (; row != tracks.end() && row->frame == frame; ++row) {
      const auto place = places.find(row->marker);
      if (place == places.end() || !row->rejected.empty()) continue;
      const auto at = [&](size_t k) { return position_m.col(place->second.vertex[k]).data(); };
      problem.AddResidualBlock(new SeenCost(camera, place->second.weight, row->position_px),
                               nullptr, at(0), at(1), at(2), at(3));
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;  // not one with a BLAS
    options.logging_type = ceres::SILENT;
    options.max_num_iterations = 200;
    options.function_tolerance = 1e-6;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    if (!summary.IsSolutionUsable())
      throw NoResult(fmt::format("the shape of frame {} does not work out", frame));
    shapes.push_back(position_m);
  }
  return shapes;
}

}  // namespace clothfit
