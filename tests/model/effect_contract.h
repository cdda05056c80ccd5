#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "model/effects/registry.h"
#include "model/simulate.h"
#include "model/stability.h"
#include "tests/model/effect_derivatives.h"
#include "tests/model/mechanics.h"
#include "tests/model/random_cloth.h"
#include "tests/model/touched_cloth.h"

namespace clothfit {

/// What an effect claims beyond the contract that all of them keep.
struct EffectTraits {
  bool isotropic = false;     ///< its force turns with the scene; it prefers no direction of space
  bool only_damps = false;    ///< its power is never positive
  bool proportional = false;  ///< its force is proportional to its first parameter
  bool internal = false;      ///< its forces sum to zero and exert no torque
  bool adds_force = true;     ///< it adds a force that depends on nothing but the present state
};

namespace effect_contract {

using Parameters = std::vector<double>;

inline Parameters neutral(const EffectDescription& effect) {
  Parameters values;
  for (const EffectParameter& p : effect.parameters) values.push_back(p.neutral);
  return values;
}

/// Somewhere within the bounds, a few typical changes away from neutral.
inline Parameters random_parameters(const EffectDescription& effect, Uniform& uniform) {
  Parameters values;
  for (const EffectParameter& p : effect.parameters)
    values.push_back(uniform(std::max(p.lower, p.neutral - 5 * p.typical),
                             std::min(p.upper, p.neutral + 5 * p.typical)));
  return values;
}

template <class L = ExactLanes>
EffectValues<L> every_lane(const Parameters& values) {
  EffectValues<L> lanes;
  for (const double value : values)
    lanes.push_back(LaneValue<L>::Constant(static_cast<typename L::Number>(value)));
  return lanes;
}

/// A moving, crumpled cloth of cotton.
struct State {
  Cloth cloth = touched_cloth(6);
  Eigen::Matrix3Xd position_m, velocity_m_per_s;

  explicit State(Uniform& uniform, const std::string& effect = "")
      : position_m(crumpled_for(effect, square_mesh(6), 0.5, uniform)),
        velocity_m_per_s(uniform.vectors(36, 3.0)) {}
};

/// The force on every vertex, 3 x vertices (N), as lanes of kind L compute it; `there_n` is what
/// other forces have added before.
template <class L = ExactLanes>
Eigen::Matrix3Xd force_n(const Effect& effect, const State& state, const Parameters& parameters,
                         const Eigen::Matrix3Xd& there_n) {
  const auto lanes_of = [](const Eigen::Matrix3Xd& values) {
    LaneVectors<L> lanes = LaneVectors<L>::zero(static_cast<int>(values.cols()));
    for (int l = 0; l < L::kCount; ++l) lanes.set_lane(l, values);
    return lanes;
  };
  LaneParameters<L> lanes;
  for (int l = 0; l < L::kCount; ++l)
    set_lane(l, spring_parameters(cotton(), state.cloth.mesh), {}, lanes);
  lanes.gravity_m_per_s2 = {LaneValue<L>::Zero(), LaneValue<L>::Zero(),
                            LaneValue<L>::Constant(typename L::Number(-9.81))};
  const LaneVectors<L> position_m = lanes_of(state.position_m),
                       velocity_m_per_s = lanes_of(state.velocity_m_per_s);
  const EffectScene<L> scene{
      state.cloth, lanes.springs, lanes.gravity_m_per_s2, position_m, velocity_m_per_s, 0.3, 1e-3};
  EffectMemory<L> memory = EffectMemory<L>::Zero(L::kCount, effect.memory_size(state.cloth));
  LaneVectors<L> force = lanes_of(there_n);
  const EffectValues<L> values = every_lane<L>(parameters);
  effect.add_force(scene, values, memory, force);
  effect.change_force(scene, values, force);
  return force.lane(0);
}

template <class L = ExactLanes>
Eigen::Matrix3Xd force_n(const EffectEntry& entry, const State& state,
                         const Parameters& parameters) {
  return force_n<L>(*entry.make(), state, parameters, at_rest(state.position_m));
}

inline void expect_a_complete_description(const EffectEntry& entry) {
  const EffectDescription effect = entry.describe();
  EXPECT_EQ(effect.name, entry.name);
  EXPECT_FALSE(effect.summary.empty());
  EXPECT_FALSE(effect.parameters.empty());
  for (const EffectParameter& p : effect.parameters) {
    SCOPED_TRACE(p.name);
    EXPECT_FALSE(p.name.empty());
    EXPECT_FALSE(p.unit.empty());
    EXPECT_LE(p.lower, p.neutral);  // a fit that starts at neutral starts inside its bounds
    EXPECT_GE(p.upper, p.neutral);
    EXPECT_LT(p.lower, p.upper);
    EXPECT_GT(p.typical, 0);
    EXPECT_TRUE(p.scale == ParameterScale::linear || p.lower > 0);
  }
}

inline void expect_nothing_at_neutral(const EffectEntry& entry, Uniform& uniform) {
  // Given a swinging cloth with the effect and one without,
  Cloth plain = touched_cloth(6);
  plain.held = {held_at(plain.mesh, 0, 0), held_at(plain.mesh, 0.31, 0.02)};
  Cloth with = plain;
  with.add_effect(entry.name, "test");
  ParameterSet set{.springs = spring_parameters(cotton(), plain.mesh),
                   .start_position_m = crumpled_for(entry.name, plain.mesh, 0.3, uniform)};
  const Schedule schedule{.frame_time_s = {0, 0.1, 0.2, 0.3}, .time_step_s = 2e-4};
  const SimulateResult without = simulate(plain, {&set, 1}, schedule).front();

  // when its parameters are neutral, then not a bit of the trajectory differs;
  set.effects = {neutral(entry.describe())};
  const SimulateResult at_neutral = simulate(with, {&set, 1}, schedule).front();
  EXPECT_EQ(at_neutral.position_m, without.position_m);
  const EffectRates rates = with.effects.front()->rates(with, set.springs, set.effects.front());
  EXPECT_EQ(rates.damping_per_s, 0);
  EXPECT_EQ(rates.frequency2_per_s2, 0);
  EXPECT_EQ(rates.acceleration_ratio, 1);

  // when they are not, then it does.
  set.effects = {random_parameters(entry.describe(), uniform)};
  const SimulateResult away = simulate(with, {&set, 1}, schedule).front();
  EXPECT_NE(away.position_m.back(), without.position_m.back());
}

inline void expect_to_add_to_what_is_there(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform, entry.name);
  const Parameters parameters = random_parameters(entry.describe(), uniform);
  const Eigen::Matrix3Xd there_n = uniform.vectors(36, 1);

