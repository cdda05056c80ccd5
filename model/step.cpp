#include "model/step.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cassert>

namespace clothfit {

HeldPlacement::HeldPlacement(const Cloth& cloth)
    : held_(cloth.held), missing_m_(kLanes, static_cast<Eigen::Index>(cloth.held.size())) {
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
  // Two held points in the same place would make this singular; the pseudo-inverse lets them share.
  correction_ =
      inverse_mass_a * (a * inverse_mass_a).completeOrthogonalDecomposition().pseudoInverse();
}

namespace {

/// Adds the held point's place between the vertices to `sum`.
void add_place(const HeldVertexWeights& held, const LaneArray<>& position, LaneArray<>& sum,
               Eigen::Index column) {
  for (const auto& [vertex, weight] : held.weights)
    sum.col(column) += weight * position.col(vertex);
}

}  // namespace

LaneVectors<> HeldPlacement::locate(const LaneVectors<>& position_m) const {
  LaneVectors<> located = LaneVectors<>::zero(count());
  for (int h = 0; h < count(); ++h) {
    const HeldVertexWeights& held = held_[static_cast<size_t>(h)];
    add_place(held, position_m.x, located.x, h);
    add_place(held, position_m.y, located.y, h);
    add_place(held, position_m.z, located.z, h);
  }
  return located;
}

void HeldPlacement::place(const LaneVectors<>& target_m, double time_step_s, LaneState& state) {
  const auto correct = [&](const LaneArray<>& target, LaneArray<>& position,
                           LaneArray<>& velocity) {
    missing_m_.setZero();
    for (int h = 0; h < count(); ++h) {
      add_place(held_[static_cast<size_t>(h)], position, missing_m_, h);
      missing_m_.col(h) = target.col(h) - missing_m_.col(h);
    }
    for (size_t n = 0; n < touched_.size(); ++n) {
      LaneValue<> shift = LaneValue<>::Zero();
      for (int h = 0; h < count(); ++h)
        shift += correction_(static_cast<Eigen::Index>(n), h) * missing_m_.col(h);
      position.col(touched_[n]) += shift;
      velocity.col(touched_[n]) += shift / time_step_s;
    }
  };
  correct(target_m.x, state.position_m.x, state.velocity_m_per_s.x);
  correct(target_m.y, state.position_m.y, state.velocity_m_per_s.y);
  correct(target_m.z, state.position_m.z, state.velocity_m_per_s.z);
}

namespace {

/// Inverse masses, 0 where a held point has a say.
Eigen::VectorXd movable(const Cloth& cloth, const HeldPlacement& held) {
  Eigen::VectorXd inverse_mass_per_kg = cloth.mass_kg.cwiseInverse();
  for (const int vertex : held.touched()) inverse_mass_per_kg[vertex] = 0;
  return inverse_mass_per_kg;
}

}  // namespace

void set_lane(int lane, const SpringParameters& springs, const StrainLimit& strain_limit,
              LaneParameters& parameters) {
  for (size_t type = 0; type < kSpringTypes; ++type) {
    const double natural_m = springs.natural_length_m[type];
    parameters.springs.natural_length_m[type][lane] = natural_m;
    parameters.springs.stiffness_n_per_m[type][lane] = springs.stiffness_n_per_m[type];
    parameters.springs.damping_ns_per_m[type][lane] = springs.damping_ns_per_m[type];
    const double critical = springs.critical_elongation[type];
    parameters.limits.longest_m[type][lane] = natural_m * (1 + critical);
    parameters.limits.tolerated_m[type][lane] = natural_m * (1 + critical + strain_limit.tolerance);
  }
}

EulerStepper::EulerStepper(const Cloth& cloth)
    : cloth_(cloth),
      inverse_mass_per_kg_(cloth.mass_kg.cwiseInverse()),
      held_(cloth),
      sweep_(cloth.mesh),
      limiter_(cloth.mesh, movable(cloth, held_)),
      effect_force_n_(LaneVectors<>::zero(cloth.mesh.vertex_count())) {}

void EulerStepper::step(const LaneParameters& parameters, const LaneVectors<>& held_target_m,
                        double time_s, double time_step_s, LaneState& state) {
  const bool any_effect = !cloth_.effects.empty();
  if (any_effect) {
    effect_force_n_.set_zero();
    const EffectScene scene{cloth_.mesh, state.position_m, state.velocity_m_per_s, cloth_.mass_kg,
                            time_s};
    for (size_t e = 0; e < cloth_.effects.size(); ++e)
      cloth_.effects[e]->add_force(scene, parameters.effects[e], effect_force_n_);
  }
  sweep_.step_euler(parameters.springs, parameters.gravity_m_per_s2, inverse_mass_per_kg_,
                    any_effect ? &effect_force_n_ : nullptr, time_step_s, state.position_m,
                    state.velocity_m_per_s);
  held_.place(held_target_m, time_step_s, state);
  switch (cloth_.strain_limit.mode) {
    case StrainLimitMode::off:
      break;
    case StrainLimitMode::positions:
      limit_outcome_ = limiter_.limit_positions(parameters.limits, state.position_m);
      break;
    case StrainLimitMode::consistent:
      limit_outcome_ =
          limiter_.limit_consistently(parameters.limits, cloth_.strain_limit.most_sweeps,
                                      time_step_s, state.position_m, state.velocity_m_per_s);
      break;
  }
}

}  // namespace clothfit
