#pragma once

#include <optional>

#include "model/integrate/simulate.h"

namespace clothfit {

/// The place where a run first went wrong.
struct Divergence {
  int step = 0;   ///< from 1, over the whole run; 0: the start itself is not finite
  int frame = 0;  ///< the step leads to it
  double time_s = 0;
  double time_step_s = 0;  ///< of that step

  /// The spring that stretched beyond reason.
  struct StretchedSpring {
    int type = 0;
    Spring spring;
    double length_m = 0;
    double natural_length_m = 0;
  };
  /// Nothing where no spring did. The cloth as a whole then left the scene, driven by an effect or
  /// a held point, or the start is not finite.
  std::optional<StretchedSpring> spring;
  int vertex = -1;  ///< without a spring: the vertex that was furthest away
};

/// A spring this many times as long as at rest and as at the start is beyond all reason. The fabric
/// would have torn, and a linear spring says nothing there.
inline constexpr double kLengthBeyondReason = 5;

/// Runs the schedule and finds the first step after which a spring is longer than
/// kLengthBeyondReason allows. Of those springs it gives the one that is longest for its natural
/// length. If a vertex leaves the scene or ceases to be finite within one step, it gives the spring
/// that was longest for its natural length before it. Nothing for a run that stays within reason.
///
/// Costs two runs, the second only up to that step and with every step of the last frame interval
/// kept; a few more where these are more than fit into some hundred megabytes. Nothing also where
/// `stop` ends it.
std::optional<Divergence> find_divergence(const Cloth& cloth, const ParameterSet& parameters,
                                          const Schedule& schedule, const StopCheck& stop = {});

/// Returns "structural", "shear" or "flexion".
const char* spring_family(int type);

}  // namespace clothfit
