#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/integrate/tangent_step.h"

namespace clothfit {

/// A cloth that has calmed down.
struct RelaxedCloth {
  Eigen::Matrix3Xd position_m;                 ///< 3 x vertices
  std::vector<Eigen::VectorXd> effect_memory;  ///< as ParameterSet::start_effect_memory
};

/// The largest step at which relax() is stable. Springs are damped there for its own step alone, so
/// that it is often ten times that of a run, whose dampers bound it: dampers do no work at rest.
double stable_rest_step_s(const Cloth& cloth, const ParameterSet& parameters);

/// Steps of a run that begins at rest: its own, and that of the relaxation before it.
struct TimeSteps {
  double run_s = 0;
  double rest_s = 0;

  /// The same for both.
  TimeSteps(double both_s) : run_s(both_s), rest_s(both_s) {}
  TimeSteps(double of_run_s, double of_rest_s) : run_s(of_run_s), rest_s(of_rest_s) {}
  TimeSteps times(double factor) const { return {factor * run_s, factor * rest_s}; }
};

/// The largest at which both are stable.
TimeSteps stable_time_steps(const Cloth& cloth, const ParameterSet& parameters);

/// A run's step, and a relaxation's that is the same share of the largest stable one.
TimeSteps time_steps_of_run(const Cloth& cloth, const ParameterSet& parameters, double run_s);

/// The start positions relaxed under gravity with heavy viscous damping, from rest and without
/// memory, held points where `motion` has them at `time_s`, and what the effects have come to
/// remember on the way. The damping, critical for a pendulum of the cloth's height, and the fixed
/// number of steps follow from `pendulum_gravity_m_per_s2`, a length that all sets share (at least
/// 0.001), so that a shape depends on its own set alone, and smoothly. Of the pendulum's distance
/// to equilibrium less than a percent is left, of slower motions (folds that open, a cloth that
/// turns about a single support) more, and of what effects shift supports by a twentieth. Supports
/// are where they are without effects that shift them in time, which remember nothing.
std::vector<RelaxedCloth> relax(const Cloth& cloth, std::span<const ParameterSet> parameters,
                                double pendulum_gravity_m_per_s2, double time_s,
                                double time_step_s);

/// Lets every set start from rest: relaxed from where it would have started, as relax() does it,
/// with what its effects have come to remember, and without velocity. The exact minimum of the
/// energy is not looked for: docs/theory/equilibrium.md says why.
void start_at_rest(const Cloth& cloth, std::span<ParameterSet> parameters,
                   double pendulum_gravity_m_per_s2, double time_s, double time_step_s);

/// The same for one set, with the derivatives along every direction: exact for the discrete scheme
/// where it is smooth. Directions begin as derivatives of the set that goes in, and end as those of
/// the one that comes out; `set` gets the bits that start_at_rest() gives it.
void start_at_rest_with_tangents(const Cloth& cloth, ParameterSet& set,
                                 std::span<Direction> directions, double pendulum_gravity_m_per_s2,
                                 double time_s, double time_step_s);

}  // namespace clothfit
