#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "apps/study/scene/synthetic_scene.h"
#include "fit/measurement_effects/measurement_effect.h"
#include "model/topology/surface.h"

namespace clothfit {

/// The hidden effects of the measurement, and the places of the markers under them.
struct HiddenMeasurement {
  struct Hypothesis {
    std::shared_ptr<const MeasurementEffect> effect;
    std::vector<MeasuredNumber> parameters;
  };

  HiddenMeasurement(const SyntheticScene& scene, const Recording& recording);

  Sighting sighting(int frame, int marker, const CameraParameters* camera,
                    const Eigen::Vector3d& sheet_middle_m) const;

  /// Returns where the markers really are in a frame: s and t (m), 2 x markers. Only on the cloth
  /// does the truth have a surface that shows them.
  Eigen::Matrix2Xd places_m(int frame) const;
  bool markers_stay_on_cloth() const;

  double size_m = 0, frame_rate_hz = 0;
  int frames = 0;
  std::vector<Hypothesis> terms;
  bool between_frames = false, shifts_place = false;  ///< says whether one looks there
  Eigen::Matrix2Xd stated_m;                          ///< 2 x markers
};

/// An observer's view of a scene's markers, by the hidden effects of the measurement. The effects'
/// laws are the program's. The cloth is not a fit's: between the frames it is the truth's own
/// motion, beside the markers its own surface.
class TrueSight {
 public:
  /// Takes the scene that `seed` releases. Throws InputError where that cannot be simulated, and
  /// where a marker would leave the cloth.
  TrueSight(const SyntheticScene& scene, const Recording& recording, std::uint64_t seed);

  /// Returns where 3D tracks have the markers in a frame (3 x markers, world, m).
  Eigen::Matrix3Xd places(int frame) const;

  /// Returns where a camera has them (px); nothing behind it.
  std::vector<std::optional<Eigen::Vector2d>> pixels(int frame,
                                                     const CameraParameters& camera) const;

 private:
  /// The markers' places at instants of the fine motion, by its index.
  using Instants = std::map<int, Eigen::Matrix3Xd>;

  Surface surface_seen(int frame) const;
  Eigen::Vector3d at(double time_s, int marker, const Surface& surface, Instants& known) const;
  Eigen::Vector3d look(const Sighting& sighting, int marker, const Surface& surface,
                       Instants& known) const;

  const SyntheticScene scene_;
  HiddenMeasurement hidden_;
  Surface surface_;                         ///< at the stated places
  int between_ = 1;                         ///< instants per frame interval
  int before_ = 0;                          ///< instants before the first frame
  std::vector<Eigen::Matrix3Xd> motion_m_;  ///< vertices at every instant
  Eigen::Vector3d sheet_middle_m_;
};

}  // namespace clothfit
