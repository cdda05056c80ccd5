#include "model/simulate.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <type_traits>

#include "model/effects/viscous_damping.h"
#include "model/step.h"

namespace clothfit {
namespace {

/// One group of lanes on its way through time.
template <class L>
class LaneRun {
 public:
  LaneRun(const Cloth& cloth, std::span<const ParameterSet> group)
      : cloth_(cloth),
        stepper_(cloth),
        parameters_(lane_parameters<L>(cloth, group)),
        state_(LaneState<L>::of(cloth)) {
    for (int l = 0; l < L::kCount; ++l) {
      const ParameterSet& set = group[std::min(static_cast<size_t>(l), group.size() - 1)];
      set_start(l, set, state_);
    }
    held_target_m_ = stepper_.held().locate(state_.position_m);
  }

  const LaneState<L>& state() const { return state_; }

  /// Advances from `from_s` to `to_s` in `steps` equal steps, held points where they are at the end
  /// of each step.
  void advance(double from_s, double to_s, int steps) {
    const double h = (to_s - from_s) / steps;
    for (int n = 0; n < steps; ++n) {
      aim_held_points(from_s + (n + 1) * h, 1);
      stepper_.step(parameters_, held_target_m_, from_s + n * h, h, state_);
      unmet_ += stepper_.limit_outcome().unmet;
    }
  }

  /// Steps that left the strain limit unmet.
  int unmet_steps(int lane) const { return static_cast<int>(unmet_[lane]); }

  /// Lets `steps` steps pass while time stands still at `time_s`. Held points glide from where they
  /// are to where they belong over the first fifth: a jump would hit the cloth like a hammer.
  void settle(double time_s, double time_step_s, int steps) {
    const LaneVectors<L> from = held_target_m_;
    for (int n = 0; n < steps; ++n) {
      held_target_m_ = from;
      aim_held_points(time_s, std::min(1.0, 5.0 * (n + 1) / steps));
      stepper_.step(parameters_, held_target_m_, time_s, time_step_s, state_);
    }
  }

 private:
  /// Moves the targets of held points that have a motion the share `share` of the way to it.
  void aim_held_points(double time_s, double share) {
    for (size_t h = 0; h < cloth_.held.size(); ++h) {
      if (!cloth_.held[h].motion) continue;
      const Eigen::Vector3d target = cloth_.held[h].motion(time_s);
      const auto column = static_cast<Eigen::Index>(h);
      const auto move = [share](auto place, double goal) {
        const auto there = static_cast<typename L::Number>(goal);
        if (share == 1)
          place.setConstant(there);
        else
          place += static_cast<typename L::Number>(share) * (there - place);
      };
      move(held_target_m_.x.col(column), target.x());
      move(held_target_m_.y.col(column), target.y());
      move(held_target_m_.z.col(column), target.z());
    }
  }

