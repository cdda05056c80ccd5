#pragma once

#include <functional>
#include <string>
#include <vector>

#include "model/effects/registry.h"
#include "tests/model/effect_contract.h"

namespace clothfit {

/// A cloth of cotton on which one effect acts, for closed forms and conservation laws.
struct ClothWithEffect {
  Cloth cloth;
  ParameterSet set;

  ClothWithEffect(const Cloth& bare, const std::string& effect, std::vector<double> parameters,
                  const Eigen::Matrix3Xd& start_position_m)
      : cloth(bare) {
    add_effect(cloth, effect, "test");
    set.springs = spring_parameters(cotton(), cloth.mesh);
    set.effects = {std::move(parameters)};
    set.start_position_m = start_position_m;
  }

  struct State {
    Eigen::Matrix3Xd position_m, velocity_m_per_s;
  };
  /// Takes `steps` steps from rest; `watch(step, state)` is called after each, if given.
  State after(int steps, double time_step_s,
              const std::function<void(int, const State&)>& watch = {}) const {
    SteppedCloth<> run(cloth, set, velocity_m_per_s());
    for (int n = 1; n <= steps; ++n) {
      run.step(time_step_s);
      if (watch) watch(n, {run.position_m(), run.velocity_m_per_s()});
    }
    return {run.position_m(), run.velocity_m_per_s()};
  }

  /// Returns the effect's force on every vertex in the given state at 0.3 s, 3 x vertices (N).
  Eigen::Matrix3Xd force_n(const Eigen::Matrix3Xd& position_m,
                           const Eigen::Matrix3Xd& velocity_m_per_s) const {
    Uniform unused(0);
    effect_contract::State state(unused);
    state.cloth = cloth;
    state.position_m = position_m;
    state.velocity_m_per_s = velocity_m_per_s;
    return effect_contract::force_n(*cloth.effects.front(), state, set.effects.front(),
                                    at_rest(position_m));
  }

  EffectRates rates() const {
    return cloth.effects.front()->rates(cloth, set.springs, set.effects.front());
  }

 private:
  Eigen::Matrix3Xd velocity_m_per_s() const {
    return set.start_velocity_m_per_s.cols() > 0 ? set.start_velocity_m_per_s
                                                 : at_rest(set.start_position_m);
  }
};

/// Return attitudes of a flat cloth: facing up, and standing upright with its rows along x and its
/// normal along -y.
inline Eigen::Matrix3d lying() {
  return Eigen::Matrix3d::Identity();
}
inline Eigen::Matrix3d upright() {
  Eigen::Matrix3d turn;
  turn << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return turn;
}

}  // namespace clothfit
