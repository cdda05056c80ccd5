#include "calib/placement/sheet_pose.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/bundle/exact_pose.h"
#include "calib/bundle/pose_start.h"

namespace clothfit {

SheetPoseResult place_sheet(const CameraParameters& parameters,
                            const std::vector<PlacedPixel>& sheet) {
  SheetPoseResult result;
  if (sheet.size() < 4) {
    result.message = fmt::format("the sheet shows {} points; 4 or more place it", sheet.size());
    return result;
  }
  if (!is_finite(sheet)) {
    result.message = "a point of the sheet is not a number, or its sigma is not > 0";
    return result;
  }
  const FixedCamera camera(parameters);
  const auto image = on_image_plane(parameters, sheet);
  if (!image) {
    result.message = "the camera's distortion sends no ray to some pixel of the sheet";
    return result;
  }
  std::vector<Eigen::Vector2d> on_plane_m;
  for (const auto& point : sheet) on_plane_m.emplace_back(point.point_m.head<2>());
  const double tolerance = 0.01 * std::hypot(parameters.image_width, parameters.image_height) /
                           parameters.focal_px.maxCoeff();
  RobustPose best;
  for (const auto& candidate : plane_poses(on_plane_m, *image, tolerance)) {
    const RobustPose refined = refine_pose_robustly(camera, sheet, candidate);
    if (refined.cost < best.cost) best = refined;
  }
  if (!std::isfinite(best.cost)) {
    result.message = "no pose of a flat sheet explains its points; are they on one line?";
    return result;
  }

  constexpr double kOutlierSpreads = 5;
  const auto residuals = standardised_residuals(camera, sheet, best.camera_from_world);
  std::vector<char> used;
  for (const auto& residual : residuals)
    used.push_back(residual.norm() <= kOutlierSpreads * best.spread ? 1 : 0);
  const auto good = std::count(used.begin(), used.end(), char{1});
  result.camera_from_sheet = best.camera_from_world;
  if (good < 4 || !refine_pose(camera, sheet, used, 0, result.camera_from_sheet)) {
    result.message = "the sheet's points agree on no pose";
    return result;
  }
  double sum_px2 = 0;
  const auto final_residuals = standardised_residuals(camera, sheet, result.camera_from_sheet);
  for (size_t i = 0; i < sheet.size(); ++i)
    if (used[i]) sum_px2 += (sheet[i].sigma_px * final_residuals[i]).squaredNorm();
  result.rms_px = std::sqrt(sum_px2 / (2 * static_cast<double>(good)));
  result.usable = std::isfinite(result.rms_px);
  result.message = fmt::format("{} of {} points, rms {:.3f} px", good, sheet.size(), result.rms_px);
  return result;
}

}  // namespace clothfit
