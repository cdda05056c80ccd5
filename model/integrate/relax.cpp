#include "model/integrate/relax.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "data/parallel.h"
#include "model/cloth/stability.h"
#include "model/integrate/lane_groups.h"
#include "model/integrate/step.h"

namespace clothfit {
namespace {

/// The retardation time of springs while they relax, as a share of the time step. It calms motions
/// that are as fast as the step can follow, and costs a tenth of the step. The air calms slower
/// ones.
constexpr double kRetardationShare = 0.125;

std::array<double, kSpringTypes> calm(const std::array<double, kSpringTypes>& stiffness_n_per_m,
                                      double time_step_s) {
  std::array<double, kSpringTypes> damping_ns_per_m{};
  for (size_t type = 0; type < kSpringTypes; ++type)
    damping_ns_per_m[type] = kRetardationShare * time_step_s * stiffness_n_per_m[type];
  return damping_ns_per_m;
}

/// Says whether an effect shifts supports in time, which stands still while a cloth relaxes.
bool moves_supports(const Effect& effect) {
  return effect.shifts_supports() && !effect.shifts_supports_at_rest();
}

constexpr double kPendulumTimes = 7;  ///< (1 + 7) exp(-7) of the distance remains: 0.7 %

double pendulum_rate(const Cloth& cloth, double gravity_m_per_s2) {
  return std::sqrt(std::max(gravity_m_per_s2, 1e-3) / cloth.mesh.height_m);
}

/// A cloth with calm springs in heavy air. It is `cloth`, held where motions have its points at one
/// time, with its own effects but those that move supports. The air takes a share of all velocities
/// before each step.
struct HeavyAir {
  Cloth cloth;
  std::vector<size_t> kept;  ///< effects of the cloth, in their order here
  double slowing = 1;        ///< share of a velocity that the air leaves in a step
  double time_step_s = 0;
  int steps = 0;

  HeavyAir(const Cloth& light, double pendulum_gravity_m_per_s2, double time_s,
           double longest_step_s)
      : cloth(light) {
    const double rate = pendulum_rate(light, pendulum_gravity_m_per_s2);
    const double duration_s = kPendulumTimes / rate;
    constexpr double kMost = 1e9;  // as of a run (Schedule::substeps)
    steps = static_cast<int>(
        std::min(rest_steps(light, pendulum_gravity_m_per_s2, longest_step_s), kMost));
    time_step_s = duration_s / steps;
    slowing = std::exp(-2 * rate * time_step_s);

    for (HeldVertexWeights& point : cloth.held)
      if (point.motion) point.motion = [place_m = point.motion(time_s)](double) { return place_m; };
    cloth.effects.clear();
    cloth.effect_descriptions.clear();
    for (size_t e = 0; e < light.effects.size(); ++e) {
      if (moves_supports(*light.effects[e])) continue;
      kept.push_back(e);
      cloth.effects.push_back(light.effects[e]);
      cloth.effect_descriptions.push_back(light.effect_descriptions[e]);
    }
  }

  ParameterSet in_it(ParameterSet set) const {
    set.springs.damping_ns_per_m = calm(set.springs.stiffness_n_per_m, time_step_s);
    std::vector<std::vector<double>> effects;
    for (const size_t e : kept) effects.push_back(std::move(set.effects[e]));
    set.effects = std::move(effects);
    set.start_effect_memory.clear();
    set.start_velocity_m_per_s.resize(3, 0);
    return set;
  }

  Direction in_it(Direction direction) const {
    direction.damping_ns_per_m = calm(direction.stiffness_n_per_m, time_step_s);
    if (!direction.effects.empty()) {
      std::vector<std::vector<double>> effects;
      for (const size_t e : kept) effects.push_back(std::move(direction.effects[e]));
      direction.effects = std::move(effects);
    }
    direction.start_effect_memory.clear();
    direction.start_velocity_m_per_s.resize(3, 0);
    if (direction.emerging) {
      direction.emerging->start_memory.resize(0);
      if (moves_supports(*direction.emerging->effect)) direction.emerging.reset();
    }
    return direction;
  }

