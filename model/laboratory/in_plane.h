#pragma once

#include <functional>
#include <vector>

#include "model/fabric/measured_fabric.h"
#include "model/laboratory/thread_direction.h"
#include "model/rest/minimise.h"

namespace clothfit {

/// A curve of force against deformation, without hysteresis: the model's springs have none.
struct LoadCurve {
  MinimiseReason reason = MinimiseReason::iterations_used_up;
  std::vector<double> deformation;    ///< strain, or shear angle in radians; rising from 0
  std::vector<double> force_n_per_m;  ///< per width, of each
  double stiffness_n_per_m = 0;       ///< at the first deformation
  /// Of a strip: contraction of its middle over its elongation, at the first deformation.
  double lateral_contraction = 0;
  bool usable() const { return reason == MinimiseReason::converged; }
};

/// The strip tension test [iso13934-1]: a strip between two clamps that hold its ends' width.
struct StripTensionOptions {
  double width_m = 0.05, length_m = 0.2;
  double spacing_m = 0.005;
  double largest_strain = 0.05;
  int points = 10;              ///< of the curve, evenly spaced
  std::function<bool()> go_on;  ///< called between steps; `false` cancels; may be empty

  void validate() const;  ///< throws InputError
};
LoadCurve stretch_strip(const MeasuredFabric& fabric, ThreadDirection direction,
                        const StripTensionOptions& options = {});

/// The picture frame test: a square in four bars, hinged at the corners, that becomes a rhombus.
/// The force per width is that along a bar, per length of the bar: shear_n_per_m per radian while
/// the angle is small.
struct PictureFrameOptions {
  double side_m = 0.2;
  double spacing_m = 0.01;
  double largest_angle_deg = 8;  ///< as KES-FB shears
  int points = 8;
  std::function<bool()> go_on;

  void validate() const;  ///< throws InputError
};
LoadCurve shear_frame(const MeasuredFabric& fabric, const PictureFrameOptions& options = {});

}  // namespace clothfit
