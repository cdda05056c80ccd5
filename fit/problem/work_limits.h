#pragma once

#include <string>
#include <vector>

#include "fit/interface/option_limits.h"
#include "model/cloth/cloth.h"
#include "model/integrate/relax.h"

namespace clothfit {

// Limits of work. They refuse slips of the keyboard (a step of a nanosecond, a stiffness of 1e12),
// not long jobs: each is about what a desktop does in a day. A core does 1e8 to 6e8 spring-steps a
// second, the fewer the more effects act.

/// Spring-steps of one simulation, which one core runs.
inline constexpr double kMostSpringStepsOfRun = 1e13;
/// Time steps of one simulation. A cloth of a few springs is no faster than that.
inline constexpr double kMostStepsOfRun = 1e8;
/// Spring-steps of a search. It ends there, with the best that it has found.
inline constexpr double kMostSpringStepsOfSearch = 1e13;
/// Spring-steps that a fit takes at least. All cores work on it.
inline constexpr double kMostSpringStepsOfFit = 1e14;
/// Times that a time step may be finer than stability asks for. The scheme's error falls with the
/// step: a hundredth of it is far below all noise.
inline constexpr double kFinestStep = kMostSubstepScale;

/// The work of one simulation, as numbers of floating point: they are too large for integers where
/// they matter.
struct RunWork {
  double steps = 0;
  double springs = 0;
  double spring_steps() const { return steps * springs; }
};

/// Returns the work of a run over the frames at these time steps. The relaxation before it counts
/// where it begins at rest.
RunWork work_of_run(const Cloth& cloth, const std::vector<double>& frame_time_s,
                    const TimeSteps& steps, bool begins_at_rest, double gravity_m_per_s2);

/// Throws InputError at `where` for a run beyond the limits, with the estimate and what to do.
void require_affordable_run(const RunWork& work, const std::string& where,
                            const std::string& remedy);

}  // namespace clothfit
