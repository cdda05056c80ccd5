#pragma once

#include <functional>
#include <span>
#include <vector>

#include "model/cloth.h"

namespace clothfit {

/// When positions are wanted and how finely time is cut between.
struct Schedule {
  std::vector<double> frame_time_s;  ///< rising; the first is the start
  double time_step_s = 0;            ///< at most this; each frame interval is cut into equal steps

  /// Equal steps in the interval that ends at frame `frame` >= 1.
  int substeps(int frame) const;
};

enum class StopReason { reached_end, diverged, cancelled };

struct SimulateResult {
  StopReason reason = StopReason::reached_end;
  int diverged_frame = -1;  ///< first frame that is not finite or left the scene
  /// How well the strain limit was kept; 0 without one.
  double largest_excess = 0;  ///< elongation beyond the critical one, of any spring at any frame
  int unmet_steps = 0;        ///< of `consistent`: steps after which a spring was intolerably long
  /// Positions at every frame, 3 x vertices (world, m); NaN from where it diverged or was
  /// cancelled.
  std::vector<Eigen::Matrix3Xd> position_m;
  bool usable() const { return reason == StopReason::reached_end; }
};

/// Whether a run has diverged: a vertex is not finite or further than a hundred cloth diagonals
/// from where it started. All 3 x vertices.
bool left_the_scene(const Eigen::Matrix3Xd& now, const Eigen::Matrix3Xd& start, const Mesh& mesh);

/// `exact`: strict double, the same bits on every processor; what results come from. `fast`: float
/// (a few left-over sets in double), for screening; after a second of a swinging cloth within
/// 3 mm of `exact` without a strain limit, within 3 cm with one (docs/theory/model.md has what was
/// seen), and not the same bits on every processor.
enum class Precision { exact, fast };

/// Called after each frame of each group of lanes, by several threads at once where there are
/// several groups. False asks to stop: runs that are not at their end are then cancelled.
using FrameCallback = std::function<bool(int frame)>;

/// Simulates every parameter set, several side by side in lanes, groups of lanes in parallel. With
/// `exact` a result does not depend on the number of sets, their order or the number of threads.
std::vector<SimulateResult> simulate(const Cloth& cloth, std::span<const ParameterSet> parameters,
                                     const Schedule& schedule,
                                     Precision precision = Precision::exact,
                                     const FrameCallback& after_frame = {});

/// A cloth that has calmed down.
struct RelaxedCloth {
  Eigen::Matrix3Xd position_m;                 ///< 3 x vertices
  std::vector<Eigen::VectorXd> effect_memory;  ///< as ParameterSet::start_effect_memory
};

/// The start positions relaxed under gravity with heavy viscous damping, from rest and without
/// memory, held points where `motion` has them at `time_s`, and what the effects have come to
/// remember on the way. The damping, critical for a pendulum of the cloth's height, and the fixed
/// number of steps follow from `pendulum_gravity_m_per_s2`, a length that all sets share (at least
/// 0.001), so that a shape depends on its own set alone, and smoothly. Of the pendulum's distance
/// to equilibrium less than a percent is left, of slower motions (folds that open, a cloth that
/// turns about a single support) more. Supports are where they are without effects that shift them,
/// which remember nothing.
std::vector<RelaxedCloth> relax(const Cloth& cloth, std::span<const ParameterSet> parameters,
                                double pendulum_gravity_m_per_s2, double time_s,
                                double time_step_s);

/// Lets every set start from rest: relaxed from where it would have started, as relax() does it,
/// with what its effects have come to remember, and without velocity. The exact minimum of the
/// energy is not looked for: docs/theory/equilibrium.md says why.
void start_at_rest(const Cloth& cloth, std::span<ParameterSet> parameters,
                   double pendulum_gravity_m_per_s2, double time_s, double time_step_s);

}  // namespace clothfit
