#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "model/cloth/stability.h"
#include "model/effects/registry.h"
#include "model/integrate/simulate.h"
#include "tests/model/effect_derivatives.h"
#include "tests/model/mechanics.h"
#include "tests/model/random_cloth.h"
#include "tests/model/touched_cloth.h"

namespace clothfit {

/// The claims of an effect beyond the contract that all of them keep.
struct EffectTraits {
  bool isotropic = false;     ///< its force turns with the scene; it prefers no direction of space
  bool only_damps = false;    ///< its power is never positive
  bool proportional = false;  ///< its force is proportional to its first parameter
  bool internal = false;      ///< between vertices: no force in all, no torque
  bool adds_force = true;     ///< it adds a force that depends on nothing but the present state
};

namespace effect_contract {

using Parameters = std::vector<double>;

inline Parameters neutral(const EffectDescription& effect) {
  Parameters values;
  for (const EffectParameter& p : effect.parameters) values.push_back(p.neutral);
  return values;
}

/// Draws 0, 1 or 2 for a parameter that picks. Of two things that is either or both.
inline double random_pick(Uniform& uniform) {
  return std::floor(uniform(0, 3));
}

/// Draws parameters somewhere within the bounds, a few typical changes away from neutral.
inline Parameters random_parameters(const EffectDescription& effect, Uniform& uniform) {
  Parameters values;
  for (const EffectParameter& p : effect.parameters)
    values.push_back(p.picks ? random_pick(uniform)
                             : uniform(std::max(p.lower, p.neutral - 5 * p.typical),
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

/// Returns the force on every vertex, 3 x vertices (N), as lanes of kind L compute it. `there_n` is
/// the sum of other forces added before.
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

/// The largest eigenvalues, per mass, of the stiffness (1/s2) and the damping (1/s) of effects in a
/// crumpled cloth at rest.
struct Spectrum {
  double frequency2_per_s2 = 0, damping_per_s = 0;
};
Spectrum spectrum(const std::vector<std::pair<const Effect*, Parameters>>& effects,
                  const Cloth& cloth, const Eigen::Matrix3Xd& position_m);

}  // namespace effect_contract

/// Checks what every effect must keep, so that diagnosis can ask "is this physics missing?" of each
/// alike. It describes itself, and its bounds hold its neutral value, at which it does nothing to
/// the last bit. Lanes are separate. Its derivatives are those of its action. The step that its
/// rates allow is stable. Its traits' claims are true.
void expect_effect_contract(const std::string& name, const EffectTraits& traits);

}  // namespace clothfit
