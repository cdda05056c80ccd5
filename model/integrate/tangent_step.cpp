#include "model/integrate/tangent_step.h"

#include <algorithm>

namespace clothfit {
namespace {

/// Returns the tangents of one group: at most as many directions as lanes.
template <class L>
LaneParameters<L> tangents_of(const Cloth& cloth, const ParameterSet& set,
                              std::span<const Direction> directions) {
  LaneParameters<L> tangent;
  const auto along = [&](const auto& component) {
    LaneValue<L> lanes = LaneValue<L>::Zero();
    for (size_t d = 0; d < directions.size(); ++d)
      lanes[static_cast<Eigen::Index>(d)] =
          static_cast<typename L::Number>(component(directions[d]));
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
      // Without a limit nothing changes the longest length.
      return std::isfinite(critical) ? d.natural_length_m[type] * (1 + critical) +
                                           natural_m * d.critical_elongation[type]
                                     : 0.0;
    });
  }
  const auto gravity = [&](int axis) {
    return along([&](const Direction& d) { return d.gravity_m_per_s2[axis]; });
  };
  tangent.gravity_m_per_s2 = {gravity(0), gravity(1), gravity(2)};
  for (size_t e = 0; e < cloth.effects.size(); ++e) {
    tangent.effects.emplace_back();
    for (size_t n = 0; n < set.effects[e].size(); ++n)
      tangent.effects.back().push_back(along([&](const Direction& d) {
        return d.effects.empty() || d.effects[e].empty() ? 0.0 : d.effects[e][n];
      }));
  }
  return tangent;
}

template <class L>
size_t groups_of(std::span<const Direction> directions) {
  return std::max<size_t>(1, (directions.size() + L::kCount - 1) / L::kCount);
}

template <class L>
std::span<const Direction> group_of(std::span<const Direction> directions, size_t group) {
  const size_t first = std::min(group * L::kCount, directions.size());
  return directions.subspan(first, std::min<size_t>(L::kCount, directions.size() - first));
}

/// Returns a number in the precision of the lanes.
template <class L>
typename L::Number in_lanes(double value) {
  return static_cast<typename L::Number>(value);
}

/// action += derivative * change in every lane.
template <class L, class Change>
void add_product(const Eigen::Vector3d& derivative_exactly, const Change& change, int on,
                 LaneVectors<L>& action) {
  const Eigen::Vector3<typename L::Number> derivative =
      derivative_exactly.template cast<typename L::Number>();
  action.x.col(on) += derivative.x() * change;
  action.y.col(on) += derivative.y() * change;
  action.z.col(on) += derivative.z() * change;
}

template <class L>
LaneValue<L> product(const Eigen::RowVector3d& derivative_exactly, const LaneVectors<L>& vectors,
                     int of) {
  const Eigen::RowVector3<typename L::Number> derivative =
      derivative_exactly.template cast<typename L::Number>();
  return derivative.x() * vectors.x.col(of) + derivative.y() * vectors.y.col(of) +
         derivative.z() * vectors.z.col(of);
}

/// Returns the change of the parameter with a ParameterNumber.
template <class L>
const LaneValue<L>& parameter_change(const LaneParameters<L>& tangent, size_t effect, int number) {
  const auto of_type = [](int from) { return static_cast<size_t>(from % kSpringTypes); };
  if (number < ParameterNumber::stiffness(0))
    return tangent.springs.natural_length_m[of_type(number)];
  if (number < ParameterNumber::damping(0))
    return tangent.springs.stiffness_n_per_m[of_type(number)];
  if (number < ParameterNumber::gravity(0))
    return tangent.springs.damping_ns_per_m[of_type(number)];
  if (number == ParameterNumber::gravity(0)) return tangent.gravity_m_per_s2.x;
  if (number == ParameterNumber::gravity(1)) return tangent.gravity_m_per_s2.y;
  if (number == ParameterNumber::gravity(2)) return tangent.gravity_m_per_s2.z;
  return tangent.effects[effect][static_cast<size_t>(number - ParameterNumber::own(0))];
}

/// Finds the parameter numbers that change along any direction.
template <class L>
void find_changing(const TangentParameters<L>& parameters, size_t effect,
                   std::vector<bool>& changing) {
  const auto own = static_cast<int>(parameters.value.effects[effect].size());
  changing.assign(static_cast<size_t>(ParameterNumber::own(own)), false);
  for (int number = 0; number < ParameterNumber::own(own); ++number)
    for (const LaneParameters<L>& tangent : parameters.tangent)
      if ((parameter_change(tangent, effect, number) != 0).any())
        changing[static_cast<size_t>(number)] = true;
}

