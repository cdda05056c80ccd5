#include "tests/model/effect_contract.h"

#include <gtest/gtest.h>

#include "model/cloth/network_bound.h"
#include "model/cloth/stability.h"
#include "model/effects/registry.h"
#include "model/integrate/simulate.h"
#include "tests/model/effect_derivatives.h"
#include "tests/model/plain_springs.h"

namespace clothfit {
namespace effect_contract {

Spectrum spectrum(const std::vector<std::pair<const Effect*, Parameters>>& effects,
                  const Cloth& cloth, const Eigen::Matrix3Xd& position_m) {
  const int count = static_cast<int>(position_m.size());
  Eigen::MatrixXd by_position = Eigen::MatrixXd::Zero(count, count), by_velocity = by_position;
  for (const auto& [effect, parameters] : effects) {
    const EffectMap map(*effect, cloth, static_cast<int>(parameters.size()), EffectDeed::add_force);
    const Eigen::MatrixXd jacobian = map.stated_jacobian(
        map.input(position_m, at_rest(position_m), spring_parameters(cotton(), cloth.mesh),
                  {0, 0, -9.81}, parameters));
    by_position += jacobian.topLeftCorner(count, count);
    by_velocity += jacobian.block(0, map.first_velocity(), count, count);
  }
  const Eigen::VectorXd per_root_kg =
      cloth.mass_kg.transpose().replicate(3, 1).reshaped().cwiseSqrt().cwiseInverse();
  const auto largest = [&](const Eigen::MatrixXd& block) {
    // Forces with an energy, and dashpots at rest, have a symmetric derivative.
    EXPECT_LT((block - block.transpose()).norm(), 1e-12 * block.norm() + 1e-30);
    const Eigen::MatrixXd per_kg = per_root_kg.asDiagonal() * -block * per_root_kg.asDiagonal();
    return per_kg.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff();
  };
  return {largest(by_position), largest(by_velocity)};
}

namespace {

void expect_a_complete_description(const EffectEntry& entry) {
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

void expect_nothing_at_neutral(const EffectEntry& entry, Uniform& uniform) {
  // Given a swinging cloth with the effect and one without,
  Cloth plain = touched_cloth(6);
  plain.held = drifting_points(plain.mesh);
  Cloth with = plain;
  add_effect(with, entry.name, "test");
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

void expect_to_add_to_what_is_there(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform, entry.name);
  const Parameters parameters = random_parameters(entry.describe(), uniform);
  const Eigen::Matrix3Xd there_n = uniform.vectors(36, 1);

  const Eigen::Matrix3Xd sum_n = force_n(*entry.make(), state, parameters, there_n);

  const Eigen::Matrix3Xd alone_n = force_n(entry, state, parameters);
  EXPECT_LT((sum_n - there_n - alone_n).cwiseAbs().maxCoeff(),
            1e-15 * std::max(1.0, alone_n.cwiseAbs().maxCoeff()) * 4);
}

/// Expects one law in three kinds of lanes: a single simulation to the bit, float to its rounding.
void expect_every_kind_of_lanes_to_agree(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform, entry.name);
  const Parameters parameters = random_parameters(entry.describe(), uniform);
  const auto effect = entry.make();
  // An effect that changes a force must have one to change.
  const Eigen::Matrix3Xd there_n = uniform.vectors(36, effect->changes_force() ? 1 : 0);
  const Eigen::Matrix3Xd exact_n = force_n(*effect, state, parameters, there_n);

  EXPECT_EQ(force_n<SingleLane>(*effect, state, parameters, there_n), exact_n);
  EXPECT_LT((force_n<FastLanes>(*effect, state, parameters, there_n) - exact_n).norm(),
            1e-4 * exact_n.norm() + 1e-30);
}

void expect_lanes_to_know_nothing_of_each_other(const EffectEntry& entry, Uniform& uniform) {
  const EffectDescription effect = entry.describe();
  Cloth cloth = touched_cloth(5);
  cloth.held = drifting_points(cloth.mesh);
  add_effect(cloth, entry.name, "test");
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

void expect_to_turn_with_the_scene(const EffectEntry& entry, Uniform& uniform) {
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

void expect_neither_push_nor_torque(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform, entry.name);
  const Eigen::Matrix3Xd f = force_n(entry, state, random_parameters(entry.describe(), uniform));

  EXPECT_GT(f.norm(), 0);
  // The tolerance is rounding of sums of 36 numbers, a few times the largest.
  const double largest = f.cwiseAbs().maxCoeff();
  EXPECT_LT(f.rowwise().sum().norm(), 1e-14 * largest);
  EXPECT_LT(torque(state.position_m, f).norm(), 1e-14 * largest);
}

/// Expects true derivatives: tangents, the adjoint and the implicit integrator rest on these.
void expect_true_derivatives(const EffectEntry& entry, Uniform& uniform) {
  const EffectDescription effect = entry.describe();
  EXPECT_EQ(derivative_mismatch(*entry.make(), effect, random_parameters(effect, uniform), uniform),
            "");
}

/// Expects the rates of an effect to bound its action on a step, up to a fit's bounds.
void expect_the_stable_step_to_be_stable(const EffectEntry& entry, Uniform& uniform) {
  Cloth cloth = touched_cloth(6);
  cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, 0.31, 0.02)};
  add_effect(cloth, entry.name, "test");
  ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh),
                   .effects = {{}},
                   .start_position_m = crumpled_for(entry.name, cloth.mesh, 0.3, uniform)};
  for (const EffectParameter& p : entry.describe().parameters)
    set.effects[0].push_back(p.picks               ? random_pick(uniform)
                             : uniform(0, 1) < 0.5 ? p.lower
                                                   : p.upper);

