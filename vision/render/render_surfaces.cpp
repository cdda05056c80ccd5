#include "vision/render/render_surfaces.h"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "data/parallel.h"

namespace clothfit {
namespace {

/// Lines of sight across a pixel, and towards the sky from each place that is seen.
constexpr int kAcross = 3;
constexpr int kSkyLines = 12;

/// Returns directions over the half-space above z = 0, denser upwards as matt surfaces see it.
std::array<Eigen::Vector3d, kSkyLines> sky_lines() {
  std::array<Eigen::Vector3d, kSkyLines> lines;
  constexpr double kGolden = 2.399963229728653;
  for (int n = 0; n < kSkyLines; ++n) {
    const double square = (n + 0.5) / kSkyLines, aside = std::sqrt(square), turn = kGolden * n;
    lines[static_cast<size_t>(n)] = {aside * std::cos(turn), aside * std::sin(turn),
                                     std::sqrt(1 - square)};
  }
  return lines;
}

/// The surfaces, arranged for lines between places.
class Scene {
 public:
  explicit Scene(const std::vector<ColouredSurface>& surfaces) : surfaces_(surfaces) {
    device_.reset(rtcNewDevice(nullptr));
    if (!device_) throw std::runtime_error("Embree finds no device on this machine");
    scene_.reset(rtcNewScene(device_.get()));
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    for (const ColouredSurface& surface : surfaces) attach(surface);
    tbb::task_arena(1).execute([&] { rtcCommitScene(scene_.get()); });
    if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE)
      throw std::runtime_error("Embree cannot arrange the surfaces");
  }

  /// Returns the light (0 to 1 of each colour) that comes along a line to its beginning.
  Eigen::Vector3d light(const Eigen::Vector3d& from, const Eigen::Vector3d& along,
                        const Eigen::Vector3d& towards_lamp) const {
    RTCRayHit line{};
    line.ray = ray(from, along);
    line.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_.get(), &context, &line);
    if (line.hit.geomID == RTC_INVALID_GEOMETRY_ID) return Eigen::Vector3d::Ones();

    const ColouredSurface& surface = surfaces_[line.hit.geomID];
    const Eigen::Vector3i corner = surface.triangle.col(line.hit.primID);
    const double u = line.hit.u, v = line.hit.v;
    const Eigen::Vector3d flat = Eigen::Vector3d(line.hit.Ng_x, line.hit.Ng_y, line.hit.Ng_z);
    const Eigen::Matrix3Xd& normals = normal_[line.hit.geomID];
    Eigen::Vector3d normal = (1 - u - v) * normals.col(corner[0]) + u * normals.col(corner[1]) +
                             v * normals.col(corner[2]);
    if (!(normal.dot(flat) > 0)) normal = flat;
    const bool is_front = flat.dot(along) < 0;
    normal = (is_front ? 1 : -1) * normal.normalized();
    const Eigen::Vector3d outwards = (is_front ? 1 : -1) * flat.normalized();
    const Eigen::Vector3d place = from + line.ray.tfar * along + kAside_m * outwards;
    return (is_front ? surface.front : surface.back) * lit(place, normal, towards_lamp);
  }

 private:
  static constexpr double kAside_m = 2e-4;  // from a surface, so that it does not shade itself

