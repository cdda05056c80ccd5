#pragma once

#include <Eigen/Core>
#include <functional>

#include "data/camera_parameters.h"
#include "data/markers.h"
#include "vision/render/sheet_scene.h"

namespace clothfit {

/// Returns the corners of `across` x `across` tags of tag36h11 on a square sheet, row by row. A tag
/// is 0.72 of the spacing wide, as on the bundled cloth.
MarkerSet tag_markers(int across, double width_m);

/// Places a sheet with `columns` x `columns` vertices at `shape`(s, t).
PlacedSheet place_sheet(const SheetPrint& print, int columns,
                        const std::function<Eigen::Vector3d(double, double)>& shape);

/// Returns a camera in world axes for a sheet that hangs: x to the right, z up. The camera at (0,
/// -distance, 0) looks along y, its pixel (width - 1, height - 1) / 2 on the axis.
CameraParameters camera_before(double distance_m, double focal_px, int width_px, int height_px);

/// Returns a flat sheet around the origin that faces that camera; use with place_sheet.
std::function<Eigen::Vector3d(double, double)> hanging_flat(double width_m);

}  // namespace clothfit
