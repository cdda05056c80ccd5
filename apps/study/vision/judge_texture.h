#pragma once

#include <filesystem>
#include <vector>

#include "apps/study/vision/tag_score.h"
#include "data/recording.h"
#include "vision/render/cloth_texture.h"
#include "vision/render/true_markers.h"

namespace clothfit {

/// How a recording's motion is drawn with another cloth.
struct TexturedFootageOptions {
  ClothTextureOptions texture;
  int frames = 0;         ///< from frame 0 on; 0: all
  double shutter = 0.25;  ///< 0 to 1; share of the time between frames that it is open
  int instants = 3;       ///< odd, >= 1; over which an exposure averages
  double noise_levels = 0.7, shot_levels = 0.009;  ///< as RenderOptions has them
};

/// Pictures of a textured sheet that moves as a recording's truth says, and where its markers are.
struct TexturedFootage {
  Recording recording;  ///< of kind `texture`, with one camera whose file is the true one
  std::vector<cv::Mat> pictures;
  std::vector<std::vector<TrueMarker>> truth;  ///< by frame and marker
};

/// Renders the first camera's view of a recording of tags, whose tags at the corners of the sheet
/// are printed as anchors on a texture. The other markers stay, as points of the texture. The
/// surface is the cubic spline through truth_tracks3d.csv.gz; the camera is truth_camera_NAME.yaml,
/// or the camera's file where that one is known. Throws InputError where these do not fit.
TexturedFootage render_textured(const std::filesystem::path& folder,
                                const TexturedFootageOptions& options);

/// Tracks the pictures and judges every row of frame 1 and later by the truth. Markers count as
/// visible where the camera sees them in the picture.
TagScore score_texture(const TexturedFootage& footage);

/// Returns the matrix that takes values at rising `nodes`, four or more, to those of the cubic
/// spline through them at `places`. At the ends two cells share a cubic, which goes on beyond.
Eigen::MatrixXd cubic_spline_weights(const std::vector<double>& nodes,
                                     const std::vector<double>& places);

}  // namespace clothfit
