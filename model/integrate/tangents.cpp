#include "model/integrate/tangents.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "data/parallel.h"

namespace clothfit {
namespace {

/// Runs one simulation and its derivatives along some directions.
template <class L>
TangentResult run_chunk(const Cloth& cloth, const ParameterSet& set,
                        std::span<const Direction> directions, const Schedule& schedule,
                        const StopCheck& stop) {
  // A few steps change the derivatives as little as they do the cloth.
  constexpr double kFewSteps = 5;
  const double kept_s = schedule.derivatives_kept_s > 0 ? std::max(schedule.derivatives_kept_s,
                                                                   kFewSteps * schedule.time_step_s)
                                                        : 0;
  TangentStepper<L> stepper(cloth, directions, kept_s);
  const auto parameters = TangentParameters<L>::of(cloth, set, directions);
  auto state = TangentState<L>::of(cloth, set, directions);
  TangentVectors<L> target_m = stepper.locate(state);
  const auto aim = [&](double time_s) {
    for (size_t h = 0; h < cloth.held.size(); ++h) {
      if (!cloth.held[h].motion) continue;
      const auto column = static_cast<Eigen::Index>(h);
      const Eigen::Vector3d place = shifted(cloth.held[h].motion(time_s), set, h, time_s);
      target_m.value.x(0, column) = place.x();
      target_m.value.y(0, column) = place.y();
      target_m.value.z(0, column) = place.z();
      for (size_t d = 0; d < directions.size(); ++d) {
        const auto& motion = directions[d].held_motion;
        const Eigen::Vector3d change =
            motion.empty() || !motion[h] ? Eigen::Vector3d::Zero() : motion[h](time_s);
        const auto lane = static_cast<Eigen::Index>(d % L::kCount);
        LaneVectors<L>& tangent = target_m.tangent[d / L::kCount];
        tangent.x(lane, column) = static_cast<typename L::Number>(change.x());
        tangent.y(lane, column) = static_cast<typename L::Number>(change.y());
        tangent.z(lane, column) = static_cast<typename L::Number>(change.z());
      }
    }
  };

  TangentResult result;
  result.position_tangent.resize(directions.size());
  if (schedule.velocities) result.velocity_tangent.resize(directions.size());
  const auto is_running = [&] { return result.run.reason == StopReason::not_run; };
  const size_t frames = schedule.frame_time_s.size();
  StopAsker asker(stop, cloth.spring_count());
  for (size_t frame = 0; frame < frames; ++frame) {
    if (frame > 0 && is_running()) {
      const double from_s = schedule.frame_time_s[frame - 1];
      const int steps = schedule.substeps(static_cast<int>(frame));
      const double h = (schedule.frame_time_s[frame] - from_s) / steps;
      for (int n = 0; n < steps; ++n) {
        aim(from_s + (n + 1) * h);
        stepper.step(parameters, target_m, from_s + n * h, h, state);
        if (asker.ends()) {
          result.run.reason = StopReason::cancelled;
          break;
        }
      }
    }
    Eigen::Matrix3Xd now = state.value.position_m.lane(0);
    if (is_running() && left_the_scene(now, set.start_position_m, cloth.mesh)) {
      result.run.reason = StopReason::diverged;
      result.run.diverged_frame = static_cast<int>(frame);
    }
    if (!is_running()) now.setConstant(NAN);
    result.run.position_m.push_back(std::move(now));
    for (size_t d = 0; d < directions.size(); ++d) {
      Eigen::Matrix3Xd tangent =
          state.tangent[d / L::kCount].position_m.lane(static_cast<int>(d % L::kCount));
      if (!is_running()) tangent.setConstant(NAN);
      result.position_tangent[d].push_back(std::move(tangent));
    }
    if (!schedule.velocities) continue;
    const auto kept = [&](Eigen::Matrix3Xd values) {
      if (!is_running()) values.setConstant(NAN);
      return values;
    };
    result.run.velocity_m_per_s.push_back(kept(state.value.velocity_m_per_s.lane(0)));
    for (size_t d = 0; d < directions.size(); ++d)
      result.velocity_tangent[d].push_back(kept(
          state.tangent[d / L::kCount].velocity_m_per_s.lane(static_cast<int>(d % L::kCount))));
  }
  if (is_running()) result.run.reason = StopReason::reached_end;
  return result;
}

/// Returns how many directions share a run: they spread over the threads and stay in the cache.
size_t directions_at_once(size_t directions, size_t lanes) {
  constexpr size_t kMostGroups = 8;
  const size_t groups = (directions + lanes - 1) / lanes;
  const auto threads =
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  return lanes * std::clamp<size_t>((groups + threads - 1) / threads, 1, kMostGroups);
}

template <class L>
TangentResult run_in_lanes(const Cloth& cloth, const ParameterSet& parameters,
                           std::span<const Direction> directions, const Schedule& schedule,
                           const StopCheck& stop) {
  const size_t chunk = directions_at_once(directions.size(), L::kCount);
  const size_t chunks = std::max<size_t>(1, (directions.size() + chunk - 1) / chunk);
  std::vector<TangentResult> results(chunks);
  for_each_index(chunks, [&](size_t c) {
    const size_t first = c * chunk;
    results[c] = run_chunk<L>(cloth, parameters,
                              directions.subspan(first, std::min(chunk, directions.size() - first)),
                              schedule, stop);
  });
  for (const TangentResult& part : results)
    if (part.run.reason == StopReason::cancelled) results.front().run.reason = part.run.reason;
  TangentResult result = std::move(results.front());
  for (size_t c = 1; c < chunks; ++c) {
    std::ranges::move(results[c].position_tangent, std::back_inserter(result.position_tangent));
    std::ranges::move(results[c].velocity_tangent, std::back_inserter(result.velocity_tangent));
  }
  return result;
}

}  // namespace

TangentResult simulate_with_tangents(const Cloth& cloth, const ParameterSet& parameters,
                                     std::span<const Direction> directions,
                                     const Schedule& schedule, const StopCheck& stop) {
  // A group of fast lanes takes little longer than a group of exact ones, which holds half as many.
  const bool fast = schedule.fast_derivatives && directions.size() > ExactLanes::kCount;
  return fast ? run_in_lanes<FastLanes>(cloth, parameters, directions, schedule, stop)
              : run_in_lanes<ExactLanes>(cloth, parameters, directions, schedule, stop);
}

}  // namespace clothfit
