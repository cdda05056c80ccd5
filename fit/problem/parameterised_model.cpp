#include "fit/problem/parameterised_model.h"

#include <cassert>
#include <utility>

#include "fit/problem/unknown_group.h"
#include "model/cloth/stability.h"
#include "model/fabric/fabric_conversion.h"

namespace clothfit {
Fabric fabric_of(const FitProblem& problem, const Eigen::VectorXd& values) {
  assert(problem.spring_set == SpringSet::fabric);
  return fabric_of(FabricVector(spring_numbers(problem, values)));
}

ParameterSet parameter_set(const FitProblem& problem, const Eigen::VectorXd& values) {
  ParameterSet set;
  set.gravity_m_per_s2 = problem.gravity_m_per_s2;
  set.start_position_m = problem.placed_sheet_m;
  for (const UnknownGroup* group : unknown_groups()) group->apply(problem, values, set);
  return set;
}

std::vector<Direction> directions(const FitProblem& problem, const Eigen::VectorXd& values) {
  Direction still;
  for (const std::vector<Binding>& effect : problem.effects)
    still.effects.emplace_back(effect.size(), 0.0);
  std::vector<Direction> along(static_cast<size_t>(problem.space.size()), still);
  const Eigen::VectorXd slope = problem.space.value_by_coordinate(values);
  for (const UnknownGroup* group : unknown_groups())
    group->differentiate(problem, values, slope, along);
  return along;
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
                  problem.frame_time_s.front(), steps.rest_s, problem.stop);
  const Schedule schedule{
      .frame_time_s = {problem.frame_time_s.begin(), problem.frame_time_s.begin() + frames},
      .time_step_s = steps.run_s,
      .velocities = velocities};
  std::vector<SimulateResult> results =
      simulate(problem.cloth, sets, schedule, Precision::exact, {}, problem.stop);
  for (size_t n = 0; n < results.size(); ++n) runs[owner[n]] = std::move(results[n]);
  return runs;
}

}  // namespace clothfit
