#include "vision/render/render_cloth.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <random>

#include "calib/camera/projection.h"
#include "data/input_error.h"
#include "data/parallel.h"

namespace clothfit {
namespace {

constexpr double kReach = 4;  // standard deviations of the point spread that count

/// Samples along one axis of the picture: `samples` to a pixel. As many pixels surround the picture
/// as the point spread reaches.
struct SampleAxis {
  int samples = 0;
  int margin_px = 0;
  std::vector<double> weight;  ///< of the samples around a pixel, (2 margin + 1) samples; sum 1

  explicit SampleAxis(const RenderOptions& options)
      : samples(options.samples), margin_px(static_cast<int>(std::ceil(kReach * options.blur_px))) {
    double sum = 0;
    for (int k = 0; k < (2 * margin_px + 1) * samples; ++k) {
      weight.push_back(pixel_response(place_px(k), options.blur_px));
      sum += weight.back();
    }
    for (double& w : weight) w /= sum;
  }

  /// Returns the place of sample k, where pixel 0 is at 0.
  double place_px(int k) const { return -0.5 - margin_px + (k + 0.5) / samples; }
  int count(int size_px) const { return (size_px + 2 * margin_px) * samples; }

  /// Returns the pixel's area (a box of width 1) blurred by a Gaussian, at `x_px` from its middle.
  static double pixel_response(double x_px, double blur_px) {
    if (blur_px == 0) return std::abs(x_px) < 0.5 ? 1 : 0;
    const auto below = [&](double x) { return 0.5 * std::erfc(-x / blur_px * M_SQRT1_2); };
    return below(x_px + 0.5) - below(x_px - 0.5);
  }
};

/// Light in grey levels from the surface that a line of sight meets.
struct Lighting {
  const RenderOptions& options;
  Eigen::Vector3d towards_light;  ///< camera axes, length 1

