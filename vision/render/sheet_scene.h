#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>

#include "calib/camera/rigid3.h"
#include "vision/render/sheet_print.h"

namespace clothfit {

/// A printed sheet as it lies in space at one instant. Its surface is two flat triangles per cell
/// of the mesh, split from [i, j + 1] to [i + 1, j], with material coordinates linear on each. A
/// smooth surface needs a fine mesh; a stiff board has 2 x 2 vertices.
struct PlacedSheet {
  const SheetPrint* print = nullptr;  ///< of this size and outliving the sheet
  int columns = 0;                    ///< >= 2, along s
  int rows = 0;                       ///< >= 2, along t
  /// 3 x (columns rows), world axes, finite; vertex [i, j] has index i * columns + j.
  Eigen::Matrix3Xd position_m;
};

/// The first thing that a line of sight meets.
struct SheetHit {
  int sheet = -1;  ///< index of the sheet; -1: nothing, and the rest is unset
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();  ///< (s, t)
  /// Change of (s, t) with the direction (x, y, 1): d(s, t) / d(x, y), m.
  Eigen::Matrix2d place_by_direction = Eigen::Matrix2d::Zero();
  bool printed_side = false;
  /// Normal of the side that is seen, camera axes, length 1. It is interpolated between the
  /// vertices', so that light runs smoothly over the triangles.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

/// A point of a sheet in camera axes.
struct SheetPoint {
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();  ///< normal of its triangle, printed side
};

/// Sheets before a camera, arranged for lines of sight from its centre. Embree finds the triangle
/// in single precision about the camera's centre; the place on it is computed in double. The same
/// input gives the same bits for any number of threads (trees are built by one). Any number of
/// threads may look at once. Embree's devices change no floating-point setting that outlasts a
/// call.
class SheetScene {
 public:
  SheetScene(std::span<const PlacedSheet> sheets, const Rigid3& camera_from_world);
  ~SheetScene();
  SheetScene(SheetScene&&) noexcept;
  SheetScene& operator=(SheetScene&&) noexcept;

  /// Finds the sheet seen along (x, y, 1), one hit per direction; nothing along NaN.
  void look(std::span<const Eigen::Vector2d> direction, std::span<SheetHit> hit) const;

  SheetPoint point(int sheet, double s_m, double t_m) const;

  /// Says whether a sheet lies between the camera and a point. It must be nearer by 1e-5 of the
  /// distance or more, so that a point's own triangle does not hide it.
  bool is_hidden(const Eigen::Vector3d& point_in_camera_m) const;

 private:
  struct Traced;
  std::unique_ptr<Traced> traced_;
};

}  // namespace clothfit