/// Adds a share of the difference of two fields to the derivatives along the direction of one lane.
template <class L>
void add_share(double share, const LaneVectors<SingleLane>& to, const LaneVectors<SingleLane>& from,
               Eigen::Index lane, LaneVectors<L>& tangent) {
  const auto add = [&](LaneArray<L>& sum, const LaneArray<SingleLane>& a,
                       const LaneArray<SingleLane>& b) {
    sum.row(lane) += (share * (a - b)).template cast<typename L::Number>();
  };
  add(tangent.x, to.x, from.x);
  add(tangent.y, to.y, from.y);
  add(tangent.z, to.z, from.z);
}

}  // namespace

template <class L>
TangentParameters<L> TangentParameters<L>::of(const Cloth& cloth, const ParameterSet& set,
                                              std::span<const Direction> directions) {
  TangentParameters<L> parameters{.value = lane_parameters<SingleLane>(cloth, {&set, 1}),
                                  .tangent = {}};
  for (size_t g = 0; g < groups_of<L>(directions); ++g)
    parameters.tangent.push_back(tangents_of<L>(cloth, set, group_of<L>(directions, g)));
  return parameters;
}

template <class L>
TangentState<L> TangentState<L>::of(const Cloth& cloth, const ParameterSet& set,
                                    std::span<const Direction> directions) {
  TangentState<L> state{.value = LaneState<SingleLane>::of(cloth), .tangent = {}};
  set_start(0, set, state.value);
  for (size_t g = 0; g < groups_of<L>(directions); ++g) {
    LaneState<L>& tangent = state.tangent.emplace_back(LaneState<L>::of(cloth));
    const std::span<const Direction> group = group_of<L>(directions, g);
    for (size_t d = 0; d < group.size(); ++d) {
      const auto lane = static_cast<int>(d);
      if (group[d].start_position_m.cols() > 0)
        tangent.position_m.set_lane(lane, group[d].start_position_m);
      if (group[d].start_velocity_m_per_s.cols() > 0)
        tangent.velocity_m_per_s.set_lane(lane, group[d].start_velocity_m_per_s);
      for (size_t e = 0; e < group[d].start_effect_memory.size(); ++e)
        tangent.effect_memory[e].row(lane) =
            group[d].start_effect_memory[e].transpose().array().template cast<typename L::Number>();
    }
  }
  return state;
}

template <class L>
TangentStepper<L>::TangentStepper(const Cloth& cloth, std::span<const Direction> directions,
                                  double kept_s)
    : cloth_(cloth),
      inverse_mass_per_kg_(cloth.mass_kg.cwiseInverse()),
      held_value_(cloth),
      held_tangent_(cloth),
      sweep_(cloth.mesh),
      tangent_sweep_(cloth.mesh),
      limiter_(cloth.mesh, movable_inverse_mass(cloth, held_value_.touched())),
      next_memory_(LaneState<L>::of(cloth).effect_memory),
      of_forces_(cloth.effects.size()),
      of_changes_(cloth.effects.size()),
      changed_n_(LaneVectors<L>::zero(cloth.mesh.vertex_count())) {
  const auto zero = [&](int count) {
    return TangentVectors<L>{
        LaneVectors<SingleLane>::zero(count),
        std::vector<LaneVectors<L>>(groups_of<L>(directions), LaneVectors<L>::zero(count))};
  };
  force_n_ = zero(cloth.mesh.vertex_count());
  pull_n_ = target_m_ = zero(held_value_.count());
  emerged_n_ = force_n_.value;
  emerged_target_m_ = target_m_.value;
  const auto note = [&](const Effect& effect) {
    changes_force_ = changes_force_ || effect.changes_force();
    shifts_supports_ = shifts_supports_ || effect.shifts_supports();
  };
  for (const std::shared_ptr<const Effect>& effect : cloth.effects) note(*effect);
  for (size_t e = 0; e < cloth.effect_descriptions.size(); ++e) {
    // A contact sets in suddenly, and what remembers changes in every step. So do the forces of
    // springs, which effects change that change forces.
    if (cloth.effect_descriptions[e].test == EffectTest::finite) continue;
    if (cloth.effects[e]->memory_size(cloth) > 0) continue;
    of_forces_[e].lasts_s = kept_s;
  }
  for (size_t d = 0; d < directions.size(); ++d) {
    if (!directions[d].emerging) continue;
    const EmergingEffect& from = *directions[d].emerging;
    note(*from.effect);
    Emerging emerging{.effect = from.effect,
                      .direction = d,
                      .per_change = 1 / from.change,
                      .parameters = {},
                      .memory = EffectMemory<SingleLane>::Zero(1, from.effect->memory_size(cloth))};
    for (const double value : from.parameters)
      emerging.parameters.push_back(LaneValue<SingleLane>::Constant(value));
    if (from.start_memory.size() > 0)
      emerging.memory.row(0) = from.start_memory.transpose().array();
    emerging_.push_back(std::move(emerging));
  }
  if (!emerging_.empty()) carried_n_ = emerged_last_n_ = force_n_.tangent;
}

