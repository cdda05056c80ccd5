#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "apps/study/scene/synthetic_recording.h"

namespace clothfit {

/// Options of a scene's pictures. The cloth wears a square of tags of tag36h11, whose corners are
/// its markers. The lens is the scene's, with 3 % of distortion.
struct PictureOptions {
  int tags = 8;  ///< a side, 2 to 24
  int width_px = 1280;
  int height_px = 960;
  double exposure_s = 2e-3;  ///< around the time of the frame; 0 to the time between frames
  /// Odd number of instants in an exposure over which light is averaged; time grows in proportion.
  int instants = 3;
  int samples = 2;          ///< lines of sight across a pixel; time grows with the square
  double blur_px = 0.5;     ///< standard deviation of the lens's blur, 0 to 5
  double noise_levels = 2;  ///< standard deviation of the sensor's grey levels, >= 0
  double shot_levels = 0;   ///< variance of shot noise per level of light, >= 0

  /// Throws InputError, naming options of `clothfit recover`, also for parts of the scene that
  /// cannot be rendered: observations that are lost, a hand, outliers.
  void validate(const SyntheticScene& scene) const;
};

/// A tracker's places of markers, compared with the true ones.
struct TrackerErrors {
  int pictures = 0;
  int shown = 0;                        ///< markers that pictures show: the printed side, in view
  int accepted = 0;                     ///< places that the tracker accepts
  std::map<std::string, int> rejected;  ///< places that the tracker rejects, by reason
  // These are sums over both coordinates of all accepted places.
  double squared_error_px2 = 0;
  double stated_variance_px2 = 0;
  double chi_squared = 0;
  int beyond_5_sigma = 0;  ///< accepted places that are so far off in either coordinate

  int rejections() const;
  double rms_error_px() const;  ///< for a coordinate; NaN without accepted places
  double rms_sigma_px() const;
  /// Returns chi-squared per degree of freedom: 1 where the stated sigma is right, 4 where errors
  /// are twice as large.
  double chi_squared_per_number() const;
  void add(const TrackerErrors& other);
};

struct RenderedRecording {
  SyntheticRecording recording;  ///< has only 2D tracks
  TrackerErrors tracker;         ///< over all cameras
};

/// Makes the recording of `seed` as cameras see it. The cloth moves as in the synthetic recording
/// of the same seed, and its surface is ray-cast for every frame and camera. The tracker of
/// `clothfit track` finds the markers with its own sigma and rejections. True places are those of
/// the simulated surface at the middle of the exposure. The same arguments give the same bits for
/// any number of threads; pictures are worked on in parallel.
///
/// Throws InputError where the scene's cloth cannot be simulated and where no tag is found.
RenderedRecording make_rendered_recording(const SyntheticScene& scene,
                                          const PictureOptions& options, std::uint64_t seed);

/// Renders the picture that a camera (from 0) of that recording takes at a frame, as a PNG file's
/// bytes.
std::string rendered_picture_png(const SyntheticScene& scene, const PictureOptions& options,
                                 std::uint64_t seed, int camera, int frame);

}  // namespace clothfit