  const Cloth& cloth_;
  EulerStepper<L> stepper_;
  LaneParameters<L> parameters_;
  LaneState<L> state_;
  LaneVectors<L> held_target_m_;
  LaneValue<L> unmet_ = LaneValue<L>::Zero();
};

/// Largest elongation of any spring beyond its critical one; 0 where none is.
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

/// Calls `run.operator()<L>(group, first)` for every group of parameter sets, in parallel: as many
/// at once as lanes of a kind hold, a few left over one by one.
template <class L, class Run>
void for_lane_groups(std::span<const ParameterSet> parameters, const Run& run) {
  const size_t whole = parameters.size() / L::kCount, left = parameters.size() % L::kCount;
  // What all lanes cost is what about this many simulations vectorised over the cloth cost.
  constexpr size_t kWorthAGroup = std::is_same_v<L, FastLanes> ? 3 : 5;
  const size_t groups = whole + (left > kWorthAGroup ? 1 : 0);
  const size_t in_groups = std::min(groups * L::kCount, parameters.size());
  tbb::parallel_for(size_t{0}, groups + parameters.size() - in_groups, [&](size_t g) {
    if (g < groups) {
      const size_t first = g * L::kCount;
      run.template operator()<L>(
          parameters.subspan(first, std::min<size_t>(L::kCount, in_groups - first)), first);
    } else {
      const size_t first = in_groups + g - groups;
      run.template operator()<SingleLane>(parameters.subspan(first, 1), first);
    }
  });
}

}  // namespace

bool left_the_scene(const Eigen::Matrix3Xd& now, const Eigen::Matrix3Xd& start, const Mesh& mesh) {
  constexpr double kSceneSize = 100;
  const double limit = kSceneSize * std::hypot(mesh.width_m, mesh.height_m);
  return !((now - start).cwiseAbs().maxCoeff() < limit) || !now.allFinite();
}

int Schedule::substeps(int frame) const {
  const auto f = static_cast<size_t>(frame);
  const double interval_s = frame_time_s[f] - frame_time_s[f - 1];
  constexpr double kMost = 1e9;  // years of computing; the run diverges instead
  return static_cast<int>(std::clamp(std::ceil(interval_s / time_step_s - 1e-9), 1.0, kMost));
}

std::vector<SimulateResult> simulate(const Cloth& cloth, std::span<const ParameterSet> parameters,
                                     const Schedule& schedule, Precision precision,
                                     const FrameCallback& after_frame) {
  assert(schedule.time_step_s > 0);
  std::vector<SimulateResult> results(parameters.size());
  const size_t frames = schedule.frame_time_s.size();
  const bool limited = cloth.strain_limit.mode != StrainLimitMode::off;
  const auto run_group = [&]<class L>(std::span<const ParameterSet> group, size_t first) {
    LaneRun<L> run(cloth, group);
    for (size_t l = 0; l < group.size(); ++l) results[first + l].position_m.reserve(frames);
    for (size_t frame = 0; frame < frames; ++frame) {
      if (frame > 0)
        run.advance(schedule.frame_time_s[frame - 1], schedule.frame_time_s[frame],
                    schedule.substeps(static_cast<int>(frame)));
      bool any_alive = false;
      for (size_t l = 0; l < group.size(); ++l) {
        SimulateResult& result = results[first + l];
        Eigen::Matrix3Xd now = run.state().position_m.lane(static_cast<int>(l));
        if (result.usable() && left_the_scene(now, group[l].start_position_m, cloth.mesh)) {
          result.reason = StopReason::diverged;
          result.diverged_frame = static_cast<int>(frame);
        }
        if (!result.usable()) now.setConstant(NAN);
        if (limited && frame > 0 && result.usable()) {
          result.largest_excess =
              std::max(result.largest_excess, largest_excess(cloth, group[l].springs, now));
          result.unmet_steps = run.unmet_steps(static_cast<int>(l));
        }
        any_alive = any_alive || result.usable();
        result.position_m.push_back(std::move(now));
      }
      const bool stop = after_frame && frame + 1 < frames && !after_frame(static_cast<int>(frame));
      if (any_alive && !stop) continue;
      const Eigen::Matrix3Xd none = Eigen::Matrix3Xd::Constant(3, cloth.mesh.vertex_count(), NAN);
      for (size_t l = 0; l < group.size(); ++l) {
        SimulateResult& result = results[first + l];
        if (result.usable() && frame + 1 < frames) result.reason = StopReason::cancelled;
        result.position_m.resize(frames, none);
      }
      break;
    }
  };
  if (precision == Precision::exact)
    for_lane_groups<ExactLanes>(parameters, run_group);
  else
    for_lane_groups<FastLanes>(parameters, run_group);
  return results;
}

std::vector<RelaxedCloth> relax(const Cloth& cloth, std::span<const ParameterSet> parameters,
                                double pendulum_gravity_m_per_s2, double time_s,
                                double time_step_s) {
  if (parameters.empty()) return {};
  constexpr double kPendulumTimes = 7;  // (1 + 7) exp(-7) is left of the distance: 0.7 %
  const double pendulum_rate =
      std::sqrt(std::max(pendulum_gravity_m_per_s2, 1e-3) / cloth.mesh.height_m);

  // Supports shift in time, and time stands still here.
  Cloth heavy = cloth;
  std::vector<size_t> kept;
  heavy.effects.clear();
  heavy.effect_descriptions.clear();
  for (size_t e = 0; e < cloth.effects.size(); ++e) {
    if (cloth.effects[e]->shifts_supports()) continue;
    kept.push_back(e);
    heavy.effects.push_back(cloth.effects[e]);
    heavy.effect_descriptions.push_back(cloth.effect_descriptions[e]);
  }
  heavy.effect_descriptions.push_back(viscous_damping::describe());
  heavy.effects.push_back(viscous_damping::make());
  std::vector<ParameterSet> damped(parameters.begin(), parameters.end());
  for (size_t n = 0; n < damped.size(); ++n) {
    damped[n].effects.clear();
    for (const size_t e : kept) damped[n].effects.push_back(parameters[n].effects[e]);
    damped[n].effects.push_back({2 * pendulum_rate});
    damped[n].start_effect_memory.clear();
    damped[n].start_velocity_m_per_s.resize(3, 0);
  }

  const double duration_s = kPendulumTimes / pendulum_rate;
  const int steps = std::max(1, static_cast<int>(std::ceil(duration_s / time_step_s)));
  std::vector<RelaxedCloth> relaxed(parameters.size());
  for_lane_groups<ExactLanes>(
      damped, [&]<class L>(std::span<const ParameterSet> group, size_t first) {
        LaneRun<L> run(heavy, group);
        run.settle(time_s, duration_s / steps, steps);
        for (size_t l = 0; l < group.size(); ++l) {
          RelaxedCloth& result = relaxed[first + l];
          result.position_m = run.state().position_m.lane(static_cast<int>(l));
          for (const std::shared_ptr<const Effect>& effect : cloth.effects)
            result.effect_memory.emplace_back(Eigen::VectorXd::Zero(effect->memory_size(cloth)));
          for (size_t k = 0; k < kept.size(); ++k)
            result.effect_memory[kept[k]] =
                run.state().effect_memory[k].row(static_cast<Eigen::Index>(l)).matrix();
        }
      });
  return relaxed;
}

void start_at_rest(const Cloth& cloth, std::span<ParameterSet> parameters,
                   double pendulum_gravity_m_per_s2, double time_s, double time_step_s) {
  std::vector<RelaxedCloth> relaxed =
      relax(cloth, parameters, pendulum_gravity_m_per_s2, time_s, time_step_s);
  for (size_t n = 0; n < parameters.size(); ++n) {
    parameters[n].start_position_m = std::move(relaxed[n].position_m);
    parameters[n].start_effect_memory = std::move(relaxed[n].effect_memory);
    parameters[n].start_velocity_m_per_s.resize(3, 0);
  }
}

}  // namespace clothfit