template <class L>
Eigen::VectorXd TangentStepper<L>::emerging_memory(size_t direction) const {
  for (const Emerging& emerging : emerging_)
    if (emerging.direction == direction) return emerging.memory.row(0).matrix();
  return {};
}

template <class L>
TangentVectors<L> TangentStepper<L>::locate(const TangentState<L>& state) const {
  TangentVectors<L> places{held_value_.locate(state.value.position_m), {}};
  for (const LaneState<L>& tangent : state.tangent)
    places.tangent.push_back(held_tangent_.locate(tangent.position_m));
  return places;
}

template <class L>
void TangentStepper<L>::step(const TangentParameters<L>& parameters,
                             const TangentVectors<L>& held_target_m, double time_s,
                             double time_step_s, TangentState<L>& state) {
  LaneVectors<SingleLane>&position = state.value.position_m,
  &velocity = state.value.velocity_m_per_s;
  const EffectScene<SingleLane> scene{cloth_,
                                      parameters.value.springs,
                                      parameters.value.gravity_m_per_s2,
                                      position,
                                      velocity,
                                      time_s,
                                      time_step_s};
  const size_t groups = state.tangent.size();
  const bool forces = !cloth_.effects.empty() || !emerging_.empty();
  if (forces) add_effect_forces(parameters, scene, state);

  const TangentSweep::State at{parameters.value.springs, position, velocity};
  const TangentVectors<L>* target_m = &held_target_m;
  if (!changes_force_ && !shifts_supports_) {
    for (size_t g = 0; g < groups; ++g)
      tangent_sweep_.step_euler(at, parameters.tangent[g].springs,
                                parameters.tangent[g].gravity_m_per_s2, inverse_mass_per_kg_,
                                forces ? &force_n_.tangent[g] : nullptr, time_step_s,
                                state.tangent[g].position_m, state.tangent[g].velocity_m_per_s);
    sweep_.step_euler(parameters.value.springs, parameters.value.gravity_m_per_s2,
                      inverse_mass_per_kg_, forces ? &force_n_.value : nullptr, time_step_s,
                      position, velocity);
  } else {
    for (size_t g = 0; g < groups; ++g)
      tangent_sweep_.add_spring_forces(at, parameters.tangent[g].springs,
                                       state.tangent[g].position_m,
                                       state.tangent[g].velocity_m_per_s, force_n_.tangent[g]);
    sweep_.add_spring_forces(parameters.value.springs, position, velocity, force_n_.value);
    if (shifts_supports_) {
      target_m_ = held_target_m;
      shift_supports(parameters, scene, state);
      target_m = &target_m_;
    }
    if (changes_force_) change_forces(parameters, scene, state);
    for (size_t g = 0; g < groups; ++g)
      move_by_forces(force_n_.tangent[g], parameters.tangent[g].gravity_m_per_s2,
                     inverse_mass_per_kg_, time_step_s, state.tangent[g].position_m,
                     state.tangent[g].velocity_m_per_s);
    move_by_forces(force_n_.value, parameters.value.gravity_m_per_s2, inverse_mass_per_kg_,
                   time_step_s, position, velocity);
  }
  for (size_t g = 0; g < groups; ++g)
    held_tangent_.place(target_m->tangent[g], time_step_s, state.tangent[g].position_m,
                        state.tangent[g].velocity_m_per_s);
  held_value_.place(target_m->value, time_step_s, position, velocity);
  apply_limit(parameters, time_step_s, state);
}

