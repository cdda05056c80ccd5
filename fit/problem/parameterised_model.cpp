#include "fit/problem/parameterised_model.h"

#include <ceres/jet.h>
#include <ceres/rotation.h>

#include <cassert>
#include <utility>

#include "model/cloth/stability.h"
#include "model/fabric/fabric_conversion.h"

namespace clothfit {
namespace {

Eigen::VectorXd spring_numbers(const FitProblem& problem, const Eigen::VectorXd& values) {
  Eigen::VectorXd numbers(static_cast<Eigen::Index>(problem.spring_numbers.size()));
  for (size_t n = 0; n < problem.spring_numbers.size(); ++n)
    numbers[static_cast<Eigen::Index>(n)] = problem.spring_numbers[n].value(values);
  return numbers;
}

/// Returns the corrections, 3 x nodes.
Eigen::Matrix3Xd corrections(const std::vector<Binding>& bindings, const Eigen::VectorXd& values) {
  Eigen::Matrix3Xd at_nodes(3, static_cast<Eigen::Index>(bindings.size() / 3));
  for (size_t n = 0; n < bindings.size(); ++n) at_nodes.data()[n] = bindings[n].value(values);
  return at_nodes;
}

Eigen::Vector3d three(const std::vector<Binding>& bindings, size_t first,
                      const Eigen::VectorXd& values) {
  return {bindings[first].value(values), bindings[first + 1].value(values),
          bindings[first + 2].value(values)};
}

Eigen::Vector3d sheet_turn(const FitProblem& problem, const Eigen::VectorXd& values) {
  return three(problem.sheet_motion, 0, values);
}

Eigen::Vector3d sheet_shift(const FitProblem& problem, const Eigen::VectorXd& values) {
  return three(problem.sheet_motion, 3, values);
}

/// Returns the rotation vector by which gravity is turned.
Eigen::Vector3d gravity_turn(const FitProblem& problem, const Eigen::VectorXd& values) {
  return problem.level_axes *
         Eigen::Vector2d(problem.tilt[0].value(values), problem.tilt[1].value(values));
}

struct Turned {
  Eigen::Vector3d value;
  Eigen::Matrix3d by_turn;
};

/// Returns a vector turned by a rotation vector, with its derivative by the latter.
Turned turned(const Eigen::Vector3d& turn, const Eigen::Vector3d& vector) {
  using Jet = ceres::Jet<double, 3>;
  const Jet angle_axis[3] = {{turn.x(), 0}, {turn.y(), 1}, {turn.z(), 2}};
  const Jet before[3] = {Jet(vector.x()), Jet(vector.y()), Jet(vector.z())};
  Jet after[3];
  ceres::AngleAxisRotatePoint(angle_axis, before, after);
  Turned result;
  for (int c = 0; c < 3; ++c) {
    result.value[c] = after[c].a;
    result.by_turn.row(c) = after[c].v;
  }
  return result;
}

}  // namespace

Fabric fabric_of(const FitProblem& problem, const Eigen::VectorXd& values) {
  assert(problem.spring_set == SpringSet::fabric);
  return fabric_of(FabricVector(spring_numbers(problem, values)));
}

ParameterSet parameter_set(const FitProblem& problem, const Eigen::VectorXd& values) {
  ParameterSet set;
  set.springs = springs_of(problem.spring_set, spring_numbers(problem, values), problem.cloth.mesh);
  set.gravity_m_per_s2 = problem.gravity_m_per_s2;
  if (!problem.tilt.empty())
    set.gravity_m_per_s2 = turned(gravity_turn(problem, values), problem.gravity_m_per_s2).value;
  for (const std::vector<Binding>& effect : problem.effects) {
    std::vector<double> numbers;
    for (const Binding& binding : effect) numbers.push_back(binding.value(values));
    set.effects.push_back(std::move(numbers));
  }
  set.start_position_m = problem.placed_sheet_m;
  if (problem.start == StartKind::unknown) {
    const StartState& start = problem.start_state;
    set.start_position_m =
        start.position_m + corrections(start.position, values) * start.basis.transpose();
    set.start_velocity_m_per_s =
        start.velocity_m_per_s + corrections(start.velocity, values) * start.basis.transpose();
  }
  if (!problem.sheet_motion.empty()) {
    const Eigen::Vector3d middle = problem.placed_sheet_m.rowwise().mean();
    const Eigen::Vector3d turn = sheet_turn(problem, values), shift = sheet_shift(problem, values);
    for (Eigen::Index v = 0; v < set.start_position_m.cols(); ++v)
      set.start_position_m.col(v) =
          turned(turn, problem.placed_sheet_m.col(v) - middle).value + middle + shift;
  }
  if (!problem.drive_correction.points.empty())
    set.held_shift = drive_shifts(problem.drive_correction, values, problem.cloth.held.size());
  return set;
}

std::vector<Direction> directions(const FitProblem& problem, const Eigen::VectorXd& values) {
  Direction still;
  for (const std::vector<Binding>& effect : problem.effects)
    still.effects.emplace_back(effect.size(), 0.0);
  std::vector<Direction> result(static_cast<size_t>(problem.space.size()), still);
  const Eigen::VectorXd slope = problem.space.value_by_coordinate(values);
  const auto along = [&](const Binding& binding) -> Direction& {
    return result[static_cast<size_t>(binding.parameter)];
  };

  const Eigen::MatrixXd springs =
      springs_by_numbers(problem.spring_set, spring_numbers(problem, values));
  for (size_t n = 0; n < problem.spring_numbers.size(); ++n) {
    const Binding& binding = problem.spring_numbers[n];
    if (binding.parameter < 0) continue;
    const SpringParameters change = springs_of(
        SpringVector(slope[binding.parameter] * springs.col(static_cast<Eigen::Index>(n))));
    Direction& direction = along(binding);
    direction.natural_length_m = change.natural_length_m;
    direction.stiffness_n_per_m = change.stiffness_n_per_m;
    direction.damping_ns_per_m = change.damping_ns_per_m;
    direction.critical_elongation = change.critical_elongation;
  }
  if (!problem.tilt.empty()) {
    const Eigen::Matrix<double, 3, 2> by_tilt =
        turned(gravity_turn(problem, values), problem.gravity_m_per_s2).by_turn *
        problem.level_axes;
    for (size_t axis = 0; axis < 2; ++axis) {
      const Binding& binding = problem.tilt[axis];
      along(binding).gravity_m_per_s2 =
          slope[binding.parameter] * by_tilt.col(static_cast<Eigen::Index>(axis));
    }
  }
  for (size_t e = 0; e < problem.effects.size(); ++e)
    for (size_t k = 0; k < problem.effects[e].size(); ++k)
      if (const Binding& binding = problem.effects[e][k]; binding.parameter >= 0)
        along(binding).effects[e][k] = slope[binding.parameter];
  for (int n = 0; n < 3 * problem.start_state.nodes(); ++n) {
    const Eigen::RowVectorXd field = problem.start_state.basis.col(n / 3).transpose();
    const auto move = [&](const Binding& binding, Eigen::Matrix3Xd& of) {
      of = slope[binding.parameter] * Eigen::Vector3d::Unit(n % 3) * field;
    };
    const Binding& position = problem.start_state.position[static_cast<size_t>(n)];
    const Binding& velocity = problem.start_state.velocity[static_cast<size_t>(n)];
    move(position, along(position).start_position_m);
    move(velocity, along(velocity).start_velocity_m_per_s);
  }
  if (!problem.sheet_motion.empty()) {
    const Eigen::Index vertices = problem.placed_sheet_m.cols();
    const Eigen::Vector3d middle = problem.placed_sheet_m.rowwise().mean();
    const Eigen::Vector3d turn = sheet_turn(problem, values);
    for (const Binding& binding : problem.sheet_motion)
      along(binding).start_position_m.resize(3, vertices);
    for (Eigen::Index v = 0; v < vertices; ++v) {
      const Eigen::Matrix3d by_turn = turned(turn, problem.placed_sheet_m.col(v) - middle).by_turn;
      for (size_t axis = 0; axis < 3; ++axis) {
        const auto column = static_cast<Eigen::Index>(axis);
        const Binding& turning = problem.sheet_motion[axis];
        const Binding& shifting = problem.sheet_motion[axis + 3];
        along(turning).start_position_m.col(v) = slope[turning.parameter] * by_turn.col(column);
        along(shifting).start_position_m.col(v) =
            slope[shifting.parameter] * Eigen::Vector3d::Unit(column);
      }
    }
  }
  for (const DriveCorrection::Point& point : problem.drive_correction.points) {
    for (size_t n = 0; n < point.values.size(); ++n) {
      Direction& direction = along(point.values[n]);
      direction.held_motion.resize(problem.cloth.held.size());
      direction.held_motion[static_cast<size_t>(point.held)] =
          drive_shift_by_value(problem.drive_correction, static_cast<int>(n) / 3,
                               slope[point.values[n].parameter] *
                                   Eigen::Vector3d::Unit(static_cast<Eigen::Index>(n) % 3));
    }
  }
  for (const FitProblem::EmergingTerm& term : problem.emerging)
    result[static_cast<size_t>(term.parameter)].emerging =
        EmergingEffect{.effect = term.effect,
                       .parameters = term.values,
                       .change = term.change / slope[term.parameter],
                       .start_memory = {}};
  return result;
}

bool is_stable(const FitProblem& problem, const ParameterSet& set, const TimeSteps& steps) {
  const bool rests = problem.start == StartKind::at_rest;
  return stable_time_step_s(problem.cloth, set) >= steps.run_s &&
         (!rests || stable_rest_step_s(problem.cloth, set) >= steps.rest_s);
}

std::vector<SimulateResult> run_model(const FitProblem& problem,
                                      const std::vector<Eigen::VectorXd>& values, int frames,
                                      const TimeSteps& steps, bool velocities) {
  std::vector<ParameterSet> sets;
  std::vector<size_t> owner;
  for (size_t n = 0; n < values.size(); ++n) {
    ParameterSet set = parameter_set(problem, values[n]);
    if (!is_stable(problem, set, steps)) continue;
    sets.push_back(std::move(set));
    owner.push_back(n);
  }
  std::vector<SimulateResult> runs(values.size(), {.reason = StopReason::diverged});
  if (sets.empty()) return runs;
  if (problem.start == StartKind::at_rest)
    start_at_rest(problem.cloth, sets, problem.gravity_m_per_s2.norm(),
                  problem.frame_time_s.front(), steps.rest_s);
  const Schedule schedule{
      .frame_time_s = {problem.frame_time_s.begin(), problem.frame_time_s.begin() + frames},
      .time_step_s = steps.run_s,
      .velocities = velocities};
  std::vector<SimulateResult> results = simulate(problem.cloth, sets, schedule);
  for (size_t n = 0; n < results.size(); ++n) runs[owner[n]] = std::move(results[n]);
  return runs;
}

}  // namespace clothfit
