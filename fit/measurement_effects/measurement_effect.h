#pragma once

#include <ceres/jet.h>

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

namespace clothfit {

/// A number with its derivatives by the place of a marker (m, world; the first three) and by the
/// parameters of the measurement, of which a fit can have so many.
inline constexpr int kMeasuredPlace = 3;
inline constexpr int kMeasurementParameters = 9;
using MeasuredNumber = ceres::Jet<double, kMeasuredPlace + kMeasurementParameters>;
using MeasuredPoint = Eigen::Matrix<MeasuredNumber, 3, 1>;

/// One look at one marker.
struct Sighting {
  double time_s = 0;  ///< of its frame, as the recording has it
  Eigen::Vector3d sheet_middle_m = Eigen::Vector3d::Zero();  ///< of the placed sheet, world
};

/// One way in which what is measured differs from what the cloth does. Each does one of two things
/// to a prediction, or both; what it does not do, it leaves as it is. At the neutral values of its
/// parameters it changes nothing.
class MeasurementEffect {
 public:
  using Parameters = std::span<const MeasuredNumber>;  ///< in the description's order and units

  virtual ~MeasurementEffect() = default;

  /// Whether `shift_time` does anything.
  virtual bool shifts_time() const { return false; }

  /// Shifts the time `seen_s` (s, the model's) at which the marker was really looked at.
  virtual void shift_time(const Sighting& /*sighting*/, Parameters /*parameters*/,
                          MeasuredNumber& /*seen_s*/) const {}

  /// Moves the place (world, m) at which the marker appears to be.
  virtual void move(const Sighting& /*sighting*/, Parameters /*parameters*/,
                    MeasuredPoint& /*position_m*/) const {}
};

}  // namespace clothfit
