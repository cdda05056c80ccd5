#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "model/effects/registry.h"
#include "model/simulate.h"
#include "tests/model/mechanics.h"
#include "tests/model/random_cloth.h"

namespace clothfit {

/// What an effect claims beyond the contract that all of them keep.
struct EffectTraits {
  bool isotropic = false;     ///< its force turns with the scene; it prefers no direction of space
  bool only_damps = false;    ///< its power is never positive
  bool proportional = false;  ///< its force is proportional to its first parameter
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

inline std::vector<LaneValue<>> every_lane(const Parameters& values) {
  std::vector<LaneValue<>> lanes;
  for (const double value : values) lanes.push_back(LaneValue<>::Constant(value));
  return lanes;
}

struct State {
  Eigen::VectorXd mass_kg;
  Eigen::Matrix3Xd position_m, velocity_m_per_s;

  explicit State(Uniform& uniform)
      : mass_kg(square_cloth(6).mass_kg),
        position_m(crumpled(square_mesh(6), 0.5, uniform)),
        velocity_m_per_s(uniform.vectors(36, 3.0)) {}
};

inline Eigen::Matrix3Xd force_n(const EffectEntry& entry, const State& state,
                                const Parameters& parameters) {
  const LaneVectors<> position_m = clothfit::every_lane(state.position_m);
  const LaneVectors<> velocity_m_per_s = clothfit::every_lane(state.velocity_m_per_s);
  LaneVectors<> force = LaneVectors<>::zero(36);
  entry.make()->add_force({square_mesh(6), position_m, velocity_m_per_s, state.mass_kg, 0.3},
                          every_lane(parameters), force);
  return force.lane(0);
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
  Cloth plain = square_cloth(6);
  plain.held = {held_at(plain.mesh, 0, 0), held_at(plain.mesh, 0.31, 0.02)};
  Cloth with = plain;
  with.add_effect(entry.name, "test");
  ParameterSet set{.springs = spring_parameters(cotton(), plain.mesh),
                   .start_position_m = crumpled(plain.mesh, 0.3, uniform)};
  const Schedule schedule{.frame_time_s = {0, 0.1, 0.2, 0.3}, .time_step_s = 2e-4};
  const SimulateResult without = simulate(plain, {&set, 1}, schedule).front();

  // when its parameters are neutral, then not a bit of the trajectory differs;
  set.effects = {neutral(entry.describe())};
  const SimulateResult at_neutral = simulate(with, {&set, 1}, schedule).front();
  EXPECT_EQ(at_neutral.position_m, without.position_m);
  EXPECT_EQ(with.effects.front()->damping_rate_per_s(with.mesh, with.mass_kg, set.effects.front()),
            0);

  // when they are not, then it does.
  set.effects = {random_parameters(entry.describe(), uniform)};
  const SimulateResult away = simulate(with, {&set, 1}, schedule).front();
  EXPECT_NE(away.position_m.back(), without.position_m.back());
}

inline void expect_to_add_to_what_is_there(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform);
  const Parameters parameters = random_parameters(entry.describe(), uniform);
  const Eigen::Matrix3Xd there_n = uniform.vectors(36, 1);
  const LaneVectors<> position_m = clothfit::every_lane(state.position_m);
  const LaneVectors<> velocity_m_per_s = clothfit::every_lane(state.velocity_m_per_s);
  LaneVectors<> sum_n = clothfit::every_lane(there_n);

  entry.make()->add_force({square_mesh(6), position_m, velocity_m_per_s, state.mass_kg, 0.3},
                          every_lane(parameters), sum_n);

  EXPECT_LT((sum_n.lane(0) - there_n - force_n(entry, state, parameters)).cwiseAbs().maxCoeff(),
            1e-14);
}

inline void expect_lanes_to_know_nothing_of_each_other(const EffectEntry& entry, Uniform& uniform) {
  const EffectDescription effect = entry.describe();
  const Eigen::VectorXd mass_kg = square_cloth(6).mass_kg;
  LaneVectors<> position = LaneVectors<>::zero(36), velocity = position, together = position;
  std::vector<LaneValue<>> values(effect.parameters.size());
  std::vector<State> states;
  std::vector<Parameters> parameters;
  for (int l = 0; l < kLanes; ++l) {
    states.emplace_back(uniform);
    parameters.push_back(random_parameters(effect, uniform));
    position.set_lane(l, states.back().position_m);
    velocity.set_lane(l, states.back().velocity_m_per_s);
    for (size_t p = 0; p < values.size(); ++p) values[p][l] = parameters.back()[p];
  }

  entry.make()->add_force({square_mesh(6), position, velocity, mass_kg, 0.3}, values, together);

  for (int l = 0; l < kLanes; ++l) {
    const auto lane = static_cast<size_t>(l);
    EXPECT_EQ(together.lane(l), force_n(entry, states[lane], parameters[lane])) << "lane " << l;
  }
}

inline void expect_to_turn_with_the_scene(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform);
  const Parameters parameters = random_parameters(entry.describe(), uniform);
  const Eigen::Matrix3d turn = uniform.rotation();
  State turned = state;
  turned.position_m = turn * state.position_m;
  turned.velocity_m_per_s = turn * state.velocity_m_per_s;

  const Eigen::Matrix3Xd expected_n = turn * force_n(entry, state, parameters);

  EXPECT_GT(expected_n.norm(), 0);
  EXPECT_LT((force_n(entry, turned, parameters) - expected_n).norm(), 1e-13 * expected_n.norm());
}

inline void expect_to_damp_only(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform);
  const Parameters parameters = random_parameters(entry.describe(), uniform);

  const double power_w =
      force_n(entry, state, parameters).cwiseProduct(state.velocity_m_per_s).sum();

  EXPECT_LT(power_w, 0);
  // and no faster than it tells those who choose the time step: -F.v <= rate m v^2.
  EXPECT_LE(-power_w, entry.make()->damping_rate_per_s(square_mesh(6), state.mass_kg, parameters) *
                          2 * kinetic_energy_j(state.mass_kg, state.velocity_m_per_s) *
                          (1 + 1e-12));
}

inline void expect_proportional(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform);
  Parameters parameters = random_parameters(entry.describe(), uniform);
  const Eigen::Matrix3Xd once_n = force_n(entry, state, parameters);
  parameters[0] *= 2;
  EXPECT_LT((force_n(entry, state, parameters) - 2 * once_n).norm(), 1e-14 * once_n.norm());
}

}  // namespace effect_contract

/// What every effect must keep, so that diagnosis can ask "is this physics missing?" of each alike:
/// it describes itself, its bounds hold its neutral value, at which it does nothing to the last
/// bit; lanes are separate; and what its traits claim is true.
inline void expect_effect_contract(const std::string& name, const EffectTraits& traits) {
  const EffectEntry& entry = find_effect(name, "test");
  effect_contract::expect_a_complete_description(entry);
  for (const unsigned seed : {1u, 2u, 3u}) {
    SCOPED_TRACE(testing::Message() << name << ", seed " << seed);
    Uniform uniform(seed);
    effect_contract::expect_nothing_at_neutral(entry, uniform);
    effect_contract::expect_to_add_to_what_is_there(entry, uniform);
    effect_contract::expect_lanes_to_know_nothing_of_each_other(entry, uniform);
    if (traits.isotropic) effect_contract::expect_to_turn_with_the_scene(entry, uniform);
    if (traits.only_damps) effect_contract::expect_to_damp_only(entry, uniform);
    if (traits.proportional) effect_contract::expect_proportional(entry, uniform);
  }
}

}  // namespace clothfit