template <class L>
void TangentStepper<L>::add_effect_forces(const TangentParameters<L>& parameters,
                                          const EffectScene<SingleLane>& scene,
                                          TangentState<L>& state) {
  force_n_.value.set_zero();
  for (LaneVectors<L>& tangent : force_n_.tangent) tangent.set_zero();
  for (size_t e = 0; e < cloth_.effects.size(); ++e) {
    const Effect& effect = *cloth_.effects[e];
    EffectMemory<SingleLane>& memory = state.value.effect_memory[e];
    const EffectLinearisation& derivatives =
        derivatives_of(e, parameters, scene, of_forces_[e], [&](EffectLinearisation& of) {
          effect.linearise_force(scene, parameters.value.effects[e], memory, of);
        });
    for (size_t g = 0; g < state.tangent.size(); ++g)
      apply(e, derivatives, parameters.tangent[g], nullptr, force_n_.tangent[g], state.tangent[g]);
    effect.add_force(scene, parameters.value.effects[e], memory, force_n_.value);
  }
  if (!emerging_.empty()) add_emerging_forces(scene);
}

template <class L>
template <class Linearise>
const EffectLinearisation& TangentStepper<L>::derivatives_of(size_t effect,
                                                             const TangentParameters<L>& parameters,
                                                             const EffectScene<SingleLane>& scene,
                                                             KeptDerivatives& kept,
                                                             const Linearise& linearise) {
  if (scene.time_s + scene.time_step_s / 2 < kept.taken_s + kept.lasts_s) return kept.of;
  kept.of.clear();
  if (kept.of.looked_at.empty()) find_changing(parameters, effect, kept.of.looked_at);
  linearise(kept.of);
  kept.taken_s = scene.time_s;
  return kept.of;
}

template <class L>
void TangentStepper<L>::add_emerging_forces(const EffectScene<SingleLane>& scene) {
  const auto add_to = [&](Emerging& emerging, std::vector<LaneVectors<L>>& tangent) {
    emerged_n_ = force_n_.value;
    emerging.effect->add_force(scene, emerging.parameters, emerging.memory, emerged_n_);
    add_share(emerging.per_change, emerged_n_, force_n_.value, emerging.lane(),
              tangent[emerging.group()]);
  };
  // The force is computed half a step early rather than late.
  if (!emerged_once_ || since_emerged_s_ + scene.time_step_s / 2 >= kEmergingInterval_s) {
    std::swap(carried_n_, emerged_last_n_);
    for (LaneVectors<L>& tangent : emerged_last_n_) tangent.set_zero();
    for (Emerging& emerging : emerging_)
      if (!emerging.remembers()) add_to(emerging, emerged_last_n_);
    // The older force becomes the mean over the steps until the next time, on the straight line
    // through both.
    const double exactly_ahead =
        emerged_once_ ? (since_emerged_s_ - scene.time_step_s) / (2 * since_emerged_s_) : 0;
    const auto carry_on = [&, ahead = static_cast<typename L::Number>(exactly_ahead)](
                              auto& before, const auto& last) {
      before = last + ahead * (last - before);
    };
    for (size_t g = 0; g < carried_n_.size(); ++g) {
      carry_on(carried_n_[g].x, emerged_last_n_[g].x);
      carry_on(carried_n_[g].y, emerged_last_n_[g].y);
      carry_on(carried_n_[g].z, emerged_last_n_[g].z);
    }
    emerged_once_ = true;
    since_emerged_s_ = 0;
  }
  since_emerged_s_ += scene.time_step_s;
  for (size_t g = 0; g < carried_n_.size(); ++g) {
    force_n_.tangent[g].x += carried_n_[g].x;
    force_n_.tangent[g].y += carried_n_[g].y;
    force_n_.tangent[g].z += carried_n_[g].z;
  }
  for (Emerging& emerging : emerging_)
    if (emerging.remembers()) add_to(emerging, force_n_.tangent);
}