  /// Returns the share of the way after step `n`. Held points glide from their places to their
  /// targets over the first fifth: a jump would set the whole cloth swinging. Shifts by effects,
  /// centimetres at most, act from the first step on.
  double way(int n) const { return std::min(1.0, 5.0 * (n + 1) / steps); }
};

/// Returns the place after `share` of the way; exactly the target in the end.
template <class Number>
Number on_the_way(Number from, Number to, double share) {
  return share == 1 ? to : from + static_cast<Number>(share) * (to - from);
}

/// Returns the memory of each of the cloth's own effects from that in `heavy` air.
template <class Remembered>
std::vector<Eigen::VectorXd> memory_of(const Cloth& cloth, const HeavyAir& heavy,
                                       const Remembered& remembered) {
  std::vector<Eigen::VectorXd> memory;
  for (const std::shared_ptr<const Effect>& effect : cloth.effects)
    memory.emplace_back(Eigen::VectorXd::Zero(effect->memory_size(cloth)));
  for (size_t k = 0; k < heavy.kept.size(); ++k) memory[heavy.kept[k]] = remembered(k);
  return memory;
}

template <class L>
void slow(double share, LaneVectors<L>& velocity_m_per_s) {
  const auto factor = static_cast<typename L::Number>(share);
  velocity_m_per_s.x *= factor;
  velocity_m_per_s.y *= factor;
  velocity_m_per_s.z *= factor;
}

/// Leaves a state of which nothing can be made: the relaxation was ended on the way.
template <class L>
void spoil(LaneState<L>& state) {
  state.position_m.x.setConstant(NAN);
}

template <class L>
void settle(const HeavyAir& heavy, double time_s, std::span<const ParameterSet> group,
            const StopCheck& stop, LaneState<L>& state) {
  const auto set_of = [&](Eigen::Index lane) -> const ParameterSet& {
    return group[std::min(static_cast<size_t>(lane), group.size() - 1)];
  };
  for (int l = 0; l < L::kCount; ++l) set_start(l, set_of(l), state);
  EulerStepper<L> stepper(heavy.cloth);
  const LaneParameters<L> parameters = lane_parameters<L>(heavy.cloth, group);
  const LaneVectors<L> from_m = stepper.held().locate(state.position_m);
  LaneVectors<L> target_m = from_m;
  StopAsker asker(stop, heavy.cloth.spring_count());
  for (int n = 0; n < heavy.steps; ++n) {
    if (asker.ends()) return spoil(state);
    for (size_t h = 0; h < heavy.cloth.held.size(); ++h) {
      if (!heavy.cloth.held[h].motion) continue;
      const Eigen::Vector3d by_motion = heavy.cloth.held[h].motion(time_s);
      for (Eigen::Index l = 0; l < L::kCount; ++l) {
        const Eigen::Vector3d there = shifted(by_motion, set_of(l), h, time_s);
        const auto place = [&](auto& target, const auto& from, double to) {
          const auto column = static_cast<Eigen::Index>(h);
          target(l, column) =
              on_the_way(from(l, column), static_cast<typename L::Number>(to), heavy.way(n));
        };
        place(target_m.x, from_m.x, there.x());
        place(target_m.y, from_m.y, there.y());
        place(target_m.z, from_m.z, there.z());
      }
    }
    slow(heavy.slowing, state.velocity_m_per_s);
    stepper.step(parameters, target_m, time_s, heavy.time_step_s, state);
  }
}

/// Relaxes one simulation and its derivatives.
void settle(const HeavyAir& heavy, double time_s, const ParameterSet& set,
            std::span<const Direction> directions, const StopCheck& stop, TangentStepper<>& stepper,
            TangentState<>& state) {
  state = TangentState<>::of(heavy.cloth, set, directions);
  const auto parameters = TangentParameters<>::of(heavy.cloth, set, directions);
  const TangentVectors<> from_m = stepper.locate(state);
  TangentVectors<> target_m = from_m;
  StopAsker asker(stop, heavy.cloth.spring_count());
  for (int n = 0; n < heavy.steps; ++n) {
    if (asker.ends()) return spoil(state.value);
    for (size_t h = 0; h < heavy.cloth.held.size(); ++h) {
      if (!heavy.cloth.held[h].motion) continue;
      const auto column = static_cast<Eigen::Index>(h);
      const auto place = [&](auto& target, const auto& from, Eigen::Index lane, double to) {
        target(lane, column) = on_the_way(from(lane, column), to, heavy.way(n));
      };
      const Eigen::Vector3d there = shifted(heavy.cloth.held[h].motion(time_s), set, h, time_s);
      place(target_m.value.x, from_m.value.x, 0, there.x());
      place(target_m.value.y, from_m.value.y, 0, there.y());
      place(target_m.value.z, from_m.value.z, 0, there.z());
      for (size_t d = 0; d < directions.size(); ++d) {
        const auto& motion = directions[d].held_motion;
        const Eigen::Vector3d change =
            motion.empty() || !motion[h] ? Eigen::Vector3d::Zero() : motion[h](time_s);
        const auto lane = static_cast<Eigen::Index>(d % kLanes);
        LaneVectors<>& to = target_m.tangent[d / kLanes];
        const LaneVectors<>& from = from_m.tangent[d / kLanes];
        place(to.x, from.x, lane, change.x());
        place(to.y, from.y, lane, change.y());
        place(to.z, from.z, lane, change.z());
      }
    }
    slow(heavy.slowing, state.value.velocity_m_per_s);
    for (LaneState<>& tangent : state.tangent) slow(heavy.slowing, tangent.velocity_m_per_s);
    stepper.step(parameters, target_m, time_s, heavy.time_step_s, state);
  }
}

}  // namespace

double rest_steps(const Cloth& cloth, double pendulum_gravity_m_per_s2, double time_step_s) {
  const double duration_s = kPendulumTimes / pendulum_rate(cloth, pendulum_gravity_m_per_s2);
  return std::max(1.0, std::ceil(duration_s / time_step_s));
}

double stable_rest_step_s(const Cloth& cloth, const ParameterSet& parameters) {
  ParameterSet set = parameters;
  set.springs.damping_ns_per_m.fill(0);
  const double undamped_s = stable_time_step_s(cloth, set);
  set.springs.damping_ns_per_m = calm(set.springs.stiffness_n_per_m, undamped_s);
  return stable_time_step_s(cloth, set);
}

TimeSteps stable_time_steps(const Cloth& cloth, const ParameterSet& parameters) {
  return {stable_time_step_s(cloth, parameters), stable_rest_step_s(cloth, parameters)};
}

TimeSteps time_steps_of_run(const Cloth& cloth, const ParameterSet& parameters, double run_s) {
  const TimeSteps stable = stable_time_steps(cloth, parameters);
  return std::isfinite(stable.rest_s) ? stable.times(run_s / stable.run_s) : TimeSteps(run_s);
}

std::vector<RelaxedCloth> relax(const Cloth& cloth, std::span<const ParameterSet> parameters,
                                double pendulum_gravity_m_per_s2, double time_s, double time_step_s,
                                const StopCheck& stop) {
  if (parameters.empty()) return {};
  const HeavyAir heavy(cloth, pendulum_gravity_m_per_s2, time_s, time_step_s);
  std::vector<ParameterSet> sets;
  for (const ParameterSet& set : parameters) sets.push_back(heavy.in_it(set));
  std::vector<RelaxedCloth> relaxed(sets.size());
  for_lane_groups<ExactLanes>(
      sets, [&]<class L>(std::span<const ParameterSet> group, size_t first) {
        LaneState<L> state = LaneState<L>::of(heavy.cloth);
        settle<L>(heavy, time_s, group, stop, state);
        for (size_t l = 0; l < group.size(); ++l) {
          RelaxedCloth& result = relaxed[first + l];
          result.position_m = state.position_m.lane(static_cast<int>(l));
          result.effect_memory = memory_of(cloth, heavy, [&](size_t k) -> Eigen::VectorXd {
            return state.effect_memory[k].row(static_cast<Eigen::Index>(l)).matrix();
          });
        }
      });
  return relaxed;
}

void start_at_rest(const Cloth& cloth, std::span<ParameterSet> parameters,
                   double pendulum_gravity_m_per_s2, double time_s, double time_step_s,
                   const StopCheck& stop) {
  std::vector<RelaxedCloth> relaxed =
      relax(cloth, parameters, pendulum_gravity_m_per_s2, time_s, time_step_s, stop);
  for (size_t n = 0; n < parameters.size(); ++n) {
    parameters[n].start_position_m = std::move(relaxed[n].position_m);
    parameters[n].start_effect_memory = std::move(relaxed[n].effect_memory);
    parameters[n].start_velocity_m_per_s.resize(3, 0);
  }
}

void start_at_rest_with_tangents(const Cloth& cloth, ParameterSet& set,
                                 std::span<Direction> directions, double pendulum_gravity_m_per_s2,
                                 double time_s, double time_step_s, const StopCheck& stop) {
  const HeavyAir heavy(cloth, pendulum_gravity_m_per_s2, time_s, time_step_s);
  const ParameterSet damped = heavy.in_it(set);
  std::vector<Direction> moved;
  for (const Direction& direction : directions) moved.push_back(heavy.in_it(direction));
  const size_t groups = std::max<size_t>(1, (directions.size() + kLanes - 1) / kLanes);
  for_each_index(groups, [&](size_t g) {
    const size_t first = g * kLanes;
    const size_t count = std::min<size_t>(kLanes, directions.size() - first);
    TangentState<> state;
    const std::span<const Direction> group = std::span(moved).subspan(first, count);
    TangentStepper<> stepper(heavy.cloth, group);
    settle(heavy, time_s, damped, group, stop, stepper, state);
    for (size_t d = 0; d < count; ++d) {
      const auto lane = static_cast<int>(d);
      directions[first + d].start_position_m = state.tangent.front().position_m.lane(lane);
      directions[first + d].start_velocity_m_per_s.resize(3, 0);
      if (directions[first + d].emerging)
        directions[first + d].emerging->start_memory = stepper.emerging_memory(d);
      directions[first + d].start_effect_memory =
          memory_of(cloth, heavy, [&](size_t k) -> Eigen::VectorXd {
            return state.tangent.front().effect_memory[k].row(lane).matrix();
          });
    }
    if (g > 0) return;
    set.start_position_m = state.value.position_m.lane(0);
    set.start_velocity_m_per_s.resize(3, 0);
    set.start_effect_memory = memory_of(cloth, heavy, [&](size_t k) -> Eigen::VectorXd {
      return state.value.effect_memory[k].row(0).matrix();
    });
  });
}

}  // namespace clothfit