  const Eigen::Matrix3Xd sum_n = force_n(*entry.make(), state, parameters, there_n);

  const Eigen::Matrix3Xd alone_n = force_n(entry, state, parameters);
  EXPECT_LT((sum_n - there_n - alone_n).cwiseAbs().maxCoeff(),
            1e-15 * std::max(1.0, alone_n.cwiseAbs().maxCoeff()) * 4);
}

/// One law, three kinds of lanes: a single simulation to the bit, float to its rounding.
inline void expect_every_kind_of_lanes_to_agree(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform, entry.name);
  const Parameters parameters = random_parameters(entry.describe(), uniform);
  const auto effect = entry.make();
  // What changes a force must have one to change.
  const Eigen::Matrix3Xd there_n = uniform.vectors(36, effect->changes_force() ? 1 : 0);
  const Eigen::Matrix3Xd exact_n = force_n(*effect, state, parameters, there_n);

  EXPECT_EQ(force_n<SingleLane>(*effect, state, parameters, there_n), exact_n);
  EXPECT_LT((force_n<FastLanes>(*effect, state, parameters, there_n) - exact_n).norm(),
            1e-4 * exact_n.norm() + 1e-30);
}

inline void expect_lanes_to_know_nothing_of_each_other(const EffectEntry& entry, Uniform& uniform) {
  const EffectDescription effect = entry.describe();
  Cloth cloth = touched_cloth(5);
  cloth.held = {held_at(cloth.mesh, 0, 0)};
  cloth.add_effect(entry.name, "test");
  std::vector<ParameterSet> sets;
  for (int l = 0; l < kLanes; ++l)
    sets.push_back({.springs = spring_parameters(cotton(), cloth.mesh),
                    .effects = {random_parameters(effect, uniform)},
                    .start_position_m = crumpled_for(entry.name, cloth.mesh, 0.3, uniform)});
  const Schedule schedule{.frame_time_s = {0, 0.02}, .time_step_s = 1e-4};

  const std::vector<SimulateResult> together = simulate(cloth, sets, schedule);

  for (size_t l = 0; l < sets.size(); ++l)
    EXPECT_EQ(together[l].position_m, simulate(cloth, {&sets[l], 1}, schedule).front().position_m)
        << "lane " << l;
}

inline void expect_to_turn_with_the_scene(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform, entry.name);
  const Parameters parameters = random_parameters(entry.describe(), uniform);
  const Eigen::Matrix3d turn = uniform.rotation();
  State turned = state;
  turned.position_m = turn * state.position_m;
  turned.velocity_m_per_s = turn * state.velocity_m_per_s;

  const Eigen::Matrix3Xd expected_n = turn * force_n(entry, state, parameters);

  EXPECT_GT(expected_n.norm(), 0);
  EXPECT_LT((force_n(entry, turned, parameters) - expected_n).norm(), 1e-13 * expected_n.norm());
}

