#include "vision/render/true_markers.h"

#include <optional>

#include "calib/camera/projection.h"

namespace clothfit {
namespace {

/// Returns the pixel of a point, unless the lens' formula folds back there. Where it does, it names
/// a pixel that shows something else.
std::optional<Eigen::Vector2d> true_pixel(const CameraParameters& camera,
                                          const Eigen::Vector3d& point_in_camera) {
  constexpr double kSame = 1e-6;  // on the plane z = 1: a thousandth of a pixel
  const std::optional<Eigen::Vector2d> pixel = project(camera, point_in_camera);
  if (!pixel || !pixel->allFinite()) return std::nullopt;
  const std::optional<Eigen::Vector3d> seen = unproject(camera, *pixel);
  if (!seen || (seen->hnormalized() - point_in_camera.hnormalized()).norm() >
                   kSame * (1 + point_in_camera.hnormalized().squaredNorm()))
    return std::nullopt;
  return pixel;
}

}  // namespace

std::vector<TrueMarker> true_markers(const CameraParameters& camera,
                                     std::span<const PlacedSheet> sheets, int sheet,
                                     std::span<const Marker> markers) {
  const SheetScene scene(sheets, camera_from_world(camera));
  std::vector<TrueMarker> result;
  for (const Marker& marker : markers) {
    const SheetPoint at = scene.point(sheet, marker.s_m, marker.t_m);
    const std::optional<Eigen::Vector2d> pixel = true_pixel(camera, at.point_m);
    TrueMarker& truth = result.emplace_back();
    if (!pixel) continue;
    truth.pixel_px = *pixel;
    const bool inside = pixel->x() >= -0.5 && pixel->x() <= camera.image_width - 0.5 &&
                        pixel->y() >= -0.5 && pixel->y() <= camera.image_height - 0.5;
    if (!inside)
      truth.sight = MarkerSight::outside_picture;
    else if (at.outward.dot(at.point_m) >= 0)
      truth.sight = MarkerSight::facing_away;
    else if (scene.is_hidden(at.point_m))
      truth.sight = MarkerSight::hidden;
    else
      truth.sight = MarkerSight::seen;
  }
  return result;
}

}  // namespace clothfit
