#include "fit/problem/work_limits.h"

#include <fmt/format.h>

#include <cmath>

#include "data/input_error.h"
#include "model/integrate/simulate.h"

namespace clothfit {

RunWork work_of_run(const Cloth& cloth, const std::vector<double>& frame_time_s,
                    const TimeSteps& steps, bool begins_at_rest, double gravity_m_per_s2) {
  RunWork work{.steps = 0, .springs = static_cast<double>(cloth.spring_count())};
  work.steps = Schedule{.frame_time_s = frame_time_s, .time_step_s = steps.run_s}.all_steps();
  if (begins_at_rest) work.steps += rest_steps(cloth, gravity_m_per_s2, steps.rest_s);
  return work;
}

void require_affordable_run(const RunWork& work, const std::string& where,
                            const std::string& remedy) {
  // Numbers that do not work out are refused too.
  if (work.steps <= kMostStepsOfRun && work.spring_steps() <= kMostSpringStepsOfRun) return;
  throw InputError(
      where,
      fmt::format("one simulation would take {:.2g} time steps of {:.0f} springs, {:.2g} "
                  "spring-steps",
                  work.steps, work.springs, work.spring_steps()),
      fmt::format("at most {:.0e} time steps and {:.0e} spring-steps, about a day", kMostStepsOfRun,
                  kMostSpringStepsOfRun),
      remedy);
}

}  // namespace clothfit
