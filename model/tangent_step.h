#pragma once

#include <ceres/jet.h>

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "model/cloth.h"
#include "model/kernels/tangent_sweep.h"
#include "model/step.h"

namespace clothfit {

/// An effect that the cloth does not have, near its neutral values: what it does for a small change
/// of one parameter, over that change, is how a simulation begins to change. Its own derivatives
/// are not asked for, so it costs what it costs in one simulation.
struct EmergingEffect {
  std::shared_ptr<const Effect> effect;
  std::vector<double> parameters;  ///< neutral, but for the change of one
  double change = 0;               ///< along the direction, whose unit may be another than its
  Eigen::VectorXd start_memory;    ///< empty: zeros
};

/// How one simulation changes along a direction: the derivatives of a ParameterSet and of what else
/// it depends on. What is left empty does not change.
struct Direction {
  std::array<double, kSpringTypes> natural_length_m{}, stiffness_n_per_m{}, damping_ns_per_m{};
  std::array<double, kSpringTypes> critical_elongation{};
  Eigen::Vector3d gravity_m_per_s2 = Eigen::Vector3d::Zero();
  std::vector<std::vector<double>> effects;  ///< parameters of each effect of the cloth
  Eigen::Matrix3Xd start_position_m, start_velocity_m_per_s;  ///< 3 x vertices
  std::vector<Eigen::VectorXd> start_effect_memory;           ///< of each effect of the cloth
  /// Of each held point, how its place changes (m); a point without a motion of its own moves with
  /// the start positions.
  std::vector<std::function<Eigen::Vector3d(double time_s)>> held_motion;
  std::optional<EmergingEffect> emerging;
};

/// The parameters of one simulation and their changes along kLanes directions.
struct DualParameters {
  LaneParameters<SingleLane> value;
  LaneParameters<ExactLanes> tangent;
  LaneSprings<DualLanes> springs;  ///< both, as effects see them
  LaneVector<DualLanes> gravity_m_per_s2;
  std::vector<EffectValues<DualLanes>> effects;

  /// At most kLanes directions; missing ones are zero.
  static DualParameters of(const Cloth& cloth, const ParameterSet& set,
                           std::span<const Direction> directions);
};

/// Where one simulation and its derivatives along at most kLanes directions start.
LaneState<DualLanes> start_of(const Cloth& cloth, const ParameterSet& set,
                              std::span<const Direction> directions);

/// Steps one simulation together with its derivatives along kLanes directions: exact for the
/// discrete scheme, the springs at their strain limit included, where it is smooth. The simulation
/// itself has the bits that EulerStepper gives it. Holds scratch memory: one object per thread.
class TangentStepper {
 public:
  /// `cloth` must outlive the stepper. Of the directions, the effects that emerge along them.
  explicit TangentStepper(const Cloth& cloth, std::span<const Direction> directions = {});

  /// What the effect that emerges along a direction remembers; empty where none does.
  Eigen::VectorXd emerging_memory(size_t direction) const;

  /// Where the held points are.
  LaneVectors<DualLanes> locate(const LaneVectors<DualLanes>& position_m) const;

  /// One time step, as EulerStepper::step takes it.
  void step(const DualParameters& parameters, const LaneVectors<DualLanes>& held_target_m,
            double time_s, double time_step_s, LaneState<DualLanes>& state);

 private:
  /// An effect that emerges along the direction of one lane.
  struct Emerging {
    std::shared_ptr<const Effect> effect;
    Eigen::Index lane = 0;
    double per_change = 0;
    EffectValues<SingleLane> parameters;
    EffectMemory<SingleLane> memory;
  };

  void apply_limit(const DualParameters& parameters, double time_step_s,
                   LaneState<DualLanes>& state);

  const Cloth& cloth_;
  Eigen::VectorXd inverse_mass_per_kg_;
  bool changes_force_ = false, shifts_supports_ = false;  ///< any effect
  HeldPlacement<SingleLane> held_value_;
  HeldPlacement<ExactLanes> held_tangent_;
  ClothSweep<SingleLane> sweep_;
  TangentSweep tangent_sweep_;
  StrainLimiter<SingleLane> limiter_;
  std::vector<LimitMove> moves_;  ///< of the last step's strain limit
  LaneVectors<DualLanes> force_n_, pull_n_, target_m_;
  LaneVectors<SingleLane> force_before_, target_before_;  ///< what an effect found
  std::vector<EffectMemory<SingleLane>> memory_;
  std::vector<Emerging> emerging_;
  LaneVectors<SingleLane> emerged_n_, emerged_target_m_;
};

}  // namespace clothfit
