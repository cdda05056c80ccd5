#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

namespace clothfit {

/// A surface of triangles as it looks: matt, one colour on each side.
struct ColouredSurface {
  Eigen::Matrix3Xd vertex_m;
  /// 3 x triangles, indices of vertices, counterclockwise as seen from the front.
  Eigen::Matrix3Xi triangle;
  Eigen::Vector3d front{0.5, 0.5, 0.5}, back{0.4, 0.4, 0.4};  ///< reflectance of red, green, blue
};

/// From where surfaces are looked at, and the size of the picture. All of them fill it.
struct SurfaceView {
  double azimuth_rad = 0;      ///< from the -y axis towards +x
  double elevation_rad = 0.1;  ///< above the horizontal
  int width_px = 600, height_px = 800;
};

/// Renders surfaces in the open under a lamp and a bright sky: an 8-bit colour picture on white.
/// Surfaces throw shadows on one another, and folds are darker where they see less of the sky. The
/// same arguments give the same bytes for any number of threads. Surfaces must be finite.
cv::Mat render_surfaces(const std::vector<ColouredSurface>& surfaces, const SurfaceView& view);

}  // namespace clothfit
