#include "model/integrate/simulate.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "model/integrate/lane_groups.h"
#include "model/integrate/step.h"

namespace clothfit {
namespace {

/// One group of lanes on its way through time.
template <class L>
class LaneRun {
 public:
  LaneRun(const Cloth& cloth, std::span<const ParameterSet> group)
      : cloth_(cloth),
        group_(group),
        stepper_(cloth),
        parameters_(lane_parameters<L>(cloth, group)),
        state_(LaneState<L>::of(cloth)) {
    for (int l = 0; l < L::kCount; ++l) set_start(l, set_of(l), state_);
    held_target_m_ = stepper_.held().locate(state_.position_m);
    shifted_ =
        std::ranges::any_of(group, [](const ParameterSet& set) { return !set.held_shift.empty(); });
  }

  const LaneState<L>& state() const { return state_; }

  /// Advances from `from_s` to `to_s` in `steps` equal steps. Held points are placed at the end of
  /// each step. False where it was asked to stop on the way.
  bool advance(double from_s, double to_s, int steps, StopAsker& asker) {
    const double h = (to_s - from_s) / steps;
    for (int n = 0; n < steps; ++n) {
      aim_held_points(from_s + (n + 1) * h);
      stepper_.step(parameters_, held_target_m_, from_s + n * h, h, state_);
      unmet_ += stepper_.limit_outcome().unmet;
      if (asker.ends()) return false;
    }
    return true;
  }

  /// Returns the number of steps that left the strain limit unmet.
  int unmet_steps(int lane) const { return static_cast<int>(unmet_[lane]); }

 private:
  void aim_held_points(double time_s) {
    for (size_t h = 0; h < cloth_.held.size(); ++h) {
      if (!cloth_.held[h].motion) continue;
      const Eigen::Vector3d target = cloth_.held[h].motion(time_s);
      const auto column = static_cast<Eigen::Index>(h);
      using Number = typename L::Number;
      if (shifted_) {
        for (int l = 0; l < L::kCount; ++l) {
          const Eigen::Vector3d own = shifted(target, set_of(l), h, time_s);
          held_target_m_.x(l, column) = static_cast<Number>(own.x());
          held_target_m_.y(l, column) = static_cast<Number>(own.y());
          held_target_m_.z(l, column) = static_cast<Number>(own.z());
        }
        continue;
      }
      held_target_m_.x.col(column).setConstant(static_cast<Number>(target.x()));
      held_target_m_.y.col(column).setConstant(static_cast<Number>(target.y()));
      held_target_m_.z.col(column).setConstant(static_cast<Number>(target.z()));
    }
  }

  /// Lanes to spare repeat the last set.
  const ParameterSet& set_of(int lane) const {
    return group_[std::min(static_cast<size_t>(lane), group_.size() - 1)];
  }

