#pragma once

#include <functional>
#include <span>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/integrate/stop_check.h"

namespace clothfit {

/// The times of wanted positions, and how finely time is cut between.
struct Schedule {
  std::vector<double> frame_time_s;  ///< rising; the first is the start
  double time_step_s = 0;            ///< at most this; each frame interval is cut into equal steps
  bool velocities = false;           ///< hand on velocities beside positions
  /// Derivatives of forces that change smoothly are computed once in that time, and kept between
  /// (TangentStepper); 0: in every step.
  double derivatives_kept_s = 0;
  /// Derivatives along more than 8 directions are had in single precision, at half the cost: they
  /// are then right to about five digits.
  bool fast_derivatives = false;

  /// Returns the equal steps in the interval that ends at frame `frame` >= 1.
  int substeps(int frame) const;
  /// Returns the steps of all intervals, as a number that cannot overflow.
  double all_steps() const;
};

enum class StopReason { not_run, reached_end, diverged, cancelled };

struct SimulateResult {
  StopReason reason = StopReason::not_run;
  int diverged_frame = -1;  ///< first frame that is not finite or left the scene
  /// Measures of how well the strain limit was kept; 0 without one.
  double largest_excess = 0;  ///< elongation beyond the critical one, of any spring at any frame
  int unmet_steps = 0;        ///< of `consistent`: steps after which a spring was intolerably long
  /// Positions at every frame, 3 x vertices (world, m); NaN from where it diverged or was
  /// cancelled.
  std::vector<Eigen::Matrix3Xd> position_m;
  std::vector<Eigen::Matrix3Xd> velocity_m_per_s;  ///< the same, where the schedule asks for it
  bool usable() const { return reason == StopReason::reached_end; }
};

/// Says whether a run has diverged: a vertex is not finite or a hundred cloth diagonals from its
/// start. All 3 x vertices.
bool left_the_scene(const Eigen::Matrix3Xd& now, const Eigen::Matrix3Xd& start, const Mesh& mesh);

/// `exact`: strict double, the same bits on every processor, for all results. `fast`: float (a few
/// left-over sets in double), for screening, and not the same bits on every processor. After a
/// second of a swinging cloth it is within 3 mm of `exact` without a strain limit, within 3 cm with
/// one (docs/theory/model.md has the measurements).
enum class Precision { exact, fast };

/// Called after each frame of each group of lanes, by several threads at once where there are
/// several groups. False asks to stop: runs that are not at their end are then cancelled.
using FrameCallback = std::function<bool(int frame)>;

/// Simulates every parameter set, several side by side in lanes, groups of lanes in parallel. With
/// `exact` a result does not depend on the number of sets, their order or the number of threads.
/// `stop` is asked between steps: a run that it ends is cancelled.
std::vector<SimulateResult> simulate(const Cloth& cloth, std::span<const ParameterSet> parameters,
                                     const Schedule& schedule,
                                     Precision precision = Precision::exact,
                                     const FrameCallback& after_frame = {},
                                     const StopCheck& stop = {});

}  // namespace clothfit
