#pragma once

#include <ceres/jet.h>

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "data/camera_parameters.h"

namespace clothfit {

/// A number with its derivatives. The first three are by the place of a marker (m, world), the
/// others by the parameters of the measurement, of which a fit can have so many.
inline constexpr int kMeasuredPlace = 3;
inline constexpr int kMeasurementParameters = 9;
using MeasuredNumber = ceres::Jet<double, kMeasuredPlace + kMeasurementParameters>;
using MeasuredPoint = Eigen::Matrix<MeasuredNumber, 3, 1>;
using MeasuredPair = Eigen::Matrix<MeasuredNumber, 2, 1>;  ///< a pixel, or a way over the cloth

/// One look at one marker.
struct Sighting {
  double time_s = 0;            ///< time of its frame, as the recording has it
  double first_time_s = 0;      ///< time of the recording's first frame
  double frame_interval_s = 0;  ///< median of the recording
  Eigen::Vector3d sheet_middle_m = Eigen::Vector3d::Zero();  ///< middle of the placed sheet, world
  /// The marker's s and t, from the mean of all markers' on.
  Eigen::Vector2d from_pattern_middle_m = Eigen::Vector2d::Zero();
  const CameraParameters* camera = nullptr;  ///< the camera that looks; none for 3D tracks
  double observed_row_px = 0;                ///< row of the picture; where there is a camera

  double since_first_s() const { return time_s - first_time_s; }
};

/// One way in which the measured differs from the motion of the cloth. Each effect does one of a
/// few things to a prediction, or some, and leaves the rest as it is. At the neutral values of its
/// parameters it changes nothing. The hooks stand in the order in which they are called.
class MeasurementEffect {
 public:
  using Parameters = std::span<const MeasuredNumber>;  ///< in the description's order and units

  virtual ~MeasurementEffect() = default;

  /// Says whether `shift_time`, `mix_neighbours` and `shift_place` do anything. They look at the
  /// cloth between frames and beside its markers, which costs.
  virtual bool shifts_time() const { return false; }
  virtual bool mixes_neighbours() const { return false; }
  virtual bool shifts_place() const { return false; }

  /// Says whether the effect is one of a camera and says nothing of 3D tracks.
  virtual bool needs_camera() const { return false; }

  /// Shifts the time `seen_s` (s, the model's) at which the marker was really looked at.
  virtual void shift_time(const Sighting& /*sighting*/, Parameters /*parameters*/,
                          MeasuredNumber& /*seen_s*/) const {}

  /// Adds to the weight w of the looks one frame interval d before and after. They are mixed in:
  /// x(t) + w (x(t + d) - 2 x(t) + x(t - d)).
  virtual void mix_neighbours(const Sighting& /*sighting*/, Parameters /*parameters*/,
                              MeasuredNumber& /*weight*/) const {}

  /// Adds to the shift `shift_m` (s and t, m) over the cloth from a marker's stated to its true
  /// place. It is followed by the surface's derivatives there, to second order. It depends on the
  /// marker and the time alone, on no camera and no place of the cloth in the world.
  virtual void shift_place(const Sighting& /*sighting*/, Parameters /*parameters*/,
                           MeasuredPair& /*shift_m*/) const {}

  /// Moves the place (world, m) at which the marker appears to be.
  virtual void move(const Sighting& /*sighting*/, Parameters /*parameters*/,
                    MeasuredPoint& /*position_m*/) const {}

  /// Moves the pixel at which the camera shows the marker. Called for cameras only.
  virtual void move_pixel(const Sighting& /*sighting*/, Parameters /*parameters*/,
                          MeasuredPair& /*pixel*/) const {}
};

}  // namespace clothfit
