#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/effects/linearisation.h"
#include "model/integrate/step.h"
#include "model/kernels/tangent_sweep.h"

namespace clothfit {

/// How long forces of effects that emerge are carried on (EmergingEffect).
inline constexpr double kEmergingInterval_s = 1e-3;

/// An effect that the cloth does not have, near its neutral values: what it does for a small change
/// of one parameter, over that change, is how a simulation begins to change. Its own derivatives
/// are not asked for, so it costs what it costs in one simulation; and where steps are far shorter
/// than cloth takes to move, a force that depends on nothing remembered is had once in
/// kEmergingInterval_s and carried on between, to second order in that.
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

/// The parameters of one simulation and their changes along directions, kLanes in each group; what
/// is missing in the last group is zero.
struct TangentParameters {
  LaneParameters<SingleLane> value;
  std::vector<LaneParameters<>> tangent;  ///< of each group

  static TangentParameters of(const Cloth& cloth, const ParameterSet& set,
                              std::span<const Direction> directions);
};

/// Places or motions of one simulation with their changes along the directions of each group.
struct TangentVectors {
  LaneVectors<SingleLane> value;
  std::vector<LaneVectors<>> tangent;
};

/// One simulation and its derivatives along directions.
struct TangentState {
  LaneState<SingleLane> value;
  std::vector<LaneState<>> tangent;  ///< of each group

  /// Where they start; one group at least.
  static TangentState of(const Cloth& cloth, const ParameterSet& set,
                         std::span<const Direction> directions);
};

/// Steps one simulation together with its derivatives along any number of directions: exact for the
/// discrete scheme, the springs at their strain limit included, where it is smooth. What effects do
/// is linearised once for all of them. The simulation itself has the bits that EulerStepper gives
/// it. Holds scratch memory: one object per thread.
class TangentStepper {
 public:
  /// `cloth` must outlive the stepper. Of the directions, the effects that emerge along them.
  explicit TangentStepper(const Cloth& cloth, std::span<const Direction> directions = {});

  /// What the effect that emerges along a direction remembers; empty where none does.
  Eigen::VectorXd emerging_memory(size_t direction) const;

  /// Where the held points are.
  TangentVectors locate(const TangentState& state) const;

  /// One time step, as EulerStepper::step takes it.
  void step(const TangentParameters& parameters, const TangentVectors& held_target_m, double time_s,
            double time_step_s, TangentState& state);

 private:
  /// An effect that emerges along the direction of one lane of a group.
  struct Emerging {
    std::shared_ptr<const Effect> effect;
    size_t direction = 0;
    double per_change = 0;
    EffectValues<SingleLane> parameters;
    EffectMemory<SingleLane> memory;
    bool remembers() const { return memory.cols() > 0; }

    size_t group() const { return direction / kLanes; }
    Eigen::Index lane() const { return static_cast<Eigen::Index>(direction % kLanes); }
  };

  void add_effect_forces(const TangentParameters& parameters, const EffectScene<SingleLane>& scene,
                         TangentState& state);
  void add_emerging_forces(const EffectScene<SingleLane>& scene);
  void shift_supports(const TangentParameters& parameters, const EffectScene<SingleLane>& scene,
                      TangentState& state);
  void change_forces(const TangentParameters& parameters, const EffectScene<SingleLane>& scene,
                     const TangentState& state);
  /// Adds what `derivatives_` of effect `e` make of a group's tangents to those of what it acts on.
  void add_actions(size_t e, const LaneParameters<>& parameters, const LaneState<>& state,
                   LaneVectors<>& action);
  /// The same for what also moves its memory on; `pull_n` of held points, or null.
  void apply(size_t e, const LaneParameters<>& parameters, const LaneVectors<>* pull_n,
             LaneVectors<>& action, LaneState<>& state);
  void apply_limit(const TangentParameters& parameters, double time_step_s, TangentState& state);

  const Cloth& cloth_;
  Eigen::VectorXd inverse_mass_per_kg_;
  bool changes_force_ = false, shifts_supports_ = false;  ///< any effect
  HeldPlacement<SingleLane> held_value_;
  HeldPlacement<ExactLanes> held_tangent_;
  ClothSweep<SingleLane> sweep_;
  TangentSweep tangent_sweep_;
  StrainLimiter<SingleLane> limiter_;
  std::vector<LimitMove> moves_;  ///< of the last step's strain limit
  TangentVectors force_n_, pull_n_, target_m_;
  EffectLinearisation derivatives_;
  std::vector<EffectMemory<>> next_memory_;  ///< of each effect
  std::vector<Emerging> emerging_;
  /// Of each group, what emerges in the steps until it is had again, and when it was had last.
  std::vector<LaneVectors<>> carried_n_, emerged_last_n_;
  double since_emerged_s_ = 0;
  bool emerged_once_ = false;
  LaneVectors<> changed_n_;
  LaneArray<> tension_n_;  ///< changes of what one effect's springs pull with
  LaneVectors<SingleLane> emerged_n_, emerged_target_m_;
};

}  // namespace clothfit
