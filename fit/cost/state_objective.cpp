#include "fit/cost/state_objective.h"

#include <cassert>
#include <cmath>
#include <numeric>

#include "fit/problem/parameterised_model.h"
#include "model/integrate/simulate.h"
#include "model/integrate/tangents.h"

namespace clothfit {
namespace {

constexpr int kStateNumbers = 6;  ///< for a vertex: position, velocity

Schedule schedule_of(const RecordedStates& states, int transition, double time_step_s) {
  const auto n = static_cast<size_t>(transition);
  return {.frame_time_s = {states.time_s[n - 1], states.time_s[n]},
          .time_step_s = time_step_s,
          .velocities = true};
}

/// Column v holds position and dt times velocity of vertex v, in units.
Eigen::Matrix<double, kStateNumbers, Eigen::Dynamic> stacked(const Eigen::Matrix3Xd& position_m,
                                                             const Eigen::Matrix3Xd& velocity,
                                                             double dt_s, double unit_m) {
  Eigen::Matrix<double, kStateNumbers, Eigen::Dynamic> both(kStateNumbers, position_m.cols());
  both << position_m / unit_m, dt_s / unit_m * velocity;
  return both;
}

}  // namespace

RecordedStates simulate_states(const Cloth& cloth, const ParameterSet& parameters,
                               double time_step_s, double duration_s) {
  RecordedStates states;
  const long steps = std::lround(duration_s / time_step_s);
  for (long n = 0; n <= steps; ++n) states.time_s.push_back(static_cast<double>(n) * time_step_s);
  // Each interval is one step: rounding of the times must not cut it in two.
  const Schedule schedule{
      .frame_time_s = states.time_s, .time_step_s = 1.5 * time_step_s, .velocities = true};
  SimulateResult run = std::move(simulate(cloth, {&parameters, 1}, schedule).front());
  states.position_m = std::move(run.position_m);
  states.velocity_m_per_s = std::move(run.velocity_m_per_s);
  return states;
}

std::vector<int> full_cost_transitions(const RecordedStates& states) {
  std::vector<int> all(static_cast<size_t>(states.last()));
  std::iota(all.begin(), all.end(), 1);
  return all;
}

std::vector<int> small_cost_transitions(const RecordedStates& states) {
  return {states.last()};
}

StateObjective::StateObjective(const FitProblem& problem, const RecordedStates& states,
                               std::vector<int> transitions, double time_step_s, double unit_m)
    : Objective(problem, time_step_s),
      states_(states),
      transitions_(std::move(transitions)),
      unit_m_(unit_m) {
  for (const int transition : transitions_) {
    assert(transition >= 1 && transition <= states.last());
    for (int v = 0; v < problem.cloth.mesh.vertex_count(); ++v)
      add_block({.set = -1, .marker = v, .frame = transition, .dimension = kStateNumbers});
  }
}

std::string StateObjective::name() const {
  return "over " + std::to_string(transitions_.size()) +
         (transitions_.size() == 1 ? " transition" : " transitions");
}

double StateObjective::spring_steps_per_run() const {
  double steps = 0;
  for (const int transition : transitions_)
    steps += schedule_of(states_, transition, time_step_s()).substeps(1);
  return steps * static_cast<double>(problem().cloth.spring_count());
}

ParameterSet StateObjective::between_states(const Eigen::VectorXd& values) const {
  ParameterSet set = parameter_set(problem(), values);
  // The recorded states have held points at their driven places.
  set.held_shift.clear();
  return set;
}

std::vector<Eigen::VectorXd> StateObjective::residuals(
    const std::vector<Eigen::VectorXd>& values) const {
  std::vector<ParameterSet> sets;
  for (const Eigen::VectorXd& point : values) sets.push_back(between_states(point));
  std::vector<Eigen::VectorXd> results(values.size(), Eigen::VectorXd(residual_count()));
  Eigen::Index offset = 0;
  for (const int transition : transitions_) {
    const auto n = static_cast<size_t>(transition);
    for (ParameterSet& set : sets) {
      set.start_position_m = states_.position_m[n - 1];
      set.start_velocity_m_per_s = states_.velocity_m_per_s[n - 1];
    }
    const double dt_s = states_.time_s[n] - states_.time_s[n - 1];
    const auto recorded =
        stacked(states_.position_m[n], states_.velocity_m_per_s[n], dt_s, unit_m_);
    const std::vector<SimulateResult> runs =
        simulate(problem().cloth, sets, schedule_of(states_, transition, time_step_s()),
                 Precision::exact, {}, problem().stop);
    for (size_t k = 0; k < runs.size(); ++k) {
      if (results[k].size() == 0) continue;
      const auto predicted =
          stacked(runs[k].position_m.back(), runs[k].velocity_m_per_s.back(), dt_s, unit_m_);
      results[k].segment(offset, recorded.size()) = (predicted - recorded).reshaped();
      if (!runs[k].usable()) results[k].resize(0);
    }
    offset += recorded.size();
  }
  for (Eigen::VectorXd& result : results)
    if (!result.allFinite()) result.resize(0);
  return results;
}

Linearisation StateObjective::linearise(const Eigen::VectorXd& values) const {
  Linearisation result;
  ParameterSet set = between_states(values);
  std::vector<Direction> along = directions(problem(), values);
  for (Direction& direction : along) {
    direction.start_position_m.resize(3, 0);
    direction.start_velocity_m_per_s.resize(3, 0);
    direction.held_motion.clear();
  }
  result.runs = 1 + problem().space.size();
  result.residual.resize(residual_count());
  result.residual_by_coordinate.resize(residual_count(), problem().space.size());
  Eigen::Index offset = 0;
  for (const int transition : transitions_) {
    const auto n = static_cast<size_t>(transition);
    set.start_position_m = states_.position_m[n - 1];
    set.start_velocity_m_per_s = states_.velocity_m_per_s[n - 1];
    const double dt_s = states_.time_s[n] - states_.time_s[n - 1];
    const TangentResult run =
        simulate_with_tangents(problem().cloth, set, along,
                               schedule_of(states_, transition, time_step_s()), problem().stop);
    if (!run.run.usable()) return result;
    const auto recorded =
        stacked(states_.position_m[n], states_.velocity_m_per_s[n], dt_s, unit_m_);
    const auto predicted =
        stacked(run.run.position_m.back(), run.run.velocity_m_per_s.back(), dt_s, unit_m_);
    result.residual.segment(offset, recorded.size()) = (predicted - recorded).reshaped();
    for (size_t p = 0; p < along.size(); ++p)
      result.residual_by_coordinate.col(static_cast<Eigen::Index>(p))
          .segment(offset, recorded.size()) =
          stacked(run.position_tangent[p].back(), run.velocity_tangent[p].back(), dt_s, unit_m_)
              .reshaped();
    offset += recorded.size();
  }
  result.usable = result.residual.allFinite() && result.residual_by_coordinate.allFinite();
  return result;
}

}  // namespace clothfit
