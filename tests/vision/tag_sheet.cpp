#include "tests/vision/tag_sheet.h"

#include <fmt/core.h>

#include <array>
#include <string>

namespace clothfit {

MarkerSet tag_markers(int across, double width_m) {
  constexpr double kShare = 0.72;
  const double spacing_m = width_m / across;
  const double half_m = 0.5 * kShare * spacing_m;
  constexpr std::array<std::array<double, 2>, 4> kCorners{{{-1, 1}, {1, 1}, {1, -1}, {-1, -1}}};
  MarkerSet set{.kind = MarkerKind::apriltag, .family = "tag36h11", .markers = {}, .index = {}};
  for (int tag = 0; tag < across * across; ++tag) {
    const double s_m = (tag % across + 0.5) * spacing_m, t_m = (tag / across + 0.5) * spacing_m;
    for (int corner = 0; corner < 4; ++corner) {
      const auto [right, down] = kCorners[static_cast<size_t>(corner)];
      const std::string name = fmt::format("t{}_{}", tag, corner);
      set.index[name] = static_cast<int>(set.markers.size());
      set.markers.push_back({.name = name,
                             .s_m = s_m + right * half_m,
                             .t_m = t_m + down * half_m,
                             .tag = tag,
                             .corner = corner});
    }
  }
  return set;
}

PlacedSheet place_sheet(const SheetPrint& print, int columns,
                        const std::function<Eigen::Vector3d(double, double)>& shape) {
  PlacedSheet sheet{.print = &print,
                    .columns = columns,
                    .rows = columns,
                    .position_m = Eigen::Matrix3Xd(3, columns * columns)};
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < columns; ++j)
      sheet.position_m.col(i * columns + j) =
          shape(j * print.width_m() / (columns - 1), i * print.height_m() / (columns - 1));
  }
  return sheet;
}

CameraParameters camera_before(double distance_m, double focal_px, int width_px, int height_px) {
  CameraParameters camera;
  camera.name = "front";
  camera.image_width = width_px;
  camera.image_height = height_px;
  camera.focal_px = {focal_px, focal_px};
  camera.centre_px = {0.5 * (width_px - 1), 0.5 * (height_px - 1)};
  Eigen::Matrix3d camera_from_world;
  camera_from_world << 1, 0, 0,  //
      0, 0, -1,                  //
      0, 1, 0;
  camera.camera_from_world = CameraPose{.rotation = Eigen::Quaterniond(camera_from_world),
                                        .translation_m = {0, 0, distance_m},
                                        .covariance = {}};
  return camera;
}

std::function<Eigen::Vector3d(double, double)> hanging_flat(double width_m) {
  return
      [=](double s, double t) { return Eigen::Vector3d(s - 0.5 * width_m, 0, 0.5 * width_m - t); };
}

}  // namespace clothfit
