#include "vision/render/sheet_scene.h"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace clothfit {
namespace {

using Device = std::unique_ptr<RTCDeviceTy, void (*)(RTCDevice)>;
using Scene = std::unique_ptr<RTCSceneTy, void (*)(RTCScene)>;

/// A sheet in camera axes.
struct Sheet {
  const SheetPrint* print = nullptr;
  int columns = 0, rows = 0;
  Eigen::Matrix3Xd position_m;
  Eigen::Matrix3Xd outward;  ///< per vertex, length 1 (0 where the mesh has no area)

  Eigen::Vector3d vertex(int i, int j) const { return position_m.col(i * columns + j); }
};

/// Half of a mesh cell: P = corner + x along + y down, 0 <= x, y, x + y <= 1. The upper one
/// (`lower` false) starts from [i, j], the lower one from [i + 1, j + 1] backwards.
struct Triangle {
  int i = 0, j = 0;  ///< of the cell
  bool lower = false;
  Eigen::Vector3d corner, along, down;

  Triangle(const Sheet& sheet, int row, int column, bool is_lower)
      : i(row), j(column), lower(is_lower) {
    const int back = lower ? 1 : 0, step = lower ? -1 : 1;
    corner = sheet.vertex(i + back, j + back);
    along = sheet.vertex(i + back, j + back + step) - corner;
    down = sheet.vertex(i + back + step, j + back) - corner;
  }
  Eigen::Vector3d outward() const { return down.cross(along); }  // t x s, in both halves
};

/// Returns the triangle of Embree's number: two per cell, the upper first.
Triangle triangle_of(const Sheet& sheet, unsigned number) {
  const int cell = static_cast<int>(number / 2);
  const int cells_across = sheet.columns - 1;
  return {sheet, cell / cells_across, cell % cells_across, number % 2 == 1};
}

/// Returns normals at the vertices by central differences, one-sided at the edges.
Eigen::Matrix3Xd vertex_normals(const Sheet& sheet) {
  Eigen::Matrix3Xd outward(3, sheet.position_m.cols());
  for (int i = 0; i < sheet.rows; ++i) {
    for (int j = 0; j < sheet.columns; ++j) {
      const Eigen::Vector3d along =
          sheet.vertex(i, std::min(j + 1, sheet.columns - 1)) - sheet.vertex(i, std::max(j - 1, 0));
      const Eigen::Vector3d down =
          sheet.vertex(std::min(i + 1, sheet.rows - 1), j) - sheet.vertex(std::max(i - 1, 0), j);
      outward.col(i * sheet.columns + j) = down.cross(along).normalized();
    }
  }
  return outward;
}

void attach(RTCDevice device, RTCScene scene, const Sheet& sheet) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  const auto vertices = static_cast<size_t>(sheet.position_m.cols());
  auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertices));
  Eigen::Map<Eigen::Matrix3Xf>(vertex, 3, sheet.position_m.cols()) = sheet.position_m.cast<float>();

  const auto triangles = static_cast<size_t>(2 * (sheet.columns - 1) * (sheet.rows - 1));
  auto* index = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), triangles));
  for (int i = 0; i + 1 < sheet.rows; ++i) {
    for (int j = 0; j + 1 < sheet.columns; ++j) {
      const auto a = static_cast<unsigned>(i * sheet.columns + j);
      const unsigned b = a + 1, c = a + static_cast<unsigned>(sheet.columns), d = c + 1;
      for (const unsigned v : {a, b, c, d, c, b}) *index++ = v;
    }
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);  // ids count from 0 in this order
  rtcReleaseGeometry(geometry);
}

RTCRayHit sight_line(const Eigen::Vector3f& direction, float far) {
  RTCRayHit line{};
  line.ray.dir_x = direction.x();
  line.ray.dir_y = direction.y();
  line.ray.dir_z = direction.z();
  line.ray.tfar = far;
  line.ray.mask = std::numeric_limits<unsigned>::max();
  line.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  line.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  return line;
}

