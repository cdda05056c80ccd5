#pragma once

#include <algorithm>
#include <vector>

#include "model/effects/registry.h"
#include "model/integrate/tangents.h"
#include "tests/model/effect_contract.h"
#include "tests/model/random_cloth.h"

namespace clothfit {

/// A swinging cloth with one point held at a vertex, one between vertices, one that is moved.
struct Swing {
  Cloth cloth = touched_cloth(6);
  ParameterSet set;
  Schedule schedule{.frame_time_s = {0, 0.03, 0.05, 0.1}, .time_step_s = 5e-4};

  explicit Swing(Uniform& uniform) {
    cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, 0.31, 0.02),
                  held_at(cloth.mesh, 0.4, 0.4)};
    cloth.held.back().motion = [](double time_s) {
      return Eigen::Vector3d(0.4 - 0.3 * time_s, 0.39, 0.1 * time_s);
    };
    set = {.springs = spring_parameters(random_fabric(uniform), cloth.mesh),
           .gravity_m_per_s2 = {0.3, 9.0, -2.0},
           .start_position_m = crumpled(cloth.mesh, 0.1, uniform),
           .start_velocity_m_per_s = uniform.vectors(36, 0.5)};
  }
};

/// Returns something for every effect to remember.
inline std::vector<Eigen::VectorXd> random_memory(const Cloth& cloth, Uniform& uniform) {
  std::vector<Eigen::VectorXd> memory;
  for (const std::shared_ptr<const Effect>& effect : cloth.effects) {
    memory.emplace_back(effect->memory_size(cloth));
    for (double& number : memory.back()) number = uniform(-5e-3, 5e-3);
  }
  return memory;
}

/// Makes the swing under one more effect, some typical changes away from neutral. It remembers
/// something where it has a memory.
inline Swing swing_under(const EffectEntry& entry, Uniform& uniform) {
  Swing swing(uniform);
  add_effect(swing.cloth, entry.name, "test");
  swing.set.effects = {effect_contract::random_parameters(entry.describe(), uniform)};
  swing.schedule = {.frame_time_s = {0, 0.004, 0.01}, .time_step_s = 2e-4};
  swing.set.start_position_m = crumpled_for(entry.name, swing.cloth.mesh, 0.1, uniform);
  swing.set.start_effect_memory = random_memory(swing.cloth, uniform);
  return swing;
}

/// An effect that a cloth may come to have, with its amplitude.
struct EmergingParameter {
  const char* effect;
  const char* amplitude;
};

/// Holds the way from neutral along an amplitude for two cloths. One does not have the effect. The
/// other is the same cloth with the effect behind its own ones, at its neutral values.
struct TwoWays {
  Direction emerging, present;
  Cloth cloth;       ///< the one that has the effect
  ParameterSet set;  ///< its own

  TwoWays(const Cloth& without, const ParameterSet& own, const EmergingParameter& parameter)
      : cloth(without), set(own) {
    add_effect(cloth, parameter.effect, "test");
    const EffectDescription& effect = cloth.effect_descriptions.back();
    set.effects.push_back(effect_contract::neutral(effect));
    for (const std::vector<double>& values : set.effects)
      present.effects.emplace_back(values.size(), 0.0);
    const auto amplitude =
        std::ranges::find(effect.parameters, parameter.amplitude, &EffectParameter::name);
    const auto p = static_cast<size_t>(amplitude - effect.parameters.begin());
    present.effects.back()[p] = 1;
    emerging.emerging = EmergingEffect{.effect = cloth.effects.back(),
                                       .parameters = set.effects.back(),
                                       .change = 1e-5 * amplitude->typical,
                                       .start_memory = {}};
    emerging.emerging->parameters[p] += emerging.emerging->change;
  }
};

inline Direction random_direction(const Cloth& cloth, Uniform& uniform) {
  Direction d;
  for (size_t type = 0; type < kSpringTypes; ++type) {
    d.natural_length_m[type] = uniform(-0.01, 0.01);
    d.stiffness_n_per_m[type] = uniform(-5, 5);
    d.damping_ns_per_m[type] = uniform(-0.01, 0.01);
    d.critical_elongation[type] = uniform(-0.01, 0.01);
  }
  d.gravity_m_per_s2 = uniform.vectors(1, 1);
  for (const EffectDescription& effect : cloth.effect_descriptions) {
    d.effects.emplace_back();
    for (const EffectParameter& p : effect.parameters)
      d.effects.back().push_back(p.typical * uniform(-1, 1));
  }
  d.start_position_m = uniform.vectors(cloth.mesh.vertex_count(), 0.01);
  d.start_velocity_m_per_s = uniform.vectors(cloth.mesh.vertex_count(), 0.1);
  d.start_effect_memory = random_memory(cloth, uniform);
  const Eigen::Vector3d drift = uniform.vectors(1, 0.1);
  d.held_motion.resize(cloth.held.size());
  for (size_t h = 0; h < cloth.held.size(); ++h)
    if (cloth.held[h].motion)
      d.held_motion[h] = [drift](double time_s) -> Eigen::Vector3d { return time_s * drift; };
  return d;
}

}  // namespace clothfit
