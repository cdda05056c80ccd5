#include "model/tangent_step.h"

#include <algorithm>

namespace clothfit {
namespace {

using Dual = DualLanes::Number;

LaneValue<DualLanes> dual(double value, const LaneValue<>& tangent) {
  return LaneValue<DualLanes>::Constant(Dual(value, tangent.matrix()));
}

/// Adds a share of the difference of two fields to the derivatives along the direction of one lane.
void add_share(double share, const LaneVectors<SingleLane>& to, const LaneVectors<SingleLane>& from,
               Eigen::Index lane, LaneVectors<>& tangent) {
  tangent.x.row(lane) += share * (to.x - from.x);
  tangent.y.row(lane) += share * (to.y - from.y);
  tangent.z.row(lane) += share * (to.z - from.z);
}

}  // namespace

DualParameters DualParameters::of(const Cloth& cloth, const ParameterSet& set,
                                  std::span<const Direction> directions) {
  DualParameters p;
  p.value = lane_parameters<SingleLane>(cloth, {&set, 1});
  LaneParameters<>& tangent = p.tangent;
  const auto along = [&](const auto& component) {
    LaneValue<> lanes = LaneValue<>::Zero();
    for (size_t d = 0; d < directions.size(); ++d)
      lanes[static_cast<Eigen::Index>(d)] = component(directions[d]);
    return lanes;
  };
  for (size_t type = 0; type < kSpringTypes; ++type) {
    const double natural_m = set.springs.natural_length_m[type];
    const double critical = set.springs.critical_elongation[type];
    tangent.springs.natural_length_m[type] =
        along([&](const Direction& d) { return d.natural_length_m[type]; });
    tangent.springs.stiffness_n_per_m[type] =
        along([&](const Direction& d) { return d.stiffness_n_per_m[type]; });
    tangent.springs.damping_ns_per_m[type] =
        along([&](const Direction& d) { return d.damping_ns_per_m[type]; });
    tangent.limits.longest_m[type] = along([&](const Direction& d) {
      // Where there is no limit nothing changes it.
      return std::isfinite(critical) ? d.natural_length_m[type] * (1 + critical) +
                                           natural_m * d.critical_elongation[type]
                                     : 0.0;
    });
    p.springs.natural_length_m[type] = dual(natural_m, tangent.springs.natural_length_m[type]);
    p.springs.stiffness_n_per_m[type] =
        dual(set.springs.stiffness_n_per_m[type], tangent.springs.stiffness_n_per_m[type]);
    p.springs.damping_ns_per_m[type] =
        dual(set.springs.damping_ns_per_m[type], tangent.springs.damping_ns_per_m[type]);
  }
  const auto gravity = [&](int axis) {
    return along([&](const Direction& d) { return d.gravity_m_per_s2[axis]; });
  };
  tangent.gravity_m_per_s2 = {gravity(0), gravity(1), gravity(2)};
  p.gravity_m_per_s2 = {dual(set.gravity_m_per_s2.x(), tangent.gravity_m_per_s2.x),
                        dual(set.gravity_m_per_s2.y(), tangent.gravity_m_per_s2.y),
                        dual(set.gravity_m_per_s2.z(), tangent.gravity_m_per_s2.z)};
  for (size_t e = 0; e < cloth.effects.size(); ++e) {
    p.effects.emplace_back();
    for (size_t n = 0; n < set.effects[e].size(); ++n)
      p.effects.back().push_back(dual(set.effects[e][n], along([&](const Direction& d) {
                                        return d.effects.empty() || d.effects[e].empty()
                                                   ? 0.0
                                                   : d.effects[e][n];
                                      })));
  }
  return p;
}

LaneState<DualLanes> start_of(const Cloth& cloth, const ParameterSet& set,
                              std::span<const Direction> directions) {
  LaneState<DualLanes> state = LaneState<DualLanes>::of(cloth);
  state.position_m.value.set_lane(0, set.start_position_m);
  if (set.start_velocity_m_per_s.cols() > 0)
    state.velocity_m_per_s.value.set_lane(0, set.start_velocity_m_per_s);
  for (size_t d = 0; d < directions.size(); ++d) {
    const auto lane = static_cast<int>(d);
    if (directions[d].start_position_m.cols() > 0)
      state.position_m.tangent.set_lane(lane, directions[d].start_position_m);
    if (directions[d].start_velocity_m_per_s.cols() > 0)
      state.velocity_m_per_s.tangent.set_lane(lane, directions[d].start_velocity_m_per_s);
  }
  for (size_t e = 0; e < set.start_effect_memory.size(); ++e)
    for (Eigen::Index n = 0; n < set.start_effect_memory[e].size(); ++n)
      state.effect_memory[e](0, n).a = set.start_effect_memory[e][n];
  for (size_t d = 0; d < directions.size(); ++d)
    for (size_t e = 0; e < directions[d].start_effect_memory.size(); ++e)
      for (Eigen::Index n = 0; n < directions[d].start_effect_memory[e].size(); ++n)
        state.effect_memory[e](0, n).v[static_cast<Eigen::Index>(d)] =
            directions[d].start_effect_memory[e][n];
  return state;
}

TangentStepper::TangentStepper(const Cloth& cloth, std::span<const Direction> directions)
    : cloth_(cloth),
      inverse_mass_per_kg_(cloth.mass_kg.cwiseInverse()),
      held_value_(cloth),
      held_tangent_(cloth),
      sweep_(cloth.mesh),
      tangent_sweep_(cloth.mesh),
      limiter_(cloth.mesh, movable_inverse_mass(cloth, held_value_.touched())),
      force_n_(LaneVectors<DualLanes>::zero(cloth.mesh.vertex_count())),
      pull_n_(LaneVectors<DualLanes>::zero(held_value_.count())),
      target_m_(pull_n_),
      memory_(LaneState<SingleLane>::of(cloth).effect_memory),
      emerged_n_(force_n_.value),
      emerged_target_m_(target_m_.value) {
  const auto note = [&](const Effect& effect) {
    changes_force_ = changes_force_ || effect.changes_force();
    shifts_supports_ = shifts_supports_ || effect.shifts_supports();
  };
  for (const std::shared_ptr<const Effect>& effect : cloth.effects) note(*effect);
  for (size_t d = 0; d < directions.size(); ++d) {
    if (!directions[d].emerging) continue;
    const EmergingEffect& from = *directions[d].emerging;
    note(*from.effect);
    Emerging emerging{.effect = from.effect,
                      .lane = static_cast<Eigen::Index>(d),
                      .per_change = 1 / from.change,
                      .parameters = {},
                      .memory = EffectMemory<SingleLane>::Zero(1, from.effect->memory_size(cloth))};
    for (const double value : from.parameters)
      emerging.parameters.push_back(LaneValue<SingleLane>::Constant(value));
    if (from.start_memory.size() > 0) emerging.memory.row(0) = from.start_memory.array();
    emerging_.push_back(std::move(emerging));
  }
}

Eigen::VectorXd TangentStepper::emerging_memory(size_t direction) const {
  for (const Emerging& emerging : emerging_)
    if (emerging.lane == static_cast<Eigen::Index>(direction))
      return emerging.memory.row(0).matrix();
  return {};
}

LaneVectors<DualLanes> TangentStepper::locate(const LaneVectors<DualLanes>& position_m) const {
  return {held_value_.locate(position_m.value), held_tangent_.locate(position_m.tangent)};
}

void TangentStepper::step(const DualParameters& parameters,
                          const LaneVectors<DualLanes>& held_target_m, double time_s,
                          double time_step_s, LaneState<DualLanes>& state) {
  LaneVectors<DualLanes>&position = state.position_m, &velocity = state.velocity_m_per_s;
  const size_t effects = cloth_.effects.size();
  const EffectScene<DualLanes> scene{cloth_,     parameters.springs, parameters.gravity_m_per_s2,
                                     position,   velocity,           time_s,
                                     time_step_s};
  const EffectScene<SingleLane> value_scene{
      cloth_,         parameters.value.springs, parameters.value.gravity_m_per_s2,
      position.value, velocity.value,           time_s,
      time_step_s};
  // Dual numbers round their values in other places (a / b as a times 1 / b): what the simulation
  // goes on with is computed as simulate() does, from the same memory.
  for (size_t e = 0; e < effects; ++e)
    for (Eigen::Index n = 0; n < memory_[e].cols(); ++n)
      memory_[e](0, n) = state.effect_memory[e](0, n).a;
  const auto keep_memory = [&](size_t e) {
    for (Eigen::Index n = 0; n < memory_[e].cols(); ++n)
      state.effect_memory[e](0, n).a = memory_[e](0, n);
  };
  force_n_.set_zero();
  for (size_t e = 0; e < effects; ++e) {
    const Effect& effect = *cloth_.effects[e];
    force_before_ = force_n_.value;
    effect.add_force(scene, parameters.effects[e], state.effect_memory[e], force_n_);
    force_n_.value = force_before_;
    effect.add_force(value_scene, parameters.value.effects[e], memory_[e], force_n_.value);
    keep_memory(e);
  }
  for (Emerging& emerging : emerging_) {
    emerged_n_ = force_n_.value;
    emerging.effect->add_force(value_scene, emerging.parameters, emerging.memory, emerged_n_);
    add_share(emerging.per_change, emerged_n_, force_n_.value, emerging.lane, force_n_.tangent);
  }

  const TangentSweep::State at{parameters.value.springs, position.value, velocity.value};
  const bool fused = !changes_force_ && !shifts_supports_;
  const LaneVectors<DualLanes>* target_m = &held_target_m;
  if (fused) {
    tangent_sweep_.step_euler(at, parameters.tangent.springs, parameters.tangent.gravity_m_per_s2,
                              inverse_mass_per_kg_,
                              effects + emerging_.size() > 0 ? &force_n_.tangent : nullptr,
                              time_step_s, position.tangent, velocity.tangent);
    sweep_.step_euler(parameters.value.springs, parameters.value.gravity_m_per_s2,
                      inverse_mass_per_kg_, effects > 0 ? &force_n_.value : nullptr, time_step_s,
                      position.value, velocity.value);
  } else {
    tangent_sweep_.add_spring_forces(at, parameters.tangent.springs, position.tangent,
                                     velocity.tangent, force_n_.tangent);
    sweep_.add_spring_forces(parameters.value.springs, position.value, velocity.value,
                             force_n_.value);
    if (shifts_supports_) {
      pull_n_.set_zero();
      held_value_.add_pulls(force_n_.value, parameters.value.gravity_m_per_s2, pull_n_.value);
      held_tangent_.add_pulls(force_n_.tangent, parameters.tangent.gravity_m_per_s2,
                              pull_n_.tangent);
      target_m_ = held_target_m;
      for (size_t e = 0; e < effects; ++e) {
        const Effect& effect = *cloth_.effects[e];
        if (!effect.shifts_supports()) continue;
        target_before_ = target_m_.value;
        effect.shift_supports(scene, parameters.effects[e], pull_n_, state.effect_memory[e],
                              target_m_);
        target_m_.value = target_before_;
        effect.shift_supports(value_scene, parameters.value.effects[e], pull_n_.value, memory_[e],
                              target_m_.value);
        keep_memory(e);
      }
      for (Emerging& emerging : emerging_) {
        if (!emerging.effect->shifts_supports()) continue;
        emerged_target_m_ = target_m_.value;
        emerging.effect->shift_supports(value_scene, emerging.parameters, pull_n_.value,
                                        emerging.memory, emerged_target_m_);
        add_share(emerging.per_change, emerged_target_m_, target_m_.value, emerging.lane,
                  target_m_.tangent);
      }
      target_m = &target_m_;
    }
    for (size_t e = 0; e < effects; ++e) {
      const Effect& effect = *cloth_.effects[e];
      if (!effect.changes_force()) continue;
      force_before_ = force_n_.value;
      effect.change_force(scene, parameters.effects[e], force_n_);
      force_n_.value = force_before_;
      effect.change_force(value_scene, parameters.value.effects[e], force_n_.value);
    }
    for (const Emerging& emerging : emerging_) {
      if (!emerging.effect->changes_force()) continue;
      emerged_n_ = force_n_.value;
      emerging.effect->change_force(value_scene, emerging.parameters, emerged_n_);
      add_share(emerging.per_change, emerged_n_, force_n_.value, emerging.lane, force_n_.tangent);
    }
    move_by_forces(force_n_.tangent, parameters.tangent.gravity_m_per_s2, inverse_mass_per_kg_,
                   time_step_s, position.tangent, velocity.tangent);
    move_by_forces(force_n_.value, parameters.value.gravity_m_per_s2, inverse_mass_per_kg_,
                   time_step_s, position.value, velocity.value);
  }
  held_tangent_.place(target_m->tangent, time_step_s, position.tangent, velocity.tangent);
  held_value_.place(target_m->value, time_step_s, position.value, velocity.value);
  apply_limit(parameters, time_step_s, state);
}

void TangentStepper::apply_limit(const DualParameters& parameters, double time_step_s,
                                 LaneState<DualLanes>& state) {
  const StrainLimit& limit = cloth_.strain_limit;
  if (limit.mode == StrainLimitMode::off) return;
  LaneVectors<DualLanes>&position = state.position_m, &velocity = state.velocity_m_per_s;
  const bool correct_velocity = limit.mode == StrainLimitMode::consistent;
  moves_.clear();
  limiter_.limit(limit, parameters.value.limits, time_step_s, position.value, velocity.value,
                 &moves_);

  // With longest the length a spring may have, its ends move by shares of (1 - longest / l) L:
  //   d((1 - longest / l) L) = (1 - longest / l) dL + (longest / l^3 (L . dL) - dlongest / l) L
  LaneVectors<>&p = position.tangent, &v = velocity.tangent;
  for (const LimitMove& move : moves_) {
    const int a = move.first, b = move.second;
    const Eigen::Vector3d& along = move.along_m;
    const LaneValue<> dx = p.x.col(b) - p.x.col(a), dy = p.y.col(b) - p.y.col(a),
                      dz = p.z.col(b) - p.z.col(a);
    const LaneValue<> stretch =
        (1 - move.excess) * move.inverse_length_per_m * move.inverse_length_per_m *
            (along.x() * dx + along.y() * dy + along.z() * dz) -
        move.inverse_length_per_m *
            parameters.tangent.limits.longest_m[static_cast<size_t>(move.type)];
    const auto shift = [&](LaneArray<>& place, LaneArray<>& speed, const LaneValue<>& d,
                           double component) {
      const LaneValue<> change = move.excess * d + component * stretch;
      place.col(a) += move.first_share * change;
      place.col(b) -= move.second_share * change;
      if (!correct_velocity) return;
      speed.col(a) += move.first_share / time_step_s * change;
      speed.col(b) -= move.second_share / time_step_s * change;
    };
    shift(p.x, v.x, dx, along.x());
    shift(p.y, v.y, dy, along.y());
    shift(p.z, v.z, dz, along.z());
  }
}

}  // namespace clothfit
