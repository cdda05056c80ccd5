#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "vision/texture/smooth_picture.h"

namespace clothfit {

/// The first picture around a marker: samples on a square grid within a disc, less what lies beside
/// the cloth. Their weight falls towards the rim, so that a rim that bends otherwise pulls little.
struct TexturePatch {
  struct Sample {
    Eigen::Vector2f offset_px = Eigen::Vector2f::Zero();  ///< from the marker
    float level = 0;                                      ///< grey levels
    /// Half the second derivative along u, the mixed one, half that along v, levels/px^2: how the
    /// level changes with the covariance of a blur.
    Eigen::Vector3f by_blur = Eigen::Vector3f::Zero();
    float weight = 0;         ///< 0 to 1
    int column = 0, row = 0;  ///< on the grid, from 0
  };
  Eigen::Vector2d marker_px = Eigen::Vector2d::Zero();  ///< in the first picture
  double radius_px = 0;
  int step_px = 1;       ///< between samples
  int grid_columns = 0;  ///< of the square grid, which has as many rows
  std::vector<Sample> samples;
  float mean_level = 0;
  float contrast_levels = 0;  ///< standard deviation of the samples
};

/// Says whether a place, px from the marker, shows the cloth.
using OnCloth = std::function<bool(const Eigen::Vector2d& from_marker_px)>;

/// Takes the patch around a marker from the first picture. Samples beyond the picture are left out.
TexturePatch make_texture_patch(const SmoothPicture& picture, const Eigen::Vector2d& marker_px,
                                double radius_px, int step_px, const OnCloth& on_cloth);

/// Returns the standard deviation per coordinate with which white noise lets an affine patch be
/// placed; infinite where the texture leaves a direction free, as stripes do.
double attainable_sigma_px(const TexturePatch& patch, const SmoothPicture& picture,
                           double noise_levels);

}  // namespace clothfit
