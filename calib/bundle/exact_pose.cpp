#include "calib/bundle/exact_pose.h"

#include <ceres/ceres.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/bundle/pose_block.h"
#include "calib/bundle/robust_scale.h"

namespace clothfit {
namespace {

/// The pixel residual of a point whose place is taken as exact; the camera's pose is unknown.
struct PixelOfExactPoint {
  const FixedCamera* camera;
  const PlacedPixel* observed;
  template <class Real>
  bool operator()(const Real* camera_from_world, Real* out) const {
    const Eigen::Matrix<Real, 3, 1> point = observed->point_m.cast<Real>();
    return camera->residual<Real>(transform(camera_from_world, point), *observed, out);
  }
};

}  // namespace

ceres::Solver::Options solver_options() {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 100;
  options.function_tolerance = 1e-14;
  options.parameter_tolerance = 1e-13;
  options.gradient_tolerance = 1e-13;
  options.logging_type = ceres::SILENT;
  return options;
}

std::vector<Eigen::Vector2d> standardised_residuals(const FixedCamera& camera,
                                                    const std::vector<PlacedPixel>& pixels,
                                                    const Rigid3& camera_from_world) {
  std::vector<Eigen::Vector2d> residuals;
  for (const auto& pixel : pixels) {
    Eigen::Vector2d residual;
    if (!camera.residual<double>(camera_from_world * pixel.point_m, pixel, residual.data()))
      residual.setConstant(std::numeric_limits<double>::infinity());
    residuals.push_back(residual);
  }
  return residuals;
}

double robust_spread(const std::vector<Eigen::Vector2d>& residuals) {
  std::vector<double> coordinates;
  for (const auto& residual : residuals) {
    coordinates.push_back(residual.x());
    coordinates.push_back(residual.y());
  }
  return robust_sigma(std::move(coordinates));
}

bool refine_pose(const FixedCamera& camera, const std::vector<PlacedPixel>& pixels,
                 const std::vector<char>& used, double cauchy_scale, Rigid3& camera_from_world) {
  PoseBlock block = to_block(camera_from_world);
  ceres::Problem problem;
  problem.AddParameterBlock(block.data(), 7, new PoseManifold);
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (!used[i]) continue;
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PixelOfExactPoint, 2, 7>(
                                 new PixelOfExactPoint{&camera, &pixels[i]}),
                             cauchy_scale > 0 ? new ceres::CauchyLoss(cauchy_scale) : nullptr,
                             block.data());
  }
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(), &problem, &summary);
  camera_from_world = from_block(block);
  return summary.IsSolutionUsable();
}

RobustPose refine_pose_robustly(const FixedCamera& camera, const std::vector<PlacedPixel>& pixels,
                                const Rigid3& start) {
  constexpr int kRounds = 6;
  const std::vector<char> all(pixels.size(), 1);
  RobustPose result{.camera_from_world = start};
  result.spread = robust_spread(standardised_residuals(camera, pixels, start));
  for (int round = 0; round < kRounds && std::isfinite(result.spread); ++round) {
    const double before = result.spread;
    if (!refine_pose(camera, pixels, all, 2 * before, result.camera_from_world)) return result;
    result.spread = robust_spread(standardised_residuals(camera, pixels, result.camera_from_world));
    if (result.spread > 0.9 * before) break;
  }
  result.cost = 0;
  for (const auto& residual : standardised_residuals(camera, pixels, result.camera_from_world))
    result.cost += std::log1p(residual.squaredNorm());
  return result;
}

std::optional<std::vector<Eigen::Vector2d>> on_image_plane(const CameraParameters& camera,
                                                           const std::vector<PlacedPixel>& pixels) {
  std::vector<Eigen::Vector2d> image;
  for (const auto& pixel : pixels) {
    const auto direction = unproject(camera, pixel.pixel_px);
    if (!direction || !(direction->z() > 0)) return std::nullopt;
    image.emplace_back(direction->hnormalized());
  }
  return image;
}

bool is_finite(const std::vector<PlacedPixel>& pixels) {
  return std::all_of(pixels.begin(), pixels.end(), [](const PlacedPixel& pixel) {
    return pixel.point_m.allFinite() && pixel.pixel_px.allFinite() && pixel.sigma_px > 0;
  });
}

}  // namespace clothfit
