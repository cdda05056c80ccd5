#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "apps/study/synthetic_scene.h"
#include "fit/measurement_effects/measurement_effect.h"
#include "model/surface.h"

namespace clothfit {

/// What an observer of a scene sees of its markers, by the hidden effects of the measurement. Their
/// laws are the program's; the cloth they look at is not a fit's: between the frames it is the
/// truth's own motion, beside the markers its own surface.
class TrueSight {
 public:
  /// Of the scene that `seed` releases. Throws InputError where that cannot be simulated.
  TrueSight(const SyntheticScene& scene, const Recording& recording, std::uint64_t seed);

  /// Where 3D tracks have the markers in a frame (3 x markers, world, m).
  Eigen::Matrix3Xd places(int frame) const;

  /// Where a camera has them (px); nothing behind it.
  std::vector<std::optional<Eigen::Vector2d>> pixels(int frame,
                                                     const CameraParameters& camera) const;

 private:
  struct Term {
    std::shared_ptr<const MeasurementEffect> effect;
    std::vector<MeasuredNumber> parameters;
  };
  /// The markers' places at instants of the fine motion, by its index.
  using Instants = std::map<int, Eigen::Matrix3Xd>;

  Sighting sighting(int frame, int marker, const CameraParameters* camera) const;
  Surface surface_seen(int frame, const CameraParameters* camera) const;
  Eigen::Vector3d at(double time_s, int marker, const Surface& surface, Instants& known) const;
  Eigen::Vector3d look(const Sighting& sighting, int marker, const Surface& surface,
                       Instants& known) const;

  const SyntheticScene scene_;
  std::vector<Term> terms_;
  bool shifts_place_ = false;
  Eigen::Matrix2Xd marker_m_;               ///< s, t, 2 x markers
  Surface surface_;                         ///< there
  int between_ = 1;                         ///< instants per frame interval
  int before_ = 0;                          ///< instants before the first frame
  std::vector<Eigen::Matrix3Xd> motion_m_;  ///< vertices at every instant
  Eigen::Vector3d sheet_middle_m_;
};

}  // namespace clothfit
