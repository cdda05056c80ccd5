#pragma once

#include <vector>

#include "model/kernels/cloth_sweep.h"
#include "model/kernels/strain_limit.h"
#include "tests/bench/swinging_cloth.h"

namespace clothfit {

/// A swinging cloth in the lanes of `L`, moved by the two kernels of a time step alone. Its held
/// vertices are put back after each step.
template <class L>
class SteppedLanes {
 public:
  using Number = typename L::Number;

  /// Takes `sets` for the lanes; springs are limited to `critical` elongation where `limited`.
  SteppedLanes(const Cloth& cloth, const std::vector<ParameterSet>& sets, double critical,
               bool limited)
      : limited_(limited),
        sweep_(cloth.mesh),
        limiter_(cloth.mesh, held_inverse_mass(cloth)),
        inverse_mass_per_kg_(cloth.mass_kg.cwiseInverse()),
        position_m_(LaneVectors<L>::zero(cloth.mesh.vertex_count())),
        velocity_m_per_s_(position_m_) {
    for (int l = 0; l < L::kCount; ++l) {
      const ParameterSet& set = sets[static_cast<size_t>(l)];
      for (size_t type = 0; type < kSpringTypes; ++type) {
        const auto number = [](double value) { return static_cast<Number>(value); };
        const double natural_m = set.springs.natural_length_m[type];
        springs_.natural_length_m[type][l] = number(natural_m);
        springs_.stiffness_n_per_m[type][l] = number(set.springs.stiffness_n_per_m[type]);
        springs_.damping_ns_per_m[type][l] = number(set.springs.damping_ns_per_m[type]);
        limits_.longest_m[type][l] = number(natural_m * (1 + critical));
        limits_.tolerated_m[type][l] = number(natural_m * (1 + critical + 1e-3));
      }
      position_m_.set_lane(l, set.start_position_m);
    }
    gravity_ = {LaneValue<L>::Zero(), LaneValue<L>::Constant(Number(9.81)), LaneValue<L>::Zero()};
    for (const HeldVertexWeights& held : cloth.held) {
      const int vertex = held.weights.front().vertex;
      held_.push_back({vertex, position_m_.x.col(vertex), position_m_.y.col(vertex),
                       position_m_.z.col(vertex)});
    }
    saved_ = {position_m_, velocity_m_per_s_};
  }

  void step(double time_step_s) {
    sweep_.step_euler(springs_, gravity_, inverse_mass_per_kg_, nullptr, time_step_s, position_m_,
                      velocity_m_per_s_);
    for (const Held& held : held_) {
      position_m_.x.col(held.vertex) = held.x;
      position_m_.y.col(held.vertex) = held.y;
      position_m_.z.col(held.vertex) = held.z;
      velocity_m_per_s_.x.col(held.vertex).setZero();
      velocity_m_per_s_.y.col(held.vertex).setZero();
      velocity_m_per_s_.z.col(held.vertex).setZero();
    }
    if (limited_) too_long_ = limiter_.limit_positions(limits_, position_m_).too_long.mean();
  }

  /// Returns how many springs the last step's limit shortened, mean of the lanes.
  double too_long() const { return too_long_; }
  void set_limited(bool limited) { limited_ = limited; }
  void save() { saved_ = {position_m_, velocity_m_per_s_}; }
  void restore() {
    position_m_ = saved_.position_m;
    velocity_m_per_s_ = saved_.velocity_m_per_s;
  }

 private:
  static Eigen::VectorXd held_inverse_mass(const Cloth& cloth) {
    Eigen::VectorXd inverse = cloth.mass_kg.cwiseInverse();
    for (const HeldVertexWeights& held : cloth.held) inverse[held.weights.front().vertex] = 0;
    return inverse;
  }

  struct Held {
    int vertex;
    LaneValue<L> x, y, z;
  };
  struct Saved {
    LaneVectors<L> position_m, velocity_m_per_s;
  };

  bool limited_;
  LaneSprings<L> springs_;
  LaneLimits<L> limits_;
  LaneVector<L> gravity_;
  ClothSweep<L> sweep_;
  StrainLimiter<L> limiter_;
  Eigen::VectorXd inverse_mass_per_kg_;
  std::vector<Held> held_;
  LaneVectors<L> position_m_, velocity_m_per_s_;
  Saved saved_;
  double too_long_ = 0;
};

}  // namespace clothfit
