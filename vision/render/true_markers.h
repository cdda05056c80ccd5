#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "data/camera_parameters.h"
#include "data/markers.h"
#include "vision/render/sheet_scene.h"

namespace clothfit {

/// Says whether a camera sees a marker; if not, the first reason in this order.
enum class MarkerSight {
  seen,
  behind_camera,    ///< or so far aside that the lens maps nothing there
  outside_picture,  ///< beyond the outer edges of the pixels at the border
  facing_away,      ///< the printed side looks away from the camera
  hidden            ///< another part of the cloth, or another sheet, is in front of it
};

struct TrueMarker {
  MarkerSight sight = MarkerSight::behind_camera;
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();  ///< unset where it is `behind_camera`
};

/// Returns the true places of the markers of `sheets[sheet]` in a picture of all `sheets`. They are
/// projections of their points of the same surface that render_cloth draws. For a picture that
/// motion blurs, give the sheets at the middle of the exposure. The camera must have a pose.
std::vector<TrueMarker> true_markers(const CameraParameters& camera,
                                     std::span<const PlacedSheet> sheets, int sheet,
                                     std::span<const Marker> markers);

}  // namespace clothfit
