#pragma once

#include <memory>

#include "fit/diagnosis/hypothesis_derivatives.h"
#include "model/cloth/effect.h"

namespace clothfit {

/// Forces per mass (m/s2) that follow no law, by which a model may absorb what it lacks
/// [kairanda2022]. At the place (s, t) of a cloth of width w and height h, in each of the world's
/// directions, a force is
///
///   cos(pi i s / w) cos(pi j t / h),   i + j < kWaves,
///
/// times a number that is constant over a stretch of time. A recording's fitted frames are cut into
/// stretches of equal length. A force that acts on the way to a frame is of that frame's stretch.
/// The force of the first frame began to act before it, and that of the last one goes on.
struct FreeForces {
  static constexpr int kWaves = 3;
  static constexpr int kInStretch = 3 * kWaves * (kWaves + 1) / 2;  ///< numbers in a stretch

  int stretches = 0;
  /// Derivatives of each recording's whitened residuals by the numbers (per m/s2), stretch by
  /// stretch: residuals x (stretches x kInStretch). None where they could not be computed.
  Columns columns;

  bool usable() const { return !columns.empty(); }
  /// Returns the stretch of frame `frame` of `frames`.
  static int stretch_of(int frame, int frames, int stretches) { return frame * stretches / frames; }
};

/// Makes an effect that pushes the cloth like one of these products, from `from_s` until before
/// `until_s`. Its three parameters are the numbers (m/s2) of the world's directions, neutral at 0.
/// It is in no table of effects. It only ever emerges (EmergingEffect) or is simulated, and has no
/// derivatives of its own.
std::shared_ptr<const Effect> make_free_force(const Cloth& cloth, int waves_along_s,
                                              int waves_along_t, double from_s, double until_s);

/// Computes the derivatives where the model stands, at no force. Their mesh may be coarser than the
/// model's own. The beginning and end of a stretch are known to kEmergingInterval_s.
FreeForces free_forces(const DiagnosisSetup& mesh, const FittedModel& model, int stretches);

}  // namespace clothfit