/// The place where the line from the origin along a direction meets a triangle's plane.
struct PlaneHit {
  Eigen::Vector2d place;         ///< (x, y) of the triangle
  Eigen::Matrix2d by_direction;  ///< its derivative by the direction's x and y
};

/// Computes the place in double, moved onto the triangle where rounding puts it beside. If the
/// plane is seen edge on, the place is `rough`.
PlaneHit meet(const Triangle& triangle, const Eigen::Vector3d& direction,
              const Eigen::Vector2d& rough) {
  // direction depth = corner + x along + y down, by Cramer's rule.
  constexpr double kEdgeOn = 1e-10;
  const Eigen::Vector3d across = direction.cross(triangle.down);
  const Eigen::Vector3d beneath = triangle.along.cross(direction);
  const double determinant = triangle.along.dot(across);
  if (!(std::abs(determinant) >
        kEdgeOn * triangle.along.norm() * triangle.down.norm() * direction.norm()))
    return {.place = rough, .by_direction = Eigen::Matrix2d::Zero()};
  const double x = -triangle.corner.dot(across) / determinant;
  const double y = -triangle.corner.dot(beneath) / determinant;
  const double depth = triangle.corner.dot(triangle.along.cross(triangle.down)) /
                       direction.dot(triangle.along.cross(triangle.down));
  PlaneHit hit;
  hit.place.x() = std::clamp(x, 0.0, 1.0);
  hit.place.y() = std::clamp(y, 0.0, 1 - hit.place.x());
  hit.by_direction.row(0) = depth / determinant * across.head<2>().transpose();
  hit.by_direction.row(1) = depth / determinant * beneath.head<2>().transpose();
  return hit;
}

}  // namespace

struct SheetScene::Traced {
  Device device{nullptr, rtcReleaseDevice};
  Scene scene{nullptr, rtcReleaseScene};
  std::vector<Sheet> sheets;

  SheetHit hit_of(const RTCRayHit& line, const Eigen::Vector3d& direction) const {
    SheetHit hit;
    hit.sheet = static_cast<int>(line.hit.geomID);
    const Sheet& sheet = sheets[line.hit.geomID];
    const Triangle triangle = triangle_of(sheet, line.hit.primID);
    const PlaneHit met = meet(triangle, direction, {double{line.hit.u}, double{line.hit.v}});
    const double x = triangle.lower ? 1 - met.place.x() : met.place.x();
    const double y = triangle.lower ? 1 - met.place.y() : met.place.y();
    const Eigen::Vector2d cell_m(sheet.print->width_m() / (sheet.columns - 1),
                                 sheet.print->height_m() / (sheet.rows - 1));
    hit.place_m = cell_m.cwiseProduct(Eigen::Vector2d(triangle.j + x, triangle.i + y));
    hit.place_by_direction = (triangle.lower ? -1 : 1) * (cell_m.asDiagonal() * met.by_direction);

    const Eigen::Vector3d outward = triangle.outward();
    hit.printed_side = outward.dot(direction) < 0;
    const int corner = triangle.i * sheet.columns + triangle.j;
    const auto normal = [&](int down, int along) {
      return sheet.outward.col(corner + down * sheet.columns + along);
    };
    hit.normal =
        triangle.lower
            ? ((x + y - 1) * normal(1, 1) + (1 - x) * normal(1, 0) + (1 - y) * normal(0, 1))
            : ((1 - x - y) * normal(0, 0) + x * normal(0, 1) + y * normal(1, 0));
    if (!(hit.normal.dot(outward) > 0)) hit.normal = outward;  // crumpled below the mesh's spacing
    hit.normal.normalize();
    if (!hit.printed_side) hit.normal = -hit.normal;
    return hit;
  }
};