  const double time_step_s = 0.9 * stable_time_step_s(cloth, set);
  const SimulateResult result =
      simulate(cloth, {&set, 1}, {.frame_time_s = {0, 0.3}, .time_step_s = time_step_s}).front();

  EXPECT_TRUE(result.usable()) << testing::PrintToString(set.effects[0]);
}

/// Expects rates of an effect inside the fabric to bound the spectrum. Springs and effect together
/// must be no stiffer and damp no more than the stable step allows.
void expect_rates_to_bound_the_spectrum(const EffectEntry& entry, Uniform& uniform) {
  const Cloth cloth = touched_cloth(6);
  const SpringParameters springs = spring_parameters(cotton(), cloth.mesh);
  const Parameters parameters = random_parameters(entry.describe(), uniform);
  const SpringLawEffect<PlainSprings> plain;
  const auto effect = entry.make();

  const Spectrum both = spectrum({{&plain, {}}, {effect.get(), parameters}}, cloth,
                                 crumpled_for(entry.name, cloth.mesh, 0.3, uniform));

  const auto bound = [&](const std::array<double, kSpringTypes>& constant) {
    return network_bound(
        cloth, [&](SpringType type, const Spring&) { return constant[static_cast<size_t>(type)]; });
  };
  const EffectRates rates = effect->rates(cloth, springs, parameters);
  EXPECT_LE(both.frequency2_per_s2, bound(springs.stiffness_n_per_m) + rates.frequency2_per_s2);
  EXPECT_LE(both.damping_per_s, bound(springs.damping_ns_per_m) + rates.damping_per_s);
}

void expect_to_damp_only(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform, entry.name);
  const Parameters parameters = random_parameters(entry.describe(), uniform);

  const double power_w =
      force_n(entry, state, parameters).cwiseProduct(state.velocity_m_per_s).sum();

  EXPECT_LT(power_w, 0);
  // It damps no faster than it tells those who choose the time step: -F.v <= rate m v^2.
  const SpringParameters springs = spring_parameters(cotton(), state.cloth.mesh);
  EXPECT_LE(-power_w, entry.make()->rates(state.cloth, springs, parameters).damping_per_s * 2 *
                          kinetic_energy_j(state.cloth.mass_kg, state.velocity_m_per_s) *
                          (1 + 1e-12));
}

void expect_proportional(const EffectEntry& entry, Uniform& uniform) {
  const State state(uniform, entry.name);
  Parameters parameters = random_parameters(entry.describe(), uniform);
  const Eigen::Matrix3Xd once_n = force_n(entry, state, parameters);
  parameters[0] *= 2;
  EXPECT_LT((force_n(entry, state, parameters) - 2 * once_n).norm(), 1e-14 * once_n.norm());
}

}  // namespace
}  // namespace effect_contract

void expect_effect_contract(const std::string& name, const EffectTraits& traits) {
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
    if (traits.internal) {
      effect_contract::expect_neither_push_nor_torque(entry, uniform);
      effect_contract::expect_rates_to_bound_the_spectrum(entry, uniform);
    }
    if (traits.isotropic) effect_contract::expect_to_turn_with_the_scene(entry, uniform);
    if (traits.only_damps) effect_contract::expect_to_damp_only(entry, uniform);
    if (traits.proportional) effect_contract::expect_proportional(entry, uniform);
  }
}

}  // namespace clothfit