template <class L>
void TangentStepper<L>::shift_supports(const TangentParameters<L>& parameters,
                                       const EffectScene<SingleLane>& scene,
                                       TangentState<L>& state) {
  pull_n_.value.set_zero();
  held_value_.add_pulls(force_n_.value, parameters.value.gravity_m_per_s2, pull_n_.value);
  for (size_t g = 0; g < state.tangent.size(); ++g) {
    pull_n_.tangent[g].set_zero();
    held_tangent_.add_pulls(force_n_.tangent[g], parameters.tangent[g].gravity_m_per_s2,
                            pull_n_.tangent[g]);
  }
  for (size_t e = 0; e < cloth_.effects.size(); ++e) {
    const Effect& effect = *cloth_.effects[e];
    if (!effect.shifts_supports()) continue;
    EffectMemory<SingleLane>& memory = state.value.effect_memory[e];
    derivatives_.clear();
    find_changing(parameters, e, derivatives_.looked_at);
    effect.linearise_supports(scene, parameters.value.effects[e], pull_n_.value, memory,
                              derivatives_);
    for (size_t g = 0; g < state.tangent.size(); ++g)
      apply(e, derivatives_, parameters.tangent[g], &pull_n_.tangent[g], target_m_.tangent[g],
            state.tangent[g]);
    effect.shift_supports(scene, parameters.value.effects[e], pull_n_.value, memory,
                          target_m_.value);
  }
  for (Emerging& emerging : emerging_) {
    if (!emerging.effect->shifts_supports()) continue;
    emerged_target_m_ = target_m_.value;
    emerging.effect->shift_supports(scene, emerging.parameters, pull_n_.value, emerging.memory,
                                    emerged_target_m_);
    add_share(emerging.per_change, emerged_target_m_, target_m_.value, emerging.lane(),
              target_m_.tangent[emerging.group()]);
  }
}

template <class L>
void TangentStepper<L>::change_forces(const TangentParameters<L>& parameters,
                                      const EffectScene<SingleLane>& scene,
                                      const TangentState<L>& state) {
  for (size_t e = 0; e < cloth_.effects.size(); ++e) {
    const Effect& effect = *cloth_.effects[e];
    if (!effect.changes_force()) continue;
    const EffectLinearisation& derivatives =
        derivatives_of(e, parameters, scene, of_changes_[e], [&](EffectLinearisation& of) {
          effect.linearise_change(scene, parameters.value.effects[e], force_n_.value, of);
        });
    for (size_t g = 0; g < state.tangent.size(); ++g) {
      LaneVectors<L>& tangent = force_n_.tangent[g];
      changed_n_.set_zero();
      add_products(derivatives.by_force, tangent, changed_n_);
      add_actions(e, derivatives, parameters.tangent[g], state.tangent[g], changed_n_);
      tangent = changed_n_;
    }
    effect.change_force(scene, parameters.value.effects[e], force_n_.value);
  }
  for (const Emerging& emerging : emerging_) {
    if (!emerging.effect->changes_force()) continue;
    emerged_n_ = force_n_.value;
    emerging.effect->change_force(scene, emerging.parameters, emerged_n_);
    add_share(emerging.per_change, emerged_n_, force_n_.value, emerging.lane(),
              force_n_.tangent[emerging.group()]);
  }
}

template <class L>
void TangentStepper<L>::add_actions(size_t e, const EffectLinearisation& derivatives,
                                    const LaneParameters<L>& parameters, const LaneState<L>& state,
                                    LaneVectors<L>& action) {
  add_products(derivatives.by_motion, state.position_m, state.velocity_m_per_s, action);
  for (const EffectLinearisation::ByParameter& column : derivatives.by_parameter)
    add_product(column.derivative, parameter_change(parameters, e, column.parameter), column.on,
                action);
  const EffectMemory<L>& memory = state.effect_memory[e];
  for (const EffectLinearisation::ByMemory& column : derivatives.by_memory)
    add_product(column.derivative, memory.col(column.number), column.on, action);
  if (derivatives.by_spring.empty()) return;
  const auto springs = static_cast<Eigen::Index>(derivatives.by_spring.size());
  if (tension_n_.cols() != springs) tension_n_ = LaneArray<L>(L::kCount, springs);
  tension_n_.setZero();
  for (const EffectLinearisation::TensionByParameter& of : derivatives.tension_by_parameter)
    tension_n_.col(of.spring) +=
        in_lanes<L>(of.derivative) * parameter_change(parameters, e, of.parameter);
  for (const EffectLinearisation::TensionByMemory& of : derivatives.tension_by_memory)
    tension_n_.col(of.spring) += in_lanes<L>(of.derivative) * memory.col(of.number);
  add_products(derivatives.by_spring, tension_n_, state.position_m, state.velocity_m_per_s, action);
}

