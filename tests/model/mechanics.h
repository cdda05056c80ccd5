#pragma once

#include <Eigen/Dense>

#include "model/cloth/cloth.h"
#include "model/integrate/step.h"
#include "model/kernels/cloth_sweep.h"

namespace clothfit {

/// These are the laws with which the tests compare the model, in their plainest form. Only the
/// force is taken from the model; energies and momenta are written here a second time.

/// Returns the elastic energy (J): sum of k (l - l0)^2 / 2.
inline double elastic_energy_j(const SpringNet& net, const SpringParameters& springs,
                               const Eigen::Matrix3Xd& position_m) {
  double energy = 0;
  for (size_t type = 0; type < kSpringTypes; ++type) {
    for (const Spring& spring : net[type]) {
      const double length = (position_m.col(spring.b) - position_m.col(spring.a)).norm();
      const double extension = length - springs.natural_length_m[type];
      energy += 0.5 * springs.stiffness_n_per_m[type] * extension * extension;
    }
  }
  return energy;
}

inline double kinetic_energy_j(const Eigen::VectorXd& mass_kg, const Eigen::Matrix3Xd& velocity) {
  return 0.5 * velocity.colwise().squaredNorm().dot(mass_kg);
}

inline Eigen::Vector3d momentum_kg_m_per_s(const Eigen::VectorXd& mass_kg,
                                           const Eigen::Matrix3Xd& velocity) {
  return velocity * mass_kg;
}

/// Returns the sum of x cross f; with f = m v the angular momentum.
inline Eigen::Vector3d torque(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& f) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index k = 0; k < x.cols(); ++k) sum += x.col(k).head<3>().cross(f.col(k).head<3>());
  return sum;
}

/// Puts the same vectors in every lane.
inline LaneVectors<> every_lane(const Eigen::Matrix3Xd& values) {
  LaneVectors<> lanes = LaneVectors<>::zero(static_cast<int>(values.cols()));
  for (int l = 0; l < kLanes; ++l) lanes.set_lane(l, values);
  return lanes;
}

/// Puts the same springs in every lane.
inline LaneSprings<> every_lane(const SpringParameters& springs) {
  LaneSprings<> lanes;
  for (size_t type = 0; type < kSpringTypes; ++type) {
    lanes.natural_length_m[type].setConstant(springs.natural_length_m[type]);
    lanes.stiffness_n_per_m[type].setConstant(springs.stiffness_n_per_m[type]);
    lanes.damping_ns_per_m[type].setConstant(springs.damping_ns_per_m[type]);
  }
  return lanes;
}

inline void set_lane(int l, const SpringParameters& springs, LaneSprings<>& lanes) {
  for (size_t type = 0; type < kSpringTypes; ++type) {
    lanes.natural_length_m[type][l] = springs.natural_length_m[type];
    lanes.stiffness_n_per_m[type][l] = springs.stiffness_n_per_m[type];
    lanes.damping_ns_per_m[type][l] = springs.damping_ns_per_m[type];
  }
}

/// Returns the model's spring forces on one state, 3 x vertices (N).
inline Eigen::Matrix3Xd spring_forces_n(const Mesh& mesh, const SpringParameters& springs,
                                        const Eigen::Matrix3Xd& position_m,
                                        const Eigen::Matrix3Xd& velocity_m_per_s) {
  LaneVectors<> force_n = LaneVectors<>::zero(static_cast<int>(position_m.cols()));
  ClothSweep<>(mesh).add_spring_forces(every_lane(springs), every_lane(position_m),
                                       every_lane(velocity_m_per_s), force_n);
  return force_n.lane(0);
}

inline Eigen::Matrix3Xd at_rest(const Eigen::Matrix3Xd& position_m) {
  return Eigen::Matrix3Xd::Zero(3, position_m.cols());
}

/// Runs one simulation, step by step; held points without a motion stay where they start.
template <class L = ExactLanes>
class SteppedCloth {
 public:
  SteppedCloth(const Cloth& cloth, const ParameterSet& set,
               const Eigen::Matrix3Xd& velocity_m_per_s)
      : cloth_(cloth),
        parameters_(lane_parameters<L>(cloth, {&set, 1})),
        stepper_(cloth),
        state_(LaneState<L>::of(cloth)) {
    for (int l = 0; l < L::kCount; ++l) {
      state_.position_m.set_lane(l, set.start_position_m);
      state_.velocity_m_per_s.set_lane(l, velocity_m_per_s);
    }
    held_target_m_ = stepper_.held().locate(state_.position_m);
  }

  void step(double time_step_s) {
    const double end_s = (steps_ + 1) * time_step_s;
    for (size_t h = 0; h < cloth_.held.size(); ++h) {
      if (!cloth_.held[h].motion) continue;
      const Eigen::Vector3d target = cloth_.held[h].motion(end_s);
      held_target_m_.x.col(static_cast<Eigen::Index>(h))
          .setConstant(static_cast<typename L::Number>(target.x()));
      held_target_m_.y.col(static_cast<Eigen::Index>(h))
          .setConstant(static_cast<typename L::Number>(target.y()));
      held_target_m_.z.col(static_cast<Eigen::Index>(h))
          .setConstant(static_cast<typename L::Number>(target.z()));
    }
    stepper_.step(parameters_, held_target_m_, steps_ * time_step_s, time_step_s, state_);
    ++steps_;
  }
  const LimitOutcome<L>& limit_outcome() const { return stepper_.limit_outcome(); }
  Eigen::Matrix3Xd position_m() const { return state_.position_m.lane(0); }
  Eigen::Matrix3Xd velocity_m_per_s() const { return state_.velocity_m_per_s.lane(0); }

 private:
  const Cloth& cloth_;
  LaneParameters<L> parameters_;
  EulerStepper<L> stepper_;
  LaneState<L> state_;
  LaneVectors<L> held_target_m_;
  int steps_ = 0;
};

}  // namespace clothfit
