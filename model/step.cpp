#include "model/step.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cassert>

namespace clothfit {

HeldPlacement::HeldPlacement(const Cloth& cloth) : held_(cloth.held) {
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

LaneVectors HeldPlacement::locate(const LaneVectors& position_m) const {
  LaneVectors located = LaneVectors::zero(count());
  for (int h = 0; h < count(); ++h) {
    for (const auto& [vertex, weight] : held_[static_cast<size_t>(h)].weights) {
      located.x.col(h) += weight * position_m.x.col(vertex);
      located.y.col(h) += weight * position_m.y.col(vertex);
      located.z.col(h) += weight * position_m.z.col(vertex);
    }
  }
  return located;
}

void HeldPlacement::place(const LaneVectors& target_m, double time_step_s, LaneState& state) const {
  if (held_.empty()) return;
  const LaneVectors now = locate(state.position_m);
  const auto correct = [&](const LaneArray& target, const LaneArray& located, LaneArray& position,
                           LaneArray& velocity) {
    for (size_t n = 0; n < touched_.size(); ++n) {
      LaneValue shift = LaneValue::Zero();
      for (int h = 0; h < count(); ++h)
        shift += correction_(static_cast<Eigen::Index>(n), h) * (target.col(h) - located.col(h));
      position.col(touched_[n]) += shift;
      velocity.col(touched_[n]) += shift / time_step_s;
    }
  };
  correct(target_m.x, now.x, state.position_m.x, state.velocity_m_per_s.x);
  correct(target_m.y, now.y, state.position_m.y, state.velocity_m_per_s.y);
  correct(target_m.z, now.z, state.position_m.z, state.velocity_m_per_s.z);
}

void step(const Cloth& cloth, const LaneParameters& parameters, const HeldPlacement& held,
          const LaneVectors& held_target_m, double time_s, double time_step_s, LaneState& state,
          LaneVectors& force_n) {
  for (Eigen::Index k = 0; k < cloth.mass_kg.size(); ++k) {
    force_n.x.col(k) = cloth.mass_kg[k] * parameters.gravity_x;
    force_n.y.col(k) = cloth.mass_kg[k] * parameters.gravity_y;
    force_n.z.col(k) = cloth.mass_kg[k] * parameters.gravity_z;
  }
  add_spring_forces(cloth.springs, parameters.springs, state.position_m, state.velocity_m_per_s,
                    force_n);
  const EffectScene scene{state.position_m, state.velocity_m_per_s, cloth.mass_kg, time_s};
  for (size_t e = 0; e < cloth.effects.size(); ++e)
    cloth.effects[e]->add_force(scene, parameters.effects[e], force_n);
  integrate_euler(cloth.mass_kg, time_step_s, force_n, state.velocity_m_per_s, state.position_m);
  held.place(held_target_m, time_step_s, state);
}

}  // namespace clothfit
