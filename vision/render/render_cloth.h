#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "vision/render/camera_rays.h"
#include "vision/render/sheet_scene.h"

namespace clothfit {

/// Options in grey levels, which grow in proportion to light, black at 0.
struct RenderOptions {
  double ambient_levels = 90;  ///< >= 0; of a surface of reflectance 1 without direct light
  double direct_levels = 150;  ///< >= 0; added where the light falls straight on the seen side
  Eigen::Vector3d towards_light{0.4, -0.8, 0.45};  ///< world axes, not 0; of any length
  double background_level = 60;                    ///< >= 0
  /// 1 to 16: lines of sight across a pixel, evenly spaced; time grows with the square.
  int samples = 3;
  /// px, >= 0: standard deviation of a Gaussian point spread. It comes on top of the pixel's own
  /// area and, where it is not 0, of the area of a sample.
  double blur_px = 0.5;
  double noise_levels = 0;  ///< >= 0; standard deviation of the sensor's noise
  double shot_levels = 0;   ///< >= 0; variance of shot noise per level of light (levels^2 / level)
  void validate() const;    ///< throws InputError
};

/// Renders footage of sheets: a cloth, and boards beside it, as 8-bit grey.
///
///   level = reflectance (ambient + direct max(0, n . l)),  n of the side that is seen
///
/// The cloth is opaque (a light behind it leaves ambient light), without shadows and reflections.
/// The shutter is global: the camera's readout time is not used. Each of `instants` (one or more)
/// holds all sheets at one instant while the shutter is open. Light is averaged over them, which
/// blurs motion and takes time in proportion. The picture's light is averaged over the pixel's area
/// and the point spread before noise and rounding. Values end at 0 and 255.
///
/// The camera must have a pose. The same arguments give the same bytes for any number of threads;
/// each picture needs a `noise_seed` of its own. Throws InputError for options out of range and for
/// a camera without a pose.
///
/// The print is averaged over the area between samples (SheetPrint::reflectance), so its edges are
/// right to a few thousandths of a pixel with few samples. Outlines of sheets are not averaged, and
/// are off by up to 0.5 / samples.
cv::Mat render_cloth(const CameraRays& rays, std::span<const std::vector<PlacedSheet>> instants,
                     const RenderOptions& options, std::uint64_t noise_seed);

}  // namespace clothfit