  const Cloth& cloth_;
  std::span<const ParameterSet> group_;
  bool shifted_ = false;  ///< whether any set shifts a held point: else all lanes have one target
  EulerStepper<L> stepper_;
  LaneParameters<L> parameters_;
  LaneState<L> state_;
  LaneVectors<L> held_target_m_;
  LaneValue<L> unmet_ = LaneValue<L>::Zero();
};

/// Returns the largest elongation of any spring beyond its critical one; 0 where none is.
double largest_excess(const Cloth& cloth, const SpringParameters& springs,
                      const Eigen::Matrix3Xd& position_m) {
  double largest = 0;
  for (size_t type = 0; type < kSpringTypes; ++type) {
    const double natural_m = springs.natural_length_m[type];
    const double longest_m = natural_m * (1 + springs.critical_elongation[type]);
    for (const auto& [a, b] : cloth.springs[type]) {
      const double length_m = (position_m.col(b) - position_m.col(a)).norm();
      largest = std::max(largest, (length_m - longest_m) / natural_m);
    }
  }
  return largest;
}

/// Returns the steps in the interval that ends at a frame; infinite for a step of nothing.
double steps_of_interval(const Schedule& schedule, size_t frame) {
  const double interval_s = schedule.frame_time_s[frame] - schedule.frame_time_s[frame - 1];
  return std::max(1.0, std::ceil(interval_s / schedule.time_step_s - 1e-9));
}

}  // namespace

bool left_the_scene(const Eigen::Matrix3Xd& now, const Eigen::Matrix3Xd& start, const Mesh& mesh) {
  constexpr double kSceneSize = 100;
  const double limit = kSceneSize * std::hypot(mesh.width_m, mesh.height_m);
  return !((now - start).cwiseAbs().maxCoeff() < limit) || !now.allFinite();
}

int Schedule::substeps(int frame) const {
  constexpr double kMost = 1e9;  // years of computing; the run diverges instead
  return static_cast<int>(std::min(steps_of_interval(*this, static_cast<size_t>(frame)), kMost));
}

double Schedule::all_steps() const {
  double steps = 0;
  for (size_t frame = 1; frame < frame_time_s.size(); ++frame)
    steps += steps_of_interval(*this, frame);
  return steps;
}

std::vector<SimulateResult> simulate(const Cloth& cloth, std::span<const ParameterSet> parameters,
                                     const Schedule& schedule, Precision precision,
                                     const FrameCallback& after_frame, const StopCheck& stop) {
  assert(schedule.time_step_s > 0);
  std::vector<SimulateResult> results(parameters.size());
  const size_t frames = schedule.frame_time_s.size();
  const bool limited = cloth.strain_limit.mode != StrainLimitMode::off;
  const auto is_running = [](const SimulateResult& result) {
    return result.reason == StopReason::not_run;
  };
  const auto run_group = [&]<class L>(std::span<const ParameterSet> group, size_t first) {
    LaneRun<L> run(cloth, group);
    StopAsker asker(stop, cloth.spring_count());
    const auto cancel = [&] {
      const Eigen::Matrix3Xd none = Eigen::Matrix3Xd::Constant(3, cloth.mesh.vertex_count(), NAN);
      for (size_t l = 0; l < group.size(); ++l) {
        SimulateResult& result = results[first + l];
        if (is_running(result) && result.position_m.size() < frames)
          result.reason = StopReason::cancelled;
        result.position_m.resize(frames, none);
        if (schedule.velocities) result.velocity_m_per_s.resize(frames, none);
      }
    };
    for (size_t l = 0; l < group.size(); ++l) results[first + l].position_m.reserve(frames);
    for (size_t frame = 0; frame < frames; ++frame) {
      if (frame > 0 && !run.advance(schedule.frame_time_s[frame - 1], schedule.frame_time_s[frame],
                                    schedule.substeps(static_cast<int>(frame)), asker)) {
        cancel();
        break;
      }
      bool any_alive = false;
      for (size_t l = 0; l < group.size(); ++l) {
        SimulateResult& result = results[first + l];
        Eigen::Matrix3Xd now = run.state().position_m.lane(static_cast<int>(l));
        if (is_running(result) && left_the_scene(now, group[l].start_position_m, cloth.mesh)) {
          result.reason = StopReason::diverged;
          result.diverged_frame = static_cast<int>(frame);
        }
        if (!is_running(result)) now.setConstant(NAN);
        if (limited && frame > 0 && is_running(result)) {
          result.largest_excess =
              std::max(result.largest_excess, largest_excess(cloth, group[l].springs, now));
          result.unmet_steps = run.unmet_steps(static_cast<int>(l));
        }
        any_alive = any_alive || is_running(result);
        result.position_m.push_back(std::move(now));
        if (schedule.velocities) {
          result.velocity_m_per_s.push_back(run.state().velocity_m_per_s.lane(static_cast<int>(l)));
          if (!is_running(result)) result.velocity_m_per_s.back().setConstant(NAN);
        }
      }
      const bool stops = after_frame && frame + 1 < frames && !after_frame(static_cast<int>(frame));
      if (any_alive && !stops) continue;
      cancel();
      break;
    }
    for (size_t l = 0; l < group.size(); ++l)
      if (is_running(results[first + l])) results[first + l].reason = StopReason::reached_end;
  };
  if (precision == Precision::exact)
    for_lane_groups<ExactLanes>(parameters, run_group);
  else
    for_lane_groups<FastLanes>(parameters, run_group);
  return results;
}

}  // namespace clothfit