  void attach(const ColouredSurface& surface) {
    Eigen::Matrix3Xd normal = Eigen::Matrix3Xd::Zero(3, surface.vertex_m.cols());
    for (const auto& corner : surface.triangle.colwise()) {
      const Eigen::Vector3d a = surface.vertex_m.col(corner[0]),
                            ab = surface.vertex_m.col(corner[1]) - a,
                            ac = surface.vertex_m.col(corner[2]) - a;
      for (const int v : corner) normal.col(v) += ab.cross(ac);
    }
    normal_.push_back(normal.colwise().normalized());
    RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertex = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), static_cast<size_t>(surface.vertex_m.cols())));
    Eigen::Map<Eigen::Matrix3Xf>(vertex, 3, surface.vertex_m.cols()) =
        surface.vertex_m.cast<float>();
    auto* index = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned),
        static_cast<size_t>(surface.triangle.cols())));
    Eigen::Map<Eigen::Matrix<unsigned, 3, Eigen::Dynamic>>(index, 3, surface.triangle.cols()) =
        surface.triangle.cast<unsigned>();
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);  // ids count from 0 in this order
    rtcReleaseGeometry(geometry);
  }

  static RTCRay ray(const Eigen::Vector3d& from, const Eigen::Vector3d& along) {
    RTCRay ray{};
    const Eigen::Vector3f place = from.cast<float>(), direction = along.cast<float>();
    ray.org_x = place.x(), ray.org_y = place.y(), ray.org_z = place.z();
    ray.dir_x = direction.x(), ray.dir_y = direction.y(), ray.dir_z = direction.z();
    ray.tfar = std::numeric_limits<float>::infinity();
    ray.mask = std::numeric_limits<unsigned>::max();
    return ray;
  }

  bool is_open(const Eigen::Vector3d& from, const Eigen::Vector3d& along) const {
    RTCRay line = ray(from, along);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene_.get(), &context, &line);
    return line.tfar >= 0;
  }

  /// Returns the light that falls on a place: of the lamp, and of the sky as far as it is open.
  double lit(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
             const Eigen::Vector3d& towards_lamp) const {
    constexpr double kLamp = 0.6, kSky = 0.55;
    static const std::array<Eigen::Vector3d, kSkyLines> lines = sky_lines();
    const Eigen::Quaterniond turn =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal);
    double sky = 0;
    for (const Eigen::Vector3d& line : lines) {
      const Eigen::Vector3d towards = turn * line;
      // Little light comes from below.
      if (is_open(place, towards)) sky += (0.7 + 0.3 * towards.z()) / kSkyLines;
    }
    const double facing = normal.dot(towards_lamp);
    const double lamp = facing > 0 && is_open(place, towards_lamp) ? facing : 0;
    return std::min(kLamp * lamp + kSky * sky, 1.0);
  }

  const std::vector<ColouredSurface>& surfaces_;
  std::vector<Eigen::Matrix3Xd> normal_;
  std::unique_ptr<RTCDeviceTy, void (*)(RTCDevice)> device_{nullptr, rtcReleaseDevice};
  std::unique_ptr<RTCSceneTy, void (*)(RTCScene)> scene_{nullptr, rtcReleaseScene};
};

/// Returns the level of a light as screens show it.
std::uint8_t level(double light) {
  constexpr double kGamma = 1 / 2.2;
  return static_cast<std::uint8_t>(
      std::lround(255 * std::pow(std::clamp(light, 0.0, 1.0), kGamma)));
}

}  // namespace

cv::Mat render_surfaces(const std::vector<ColouredSurface>& surfaces, const SurfaceView& view) {
  const Scene scene(surfaces);
  const double azimuth = view.azimuth_rad, elevation = view.elevation_rad;
  // Rows: right, down, away.
  Eigen::Matrix3d axes;
  axes.row(2) << -std::sin(azimuth) * std::cos(elevation), std::cos(azimuth) * std::cos(elevation),
      -std::sin(elevation);
  axes.row(0) << std::cos(azimuth), std::sin(azimuth), 0;
  axes.row(1) = axes.row(2).cross(axes.row(0));
  Eigen::Vector3d low = Eigen::Vector3d::Constant(INFINITY), high = -low;
  for (const ColouredSurface& surface : surfaces) {
    const Eigen::Matrix3Xd seen = axes * surface.vertex_m;
    low = low.cwiseMin(seen.rowwise().minCoeff());
    high = high.cwiseMax(seen.rowwise().maxCoeff());
  }
  constexpr double kMargin = 1.06;
  const double scale_m = kMargin * std::max((high.x() - low.x()) / view.width_px,
                                            (high.y() - low.y()) / view.height_px);
  const Eigen::Vector3d middle = 0.5 * (low + high);
  const Eigen::Vector3d towards_lamp =
      axes.transpose() * Eigen::Vector3d(-0.5, -0.7, -0.6).normalized();

  cv::Mat picture(view.height_px, view.width_px, CV_8UC3);
  for_each_index(static_cast<size_t>(view.height_px), [&](size_t row) {
    const int v = static_cast<int>(row);
    for (int u = 0; u < view.width_px; ++u) {
      Eigen::Vector3d light = Eigen::Vector3d::Zero();
      for (int n = 0; n < kAcross * kAcross; ++n) {
        const double x = u + (n % kAcross + 0.5) / kAcross - 0.5 * view.width_px,
                     y = v + (n / kAcross + 0.5) / kAcross - 0.5 * view.height_px;
        const Eigen::Vector3d from{middle.x() + scale_m * x, middle.y() + scale_m * y, low.z() - 1};
        light += scene.light(axes.transpose() * from, axes.row(2).transpose(), towards_lamp);
      }
      light /= kAcross * kAcross;
      picture.at<cv::Vec3b>(v, u) = {level(light[2]), level(light[1]), level(light[0])};
    }
  });
  return picture;
}

}  // namespace clothfit
