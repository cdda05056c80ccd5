#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/integrate/stop_check.h"
#include "model/integrate/tangent_step.h"

namespace clothfit {

/// A cloth that has calmed down.
struct RelaxedCloth {
  Eigen::Matrix3Xd position_m;                 ///< 3 x vertices
  std::vector<Eigen::VectorXd> effect_memory;  ///< as ParameterSet::start_effect_memory
};

/// Returns the largest step at which relax() is stable. Springs are damped there for its own step
/// alone, so it is often ten times that of a run, whose dampers bound it: dampers do no work at
/// rest.
double stable_rest_step_s(const Cloth& cloth, const ParameterSet& parameters);

/// Steps of a run that begins at rest: its own, and that of the relaxation before it.
struct TimeSteps {
  double run_s = 0;
  double rest_s = 0;

  /// Sets the same step for both.
  TimeSteps(double both_s) : run_s(both_s), rest_s(both_s) {}
  TimeSteps(double of_run_s, double of_rest_s) : run_s(of_run_s), rest_s(of_rest_s) {}
  TimeSteps times(double factor) const { return {factor * run_s, factor * rest_s}; }
};

/// Returns the largest steps at which both are stable.
TimeSteps stable_time_steps(const Cloth& cloth, const ParameterSet& parameters);

/// Returns a run's step, and a relaxation's that is the same share of the largest stable one.
TimeSteps time_steps_of_run(const Cloth& cloth, const ParameterSet& parameters, double run_s);

/// Relaxes the start positions under gravity with heavy viscous damping. Every set starts from rest
/// and without memory, held points where `motion` has them at `time_s`; the result has the memory
/// that effects gain on the way. The damping, critical for a pendulum of the cloth's height, and
/// the fixed number of steps follow from `pendulum_gravity_m_per_s2`, a length that all sets share
/// (at least 0.001). A shape therefore depends on its own set alone, and smoothly. Less than a
/// percent of the pendulum's distance to equilibrium remains; more of slower motions (folds that
/// open, a cloth that turns about a single support); a twentieth of the supports' shifts by
/// effects. Effects that shift supports in time, which remember nothing, are left out. A cloth that
/// `stop` ends, asked between steps, has no finite positions.
std::vector<RelaxedCloth> relax(const Cloth& cloth, std::span<const ParameterSet> parameters,
                                double pendulum_gravity_m_per_s2, double time_s, double time_step_s,
                                const StopCheck& stop = {});

/// Returns how many steps relax() takes, as a number that cannot overflow.
double rest_steps(const Cloth& cloth, double pendulum_gravity_m_per_s2, double time_step_s);

/// Lets every set start from rest. It is relaxed from its former start, as relax() does it, with
/// the memory that its effects gain, and without velocity. The exact minimum of the energy is not
/// looked for: docs/theory/equilibrium.md says why. A run from a set that `stop` ended diverges at
/// its start.
void start_at_rest(const Cloth& cloth, std::span<ParameterSet> parameters,
                   double pendulum_gravity_m_per_s2, double time_s, double time_step_s,
                   const StopCheck& stop = {});

/// Lets one set start from rest, with the derivatives along every direction, exact for the discrete
/// scheme where it is smooth. Directions begin as derivatives of the set that goes in, and end as
/// those of the one that comes out; `set` gets the bits that start_at_rest() gives it.
void start_at_rest_with_tangents(const Cloth& cloth, ParameterSet& set,
                                 std::span<Direction> directions, double pendulum_gravity_m_per_s2,
                                 double time_s, double time_step_s, const StopCheck& stop = {});

}  // namespace clothfit