inline void expect_neither_push_nor_torque(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform, entry.name);
  const Eigen::Matrix3Xd f = force_n(entry, state, random_parameters(entry.describe(), uniform));

  EXPECT_GT(f.norm(), 0);
  // Sums of 36 numbers: rounding, a few times the largest.
  const double largest = f.cwiseAbs().maxCoeff();
  EXPECT_LT(f.rowwise().sum().norm(), 1e-14 * largest);
  EXPECT_LT(torque(state.position_m, f).norm(), 1e-14 * largest);
}

/// Tangents, the adjoint and the implicit integrator rest on these.
inline void expect_true_derivatives(const EffectEntry& entry, Uniform& uniform) {
  const EffectDescription effect = entry.describe();
  EXPECT_EQ(derivative_mismatch(*entry.make(), effect, random_parameters(effect, uniform), uniform),
            "");
}

/// The rates that an effect gives must bound what it does to a step, up to a fit's bounds.
inline void expect_the_stable_step_to_be_stable(const EffectEntry& entry, Uniform& uniform) {
  Cloth cloth = touched_cloth(6);
  cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, 0.31, 0.02)};
  cloth.add_effect(entry.name, "test");
  ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh),
                   .effects = {{}},
                   .start_position_m = crumpled_for(entry.name, cloth.mesh, 0.3, uniform)};
  for (const EffectParameter& p : entry.describe().parameters)
    set.effects[0].push_back(uniform(0, 1) < 0.5 ? p.lower : p.upper);

  const double time_step_s = 0.9 * stable_time_step_s(cloth, set);
  const SimulateResult result =
      simulate(cloth, {&set, 1}, {.frame_time_s = {0, 0.3}, .time_step_s = time_step_s}).front();

  EXPECT_TRUE(result.usable()) << testing::PrintToString(set.effects[0]);
}

inline void expect_to_damp_only(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform, entry.name);
  const Parameters parameters = random_parameters(entry.describe(), uniform);

  const double power_w =
      force_n(entry, state, parameters).cwiseProduct(state.velocity_m_per_s).sum();

  EXPECT_LT(power_w, 0);
  // and no faster than it tells those who choose the time step: -F.v <= rate m v^2.
  const SpringParameters springs = spring_parameters(cotton(), state.cloth.mesh);
  EXPECT_LE(-power_w, entry.make()->rates(state.cloth, springs, parameters).damping_per_s * 2 *
                          kinetic_energy_j(state.cloth.mass_kg, state.velocity_m_per_s) *
                          (1 + 1e-12));
}

inline void expect_proportional(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform, entry.name);
  Parameters parameters = random_parameters(entry.describe(), uniform);
  const Eigen::Matrix3Xd once_n = force_n(entry, state, parameters);
  parameters[0] *= 2;
  EXPECT_LT((force_n(entry, state, parameters) - 2 * once_n).norm(), 1e-14 * once_n.norm());
}

}  // namespace effect_contract

/// What every effect must keep, so that diagnosis can ask "is this physics missing?" of each alike:
/// it describes itself, its bounds hold its neutral value, at which it does nothing to the last
/// bit; lanes are separate; its derivatives are those of what it does; the step that its rates
/// allow is stable; and what its traits claim is true.
inline void expect_effect_contract(const std::string& name, const EffectTraits& traits) {
  const EffectEntry& entry = find_effect(name, "test");
  effect_contract::expect_a_complete_description(entry);
  for (const unsigned seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(testing::Message() << name << ", seed " << seed);
    Uniform uniform(seed);
    effect_contract::expect_nothing_at_neutral(entry, uniform);
    if (traits.adds_force) {
      if (!entry.make()->changes_force())
        effect_contract::expect_to_add_to_what_is_there(entry, uniform);
      effect_contract::expect_every_kind_of_lanes_to_agree(entry, uniform);
    }
    effect_contract::expect_lanes_to_know_nothing_of_each_other(entry, uniform);
    effect_contract::expect_true_derivatives(entry, uniform);
    effect_contract::expect_the_stable_step_to_be_stable(entry, uniform);
    if (traits.internal) effect_contract::expect_neither_push_nor_torque(entry, uniform);
    if (traits.isotropic) effect_contract::expect_to_turn_with_the_scene(entry, uniform);
    if (traits.only_damps) effect_contract::expect_to_damp_only(entry, uniform);
    if (traits.proportional) effect_contract::expect_proportional(entry, uniform);
  }
}

}  // namespace clothfit
