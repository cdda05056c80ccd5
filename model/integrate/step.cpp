#include "model/integrate/step.h"

#include <algorithm>
#include <cassert>

#include "data/algebra/dense_factors.h"

namespace clothfit {

template <class L>
LaneState<L> LaneState<L>::of(const Cloth& cloth) {
  const int vertices = cloth.mesh.vertex_count();
  LaneState state{LaneVectors<L>::zero(vertices), LaneVectors<L>::zero(vertices), {}};
  for (const std::shared_ptr<const Effect>& effect : cloth.effects)
    state.effect_memory.push_back(EffectMemory<L>::Zero(L::kCount, effect->memory_size(cloth)));
  return state;
}

template <class L>
void set_start(int lane, const ParameterSet& set, LaneState<L>& state) {
  state.position_m.set_lane(lane, set.start_position_m);
  if (set.start_velocity_m_per_s.cols() > 0)
    state.velocity_m_per_s.set_lane(lane, set.start_velocity_m_per_s);
  assert(set.start_effect_memory.size() <= state.effect_memory.size());
  for (size_t e = 0; e < set.start_effect_memory.size(); ++e) {
    const Eigen::VectorXd& memory = set.start_effect_memory[e];
    if (memory.size() == 0) continue;
    assert(memory.size() == state.effect_memory[e].cols());
    state.effect_memory[e].row(lane) =
        memory.transpose().array().template cast<typename L::Number>();
  }
}

template <class L>
HeldPlacement<L>::HeldPlacement(const Cloth& cloth)
    : held_(cloth.held),
      mass_kg_(cloth.mass_kg),
      missing_m_(L::kCount, static_cast<Eigen::Index>(cloth.held.size())) {
  if (held_.empty()) return;  // free cloth: nothing to decompose
  for (const HeldVertexWeights& held : held_)
    for (const auto& [vertex, weight] : held.weights) touched_.push_back(vertex);
  std::ranges::sort(touched_);
  touched_.erase(std::ranges::unique(touched_).begin(), touched_.end());

  const auto touched = static_cast<Eigen::Index>(touched_.size());
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(count(), touched);
  for (int h = 0; h < count(); ++h) {
    for (const auto& [vertex, weight] : held_[static_cast<size_t>(h)].weights) {
      const auto place = std::ranges::lower_bound(touched_, vertex) - touched_.begin();
      a(h, place) += weight;
    }
  }
  Eigen::MatrixXd inverse_mass_a = a.transpose();
  for (Eigen::Index n = 0; n < touched; ++n)
    inverse_mass_a.row(n) /= cloth.mass_kg[touched_[static_cast<size_t>(n)]];
  // Two held points in the same place would make this singular. The pseudo-inverse lets them share.
  correction_ = inverse_mass_a * LeastNormFactors(a * inverse_mass_a).pseudo_inverse();
}

template <class L>
LaneVectors<L> HeldPlacement<L>::locate(const LaneVectors<L>& position_m) const {
  LaneVectors<L> located = LaneVectors<L>::zero(count());
  const auto add = [&](const LaneArray<L>& position, LaneArray<L>& sum) {
    for (int h = 0; h < count(); ++h)
      for (const auto& [vertex, weight] : held_[static_cast<size_t>(h)].weights)
        sum.col(h) += static_cast<typename L::Number>(weight) * position.col(vertex);
  };
  add(position_m.x, located.x);
  add(position_m.y, located.y);
  add(position_m.z, located.z);
  return located;
}

template <class L>
void HeldPlacement<L>::place(const LaneVectors<L>& target_m, double time_step_s,
                             LaneVectors<L>& position_m, LaneVectors<L>& velocity_m_per_s) {
  using Number = typename L::Number;
  const auto step_s = static_cast<Number>(time_step_s);
  const auto correct = [&](const LaneArray<L>& target, LaneArray<L>& position,
                           LaneArray<L>& velocity) {
    missing_m_.setZero();
    for (int h = 0; h < count(); ++h) {
      for (const auto& [vertex, weight] : held_[static_cast<size_t>(h)].weights)
        missing_m_.col(h) += static_cast<Number>(weight) * position.col(vertex);
      missing_m_.col(h) = target.col(h) - missing_m_.col(h);
    }
    for (size_t n = 0; n < touched_.size(); ++n) {
      LaneValue<L> shift = LaneValue<L>::Zero();
      for (int h = 0; h < count(); ++h)
        shift +=
            static_cast<Number>(correction_(static_cast<Eigen::Index>(n), h)) * missing_m_.col(h);
      position.col(touched_[n]) += shift;
      velocity.col(touched_[n]) += shift / step_s;
    }
  };
  correct(target_m.x, position_m.x, velocity_m_per_s.x);
  correct(target_m.y, position_m.y, velocity_m_per_s.y);
  correct(target_m.z, position_m.z, velocity_m_per_s.z);
}

template <class L>
void HeldPlacement<L>::add_pulls(const LaneVectors<L>& force_n,
                                 const LaneVector<L>& gravity_m_per_s2,
                                 LaneVectors<L>& pull_n) const {
  using Number = typename L::Number;
  const auto add = [&](const LaneArray<L>& force, const LaneValue<L>& gravity, LaneArray<L>& pull) {
    for (int h = 0; h < count(); ++h)
      for (const auto& [vertex, weight] : held_[static_cast<size_t>(h)].weights)
        pull.col(h) += static_cast<Number>(weight) *
                       (force.col(vertex) + static_cast<Number>(mass_kg_[vertex]) * gravity);
  };
  add(force_n.x, gravity_m_per_s2.x, pull_n.x);
  add(force_n.y, gravity_m_per_s2.y, pull_n.y);
  add(force_n.z, gravity_m_per_s2.z, pull_n.z);
}

Eigen::VectorXd movable_inverse_mass(const Cloth& cloth, const std::vector<int>& touched) {
  Eigen::VectorXd inverse_mass_per_kg = cloth.mass_kg.cwiseInverse();
  for (const int vertex : touched) inverse_mass_per_kg[vertex] = 0;
  return inverse_mass_per_kg;
}

template <class L>
void set_lane(int lane, const SpringParameters& springs, const StrainLimit& strain_limit,
              LaneParameters<L>& parameters) {
  using Number = typename L::Number;
  for (size_t type = 0; type < kSpringTypes; ++type) {
    const double natural_m = springs.natural_length_m[type];
    parameters.springs.natural_length_m[type][lane] = static_cast<Number>(natural_m);
    parameters.springs.stiffness_n_per_m[type][lane] =
        static_cast<Number>(springs.stiffness_n_per_m[type]);
    parameters.springs.damping_ns_per_m[type][lane] =
        static_cast<Number>(springs.damping_ns_per_m[type]);
    const double critical = springs.critical_elongation[type];
    parameters.limits.longest_m[type][lane] = static_cast<Number>(natural_m * (1 + critical));
    parameters.limits.tolerated_m[type][lane] =
        static_cast<Number>(natural_m * (1 + critical + strain_limit.tolerance));
  }
}

template <class L>
LaneParameters<L> lane_parameters(const Cloth& cloth, std::span<const ParameterSet> sets) {
  using Number = typename L::Number;
  LaneParameters<L> result;
  for (const EffectDescription& effect : cloth.effect_descriptions)
    result.effects.emplace_back(effect.parameters.size());
  for (int l = 0; l < L::kCount; ++l) {
    const ParameterSet& set = sets[std::min(static_cast<size_t>(l), sets.size() - 1)];
    set_lane(l, set.springs, cloth.strain_limit, result);
    result.gravity_m_per_s2.x[l] = static_cast<Number>(set.gravity_m_per_s2.x());
    result.gravity_m_per_s2.y[l] = static_cast<Number>(set.gravity_m_per_s2.y());
    result.gravity_m_per_s2.z[l] = static_cast<Number>(set.gravity_m_per_s2.z());
    for (size_t e = 0; e < result.effects.size(); ++e)
      for (size_t p = 0; p < result.effects[e].size(); ++p)
        result.effects[e][p][l] = static_cast<Number>(set.effects[e][p]);
  }
  return result;
}

template <class L>
EulerStepper<L>::EulerStepper(const Cloth& cloth)
    : cloth_(cloth),
      inverse_mass_per_kg_(cloth.mass_kg.cwiseInverse()),
      held_(cloth),
      sweep_(cloth.mesh),
      limiter_(cloth.mesh, movable_inverse_mass(cloth, held_.touched())),
      force_n_(LaneVectors<L>::zero(cloth.mesh.vertex_count())),
      pull_n_(LaneVectors<L>::zero(held_.count())),
      target_m_(pull_n_) {
  for (const std::shared_ptr<const Effect>& effect : cloth.effects) {
    changes_force_ = changes_force_ || effect->changes_force();
    shifts_supports_ = shifts_supports_ || effect->shifts_supports();
  }
}

template <class L>
void move_by_forces(const LaneVectors<L>& force_n, const LaneVector<L>& gravity_m_per_s2,
                    const Eigen::VectorXd& inverse_mass_per_kg, double time_step_s,
                    LaneVectors<L>& position_m, LaneVectors<L>& velocity_m_per_s) {
  using Number = typename L::Number;
  const auto h = static_cast<Number>(time_step_s);
  const auto move_along = [&](const LaneArray<L>& force, const LaneValue<L>& gravity,
                              LaneArray<L>& velocity, LaneArray<L>& position) {
    for (Eigen::Index k = 0; k < position.cols(); ++k) {
      const auto inverse_mass = static_cast<Number>(inverse_mass_per_kg[k]);
      velocity.col(k) += h * (gravity + inverse_mass * force.col(k));
      position.col(k) += h * velocity.col(k);
    }
  };
  move_along(force_n.x, gravity_m_per_s2.x, velocity_m_per_s.x, position_m.x);
  move_along(force_n.y, gravity_m_per_s2.y, velocity_m_per_s.y, position_m.y);
  move_along(force_n.z, gravity_m_per_s2.z, velocity_m_per_s.z, position_m.z);
}

template <class L>
void EulerStepper<L>::step(const LaneParameters<L>& parameters, const LaneVectors<L>& held_target_m,
                           double time_s, double time_step_s, LaneState<L>& state,
                           const StepExtras<L>& extras) {
  LaneVectors<L>&position_m = state.position_m, &velocity_m_per_s = state.velocity_m_per_s;
  const size_t effects = cloth_.effects.size();
  const EffectScene<L> scene{cloth_,     parameters.springs, parameters.gravity_m_per_s2,
                             position_m, velocity_m_per_s,   time_s,
                             time_step_s};
  const bool any_force = effects > 0 || extras.force_n != nullptr;
  if (extras.force_n != nullptr)
    force_n_ = *extras.force_n;
  else if (any_force)
    force_n_.set_zero();
  for (size_t e = 0; e < effects; ++e)
    cloth_.effects[e]->add_force(scene, parameters.effects[e], state.effect_memory[e], force_n_);

  const LaneVectors<L>* target_m = &held_target_m;
  if (!changes_force_ && !shifts_supports_) {
    sweep_.step_euler(parameters.springs, parameters.gravity_m_per_s2, inverse_mass_per_kg_,
                      any_force ? &force_n_ : nullptr, time_step_s, position_m, velocity_m_per_s,
                      extras.factors);
  } else {
    sweep_.add_spring_forces(parameters.springs, position_m, velocity_m_per_s, force_n_,
                             extras.factors);
    if (shifts_supports_) {
      target_m_ = held_target_m;
      target_m = &target_m_;
      pull_n_.set_zero();
      held_.add_pulls(force_n_, parameters.gravity_m_per_s2, pull_n_);
      for (size_t e = 0; e < effects; ++e)
        cloth_.effects[e]->shift_supports(scene, parameters.effects[e], pull_n_,
                                          state.effect_memory[e], target_m_);
    }
    for (size_t e = 0; e < effects; ++e)
      cloth_.effects[e]->change_force(scene, parameters.effects[e], force_n_);
    move_by_forces(force_n_, parameters.gravity_m_per_s2, inverse_mass_per_kg_, time_step_s,
                   position_m, velocity_m_per_s);
  }
  if (extras.driven_velocity_m_per_s != nullptr) *extras.driven_velocity_m_per_s = velocity_m_per_s;
  held_.place(*target_m, time_step_s, position_m, velocity_m_per_s);
  if (cloth_.strain_limit.mode != StrainLimitMode::off)
    limit_outcome_ = limiter_.limit(cloth_.strain_limit, parameters.limits, time_step_s, position_m,
                                    velocity_m_per_s, extras.moves);
}

#define CLOTHFIT_INSTANTIATE(L)                                                                 \
  template struct LaneState<L>;                                                                 \
  template class HeldPlacement<L>;                                                              \
  template void set_start(int, const ParameterSet&, LaneState<L>&);                             \
  template void set_lane(int, const SpringParameters&, const StrainLimit&, LaneParameters<L>&); \
  template LaneParameters<L> lane_parameters(const Cloth&, std::span<const ParameterSet>);      \
  template void move_by_forces(const LaneVectors<L>&, const LaneVector<L>&,                     \
                               const Eigen::VectorXd&, double, LaneVectors<L>&, LaneVectors<L>&);
CLOTHFIT_INSTANTIATE(ExactLanes)
CLOTHFIT_INSTANTIATE(FastLanes)
CLOTHFIT_INSTANTIATE(SingleLane)
#undef CLOTHFIT_INSTANTIATE
template class EulerStepper<ExactLanes>;
template class EulerStepper<FastLanes>;
template class EulerStepper<SingleLane>;

}  // namespace clothfit