  /// `step` holds the distances to the next samples across and down, as directions (x, y) in
  /// columns.
  double level(const SheetHit& hit, const Eigen::Matrix2d& step,
               std::span<const PlacedSheet> sheets) const {
    if (hit.sheet < 0) return options.background_level;
    const SheetPrint& print = *sheets[static_cast<size_t>(hit.sheet)].print;
    const double reflectance = hit.printed_side
                                   ? print.reflectance(hit.place_m, hit.place_by_direction * step)
                                   : print.back_reflectance();
    const double direct = std::max(0.0, hit.normal.dot(towards_light));
    return reflectance * (options.ambient_levels + options.direct_levels * direct);
  }
};

/// Samples rows, blurred along the row: one value per pixel across, `axis.count(height)` rows.
cv::Mat sample_rows(const CameraRays& rays, std::span<const std::vector<PlacedSheet>> instants,
                    const std::vector<SheetScene>& scenes, const Lighting& lighting,
                    const SampleAxis& axis) {
  const int width = rays.camera().image_width;
  const auto across = static_cast<size_t>(axis.count(width));
  std::vector<double> u_px(across);
  for (size_t k = 0; k < across; ++k) u_px[k] = axis.place_px(static_cast<int>(k));

  cv::Mat rows(axis.count(rays.camera().image_height), width, CV_32FC1);
  constexpr int kRowsAtOnce = 8;  // they share buffers
  const int parts = (rows.rows + kRowsAtOnce - 1) / kRowsAtOnce;
  for_each_index(static_cast<size_t>(parts), [&](size_t part) {
    std::vector<Eigen::Vector2d> direction(across), below(across);
    std::vector<Eigen::Matrix2d> step(across);
    std::vector<SheetHit> hit(across);
    std::vector<double> level(across);
    const int first = static_cast<int>(part) * kRowsAtOnce;
    for (int row = first; row < std::min(first + kRowsAtOnce, rows.rows); ++row) {
      rays.row(u_px, axis.place_px(row), direction);
      rays.row(u_px, axis.place_px(row + 1), below);
      for (size_t k = 0; k < across; ++k) {
        const size_t left = std::min(k, across - 2);
        step[k] << direction[left + 1] - direction[left], below[k] - direction[k];
        if (!step[k].allFinite()) step[k].setZero();  // at the rim of what the lens shows
      }
      std::fill(level.begin(), level.end(), 0.0);
      for (size_t i = 0; i < scenes.size(); ++i) {
        scenes[i].look(direction, hit);
        for (size_t k = 0; k < across; ++k)
          level[k] += lighting.level(hit[k], step[k], instants[i]);
      }
      float* out = rows.ptr<float>(row);
      for (int u = 0; u < width; ++u) {
        const double* around = &level[static_cast<size_t>(u * axis.samples)];
        double sum = 0;
        for (size_t k = 0; k < axis.weight.size(); ++k) sum += axis.weight[k] * around[k];
        out[u] = static_cast<float>(sum / static_cast<double>(scenes.size()));
      }
    }
  });
  return rows;
}

/// Returns the generator of one row of one picture, the same on whichever thread.
std::mt19937_64 row_generator(std::uint64_t noise_seed, int row) {
  std::seed_seq seed{static_cast<std::uint32_t>(noise_seed),
                     static_cast<std::uint32_t>(noise_seed >> 32), static_cast<std::uint32_t>(row)};
  return std::mt19937_64(seed);
}

}  // namespace

void RenderOptions::validate() const {
  const auto check = [](const char* name, double value, const char* unit) {
    if (!(value >= 0 && std::isfinite(value)))
      throw InputError(name, fmt::format("{}", value), fmt::format("{}, >= 0", unit));
  };
  check("ambient_levels", ambient_levels, "grey levels");
  check("direct_levels", direct_levels, "grey levels");
  check("background_level", background_level, "a grey level");
  check("blur_px", blur_px, "pixels");
  check("noise_levels", noise_levels, "grey levels");
  check("shot_levels", shot_levels, "variance per grey level");
  if (!(towards_light.norm() > 0 && towards_light.allFinite()))
    throw InputError("towards_light", "has no direction", "a vector towards the light");
  if (samples < 1 || samples > 16)
    throw InputError("samples", fmt::format("{}", samples),
                     "lines of sight across a pixel, 1 to 16");
}

cv::Mat render_cloth(const CameraRays& rays, std::span<const std::vector<PlacedSheet>> instants,
                     const RenderOptions& options, std::uint64_t noise_seed) {
  options.validate();
  assert(!instants.empty());
  const CameraParameters& camera = rays.camera();
  if (!camera.camera_from_world)
    throw InputError(camera.name, "the camera has no pose",
                     "camera_from_world, to render its view");
  const SampleAxis axis(options);
  if (axis.margin_px > rays.margin_px())
    throw InputError("blur_px", fmt::format("{}", options.blur_px),
                     fmt::format("at most {} px here", rays.margin_px() / kReach));

  const Rigid3 pose = camera_from_world(camera);
  std::vector<SheetScene> scenes;
  for (const auto& sheets : instants) scenes.emplace_back(sheets, pose);
  const Lighting lighting{options, pose.rotation * options.towards_light.normalized()};
  const cv::Mat rows = sample_rows(rays, instants, scenes, lighting, axis);

  cv::Mat picture(camera.image_height, camera.image_width, CV_8UC1);
  for_each_index(static_cast<size_t>(picture.rows), [&](size_t row) {
    const int v = static_cast<int>(row);
    std::mt19937_64 generator = row_generator(noise_seed, v);
    std::normal_distribution<double> normal;
    for (int u = 0; u < picture.cols; ++u) {
      double level = 0;
      for (size_t k = 0; k < axis.weight.size(); ++k)
        level += axis.weight[k] * double{rows.at<float>(v * axis.samples + static_cast<int>(k), u)};
      const double variance =
          options.noise_levels * options.noise_levels + options.shot_levels * level;
      if (variance > 0) level += std::sqrt(variance) * normal(generator);
      picture.at<std::uint8_t>(v, u) =
          static_cast<std::uint8_t>(std::lround(std::clamp(level, 0.0, 255.0)));
    }
  });
  return picture;
}

}  // namespace clothfit