SheetScene::SheetScene(std::span<const PlacedSheet> sheets, const Rigid3& camera_from_world)
    : traced_(std::make_unique<Traced>()) {
  const Eigen::Matrix3d rotation = camera_from_world.rotation.toRotationMatrix();
  for (const PlacedSheet& placed : sheets) {
    assert(placed.print != nullptr && placed.columns >= 2 && placed.rows >= 2);
    assert(placed.position_m.cols() == placed.columns * placed.rows);
    assert(placed.position_m.allFinite());
    Sheet sheet{
        .print = placed.print,
        .columns = placed.columns,
        .rows = placed.rows,
        .position_m = (rotation * placed.position_m).colwise() + camera_from_world.translation_m,
        .outward = {}};
    sheet.outward = vertex_normals(sheet);
    traced_->sheets.push_back(std::move(sheet));
  }

  traced_->device.reset(rtcNewDevice(nullptr));
  if (!traced_->device) throw std::runtime_error("Embree finds no device on this machine");
  traced_->scene.reset(rtcNewScene(traced_->device.get()));
  // Robust tracing lets no line of sight slip through between two triangles.
  rtcSetSceneFlags(traced_->scene.get(), RTC_SCENE_FLAG_ROBUST);
  for (const Sheet& sheet : traced_->sheets)
    attach(traced_->device.get(), traced_->scene.get(), sheet);
  // One thread builds the tree, so that it is always the same. With it, a line of sight through the
  // common edge of two triangles always meets the same one.
  tbb::task_arena(1).execute([&] { rtcCommitScene(traced_->scene.get()); });
  if (rtcGetDeviceError(traced_->device.get()) != RTC_ERROR_NONE)
    throw std::runtime_error("Embree cannot arrange the sheets");
}

SheetScene::~SheetScene() = default;
SheetScene::SheetScene(SheetScene&&) noexcept = default;
SheetScene& SheetScene::operator=(SheetScene&&) noexcept = default;

void SheetScene::look(std::span<const Eigen::Vector2d> direction, std::span<SheetHit> hit) const {
  assert(direction.size() == hit.size());
  std::vector<RTCRayHit> lines;
  std::vector<size_t> places;  // of each line in `direction`
  lines.reserve(direction.size());
  places.reserve(direction.size());
  for (size_t k = 0; k < direction.size(); ++k) {
    hit[k] = {};
    if (!direction[k].allFinite()) continue;
    const Eigen::Vector3d along = direction[k].homogeneous();
    lines.push_back(sight_line(along.cast<float>(), std::numeric_limits<float>::infinity()));
    places.push_back(k);
  }
  if (lines.empty()) return;

  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect1M(traced_->scene.get(), &context, lines.data(), static_cast<unsigned>(lines.size()),
                 sizeof(RTCRayHit));
  for (size_t l = 0; l < lines.size(); ++l) {
    if (lines[l].hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
    hit[places[l]] = traced_->hit_of(lines[l], direction[places[l]].homogeneous());
  }
}

SheetPoint SheetScene::point(int sheet_index, double s_m, double t_m) const {
  const Sheet& sheet = traced_->sheets.at(static_cast<size_t>(sheet_index));
  const double column = s_m / sheet.print->width_m() * (sheet.columns - 1);
  const double row = t_m / sheet.print->height_m() * (sheet.rows - 1);
  const int j = std::clamp(static_cast<int>(column), 0, sheet.columns - 2);
  const int i = std::clamp(static_cast<int>(row), 0, sheet.rows - 2);
  const double x = column - j, y = row - i;
  const bool lower = x + y > 1;
  const Triangle triangle(sheet, i, j, lower);
  return {.point_m = triangle.corner + (lower ? 1 - x : x) * triangle.along +
                     (lower ? 1 - y : y) * triangle.down,
          .outward = triangle.outward().normalized()};
}

bool SheetScene::is_hidden(const Eigen::Vector3d& point_in_camera_m) const {
  constexpr float kOwnSurface = 1e-5F;
  RTCRay line = sight_line(point_in_camera_m.cast<float>(), 1 - kOwnSurface).ray;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(traced_->scene.get(), &context, &line);
  return line.tfar < 0;  // Embree's sign for a hit
}

}  // namespace clothfit
