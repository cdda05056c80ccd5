#include "model/integrate/divergence.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace clothfit {
namespace {

/// A whole cloth further than this many diagonals from its start has flown away.
constexpr double kFlownAway = 10;

double length_m(const Eigen::Matrix3Xd& position_m, const Spring& spring) {
  return (position_m.col(spring.b) - position_m.col(spring.a)).norm();
}

/// Returns the spring that is longest for its natural length. If only those `beyond_reason` count
/// and there is none, nothing.
std::optional<Divergence::StretchedSpring> most_stretched(const Cloth& cloth,
                                                          const ParameterSet& parameters,
                                                          const Eigen::Matrix3Xd& position_m,
                                                          bool beyond_reason) {
  std::optional<Divergence::StretchedSpring> worst;
  for (int type = 0; type < kSpringTypes; ++type) {
    const double natural_m = parameters.springs.natural_length_m[static_cast<size_t>(type)];
    for (const Spring& spring : cloth.springs[static_cast<size_t>(type)]) {
      const double now_m = length_m(position_m, spring);
      const double reason_m =
          kLengthBeyondReason * std::max(natural_m, length_m(parameters.start_position_m, spring));
      if (beyond_reason && !(now_m > reason_m)) continue;
      if (!worst || now_m / natural_m > worst->length_m / worst->natural_length_m)
        worst = {type, spring, now_m, natural_m};
    }
  }
  return worst;
}

Eigen::RowVectorXd distances_m(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  return (to - from).colwise().norm();
}

/// Returns the first frame of a run that is not finite or holds a spring beyond reason; their
/// number when there is none.
size_t first_bad_frame(const Cloth& cloth, const ParameterSet& parameters,
                       const SimulateResult& result) {
  for (size_t f = 0; f < result.position_m.size(); ++f) {
    const Eigen::Matrix3Xd& position_m = result.position_m[f];
    if (!position_m.allFinite() || most_stretched(cloth, parameters, position_m, true)) return f;
  }
  return result.position_m.size();
}

/// Some steps of an interval: every `stride`-th from `first` on to `end`.
struct SomeSteps {
  int first = 0, end = 0, stride = 1;
};

/// Returns the schedule up to frame `last`, with some steps of its interval frames of their own.
/// `steps` gets the step of each of these.
Schedule with_steps_before(const Schedule& schedule, size_t last, const SomeSteps& wanted,
                           std::vector<int>& steps) {
  Schedule fine{.frame_time_s = {schedule.frame_time_s.begin(),
                                 schedule.frame_time_s.begin() + static_cast<std::ptrdiff_t>(last)},
                .time_step_s = schedule.time_step_s};
  const double from_s = schedule.frame_time_s[last - 1];
  const double h =
      (schedule.frame_time_s[last] - from_s) / schedule.substeps(static_cast<int>(last));
  // Several steps of one interval are cut as they were.
  if (wanted.first > 0 || wanted.stride > 1) fine.time_step_s = h * (1 + 1e-12);
  steps.clear();
  if (wanted.first > 0) steps.push_back(wanted.first);
  for (int n = wanted.first; n < wanted.end;) {
    n = wanted.end - n > wanted.stride ? n + wanted.stride : wanted.end;
    steps.push_back(n);
  }
  for (const int n : steps) fine.frame_time_s.push_back(from_s + n * h);
  return fine;
}

/// Steps whose positions are kept at once: some hundred megabytes.
int most_kept_steps(const Mesh& mesh) {
  constexpr double kMostKept = 2e7;
  return static_cast<int>(std::max(100.0, kMostKept / mesh.vertex_count()));
}

}  // namespace

std::optional<Divergence> find_divergence(const Cloth& cloth, const ParameterSet& parameters,
                                          const Schedule& schedule, const StopCheck& stop) {
  const auto run = [&](const Schedule& over) {
    return std::move(simulate(cloth, {&parameters, 1}, over, Precision::exact, {}, stop).front());
  };
  size_t frame = 0;
  {
    const SimulateResult coarse = run(schedule);
    if (coarse.reason == StopReason::cancelled) return std::nullopt;
    frame = first_bad_frame(cloth, parameters, coarse);
    if (frame == coarse.position_m.size()) return std::nullopt;
  }
  Divergence divergence{.frame = static_cast<int>(frame), .time_s = schedule.frame_time_s[frame]};
  if (frame == 0) return divergence;

  // Where an interval has more steps than can be kept, some of them tell between which to look.
  SomeSteps wanted{.first = 0, .end = schedule.substeps(static_cast<int>(frame)), .stride = 1};
  Schedule fine;
  SimulateResult result;
  size_t bad = 0;
  while (true) {
    wanted.stride = (wanted.end - wanted.first - 1) / most_kept_steps(cloth.mesh) + 1;
    std::vector<int> steps;
    fine = with_steps_before(schedule, frame, wanted, steps);
    result = run(fine);
    if (result.reason == StopReason::cancelled) return std::nullopt;
    // Steps that end frames are rounded a little differently here, so the last one is bad at the
    // latest.
    bad = std::min(first_bad_frame(cloth, parameters, result), result.position_m.size() - 1);
    const size_t place = bad - std::min(bad, frame);
    wanted.end = steps[place];
    if (wanted.stride == 1) break;
    if (place > 0) wanted.first = std::max(0, steps[place - 1] - 1);
  }
  for (size_t f = 1; f < frame; ++f) divergence.step += schedule.substeps(static_cast<int>(f));
  divergence.step += wanted.end;
  divergence.time_s = fine.frame_time_s[bad];
  divergence.time_step_s = fine.frame_time_s[bad] - fine.frame_time_s[bad - 1];

  if (result.position_m[bad].allFinite())
    divergence.spring = most_stretched(cloth, parameters, result.position_m[bad], true);
  if (divergence.spring) return divergence;
  const Eigen::Matrix3Xd& before = result.position_m[bad - 1];
  Eigen::Index furthest = 0;
  const double away_m = distances_m(parameters.start_position_m, before).maxCoeff(&furthest);
  if (away_m > kFlownAway * std::hypot(cloth.mesh.width_m, cloth.mesh.height_m))
    divergence.vertex = static_cast<int>(furthest);
  else
    divergence.spring = most_stretched(cloth, parameters, before, false);
  return divergence;
}

const char* spring_family(int type) {
  assert(type >= 0 && type < kSpringTypes);
  if (type <= structural_s) return "structural";
  return type <= shear_up ? "shear" : "flexion";
}

}  // namespace clothfit