template <class L>
void TangentStepper<L>::apply(size_t e, const EffectLinearisation& derivatives,
                              const LaneParameters<L>& parameters, const LaneVectors<L>* pull_n,
                              LaneVectors<L>& action, LaneState<L>& state) {
  add_actions(e, derivatives, parameters, state, action);
  if (pull_n != nullptr) add_products(derivatives.by_force, *pull_n, action);

  if (derivatives.memory_by_memory.empty() && derivatives.by_memory.empty()) return;
  EffectMemory<L>& memory = state.effect_memory[e];
  EffectMemory<L>& next = next_memory_[e];
  next.setZero();
  for (const EffectLinearisation::MemoryByMemory& entry : derivatives.memory_by_memory)
    next.col(entry.number) += in_lanes<L>(entry.derivative) * memory.col(entry.of);
  for (const EffectLinearisation::MemoryByMotion& row : derivatives.memory_by_motion)
    next.col(row.number) += product(row.by_position, state.position_m, row.of) +
                            product(row.by_velocity, state.velocity_m_per_s, row.of);
  for (const EffectLinearisation::MemoryByParameter& entry : derivatives.memory_by_parameter)
    next.col(entry.number) +=
        in_lanes<L>(entry.derivative) * parameter_change(parameters, e, entry.parameter);
  if (pull_n != nullptr)
    for (const EffectLinearisation::MemoryByForce& row : derivatives.memory_by_force)
      next.col(row.number) += product(row.derivative, *pull_n, row.of);
  memory = next;
}

template <class L>
void TangentStepper<L>::apply_limit(const TangentParameters<L>& parameters, double time_step_s,
                                    TangentState<L>& state) {
  const StrainLimit& limit = cloth_.strain_limit;
  if (limit.mode == StrainLimitMode::off) return;
  const bool correct_velocity = limit.mode == StrainLimitMode::consistent;
  moves_.clear();
  limiter_.limit(limit, parameters.value.limits, time_step_s, state.value.position_m,
                 state.value.velocity_m_per_s, &moves_);

  using Number = typename L::Number;
  // With longest the length a spring may have, its ends move by shares of (1 - longest / l) L:
  //   d((1 - longest / l) L) = (1 - longest / l) dL + (longest / l^3 (L . dL) - dlongest / l) L
  for (size_t g = 0; g < state.tangent.size(); ++g) {
    LaneVectors<L>&p = state.tangent[g].position_m, &v = state.tangent[g].velocity_m_per_s;
    for (const LimitMove& move : moves_) {
      const int a = move.first, b = move.second;
      const Eigen::Vector3<Number> along = move.along_m.template cast<Number>();
      const Number excess = in_lanes<L>(move.excess),
                   inverse_length = in_lanes<L>(move.inverse_length_per_m);
      const LaneValue<L> dx = p.x.col(b) - p.x.col(a), dy = p.y.col(b) - p.y.col(a),
                         dz = p.z.col(b) - p.z.col(a);
      const LaneValue<L> stretch =
          (1 - excess) * inverse_length * inverse_length *
              (along.x() * dx + along.y() * dy + along.z() * dz) -
          inverse_length * parameters.tangent[g].limits.longest_m[static_cast<size_t>(move.type)];
      const auto shift = [&](LaneArray<L>& place, LaneArray<L>& speed, const LaneValue<L>& d,
                             Number component) {
        const LaneValue<L> change = excess * d + component * stretch;
        place.col(a) += in_lanes<L>(move.first_share) * change;
        place.col(b) -= in_lanes<L>(move.second_share) * change;
        if (!correct_velocity) return;
        speed.col(a) += in_lanes<L>(move.first_share / time_step_s) * change;
        speed.col(b) -= in_lanes<L>(move.second_share / time_step_s) * change;
      };
      shift(p.x, v.x, dx, along.x());
      shift(p.y, v.y, dy, along.y());
      shift(p.z, v.z, dz, along.z());
    }
  }
}

#define CLOTHFIT_INSTANTIATE(L)         \
  template struct TangentParameters<L>; \
  template struct TangentState<L>;      \
  template class TangentStepper<L>;
CLOTHFIT_INSTANTIATE(ExactLanes)
CLOTHFIT_INSTANTIATE(FastLanes)
#undef CLOTHFIT_INSTANTIATE

}  // namespace clothfit
