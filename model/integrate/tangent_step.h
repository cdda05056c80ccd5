#pragma once

#include <array>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/effects/linearisation.h"
#include "model/integrate/step.h"
#include "model/kernels/tangent_sweep.h"

namespace clothfit {

/// Interval over which forces of effects that emerge are carried on (EmergingEffect).
inline constexpr double kEmergingInterval_s = 1e-3;

/// An effect that the cloth does not have, near its neutral values. The ratio of its action to a
/// small change of one parameter is how a simulation begins to change. Its own derivatives are not
/// needed, so it costs as much as in one simulation. Steps are far shorter than cloth takes to
/// move; a force that depends on no memory is therefore computed once in kEmergingInterval_s and
/// carried on between, to second order in that.
struct EmergingEffect {
  std::shared_ptr<const Effect> effect;
  std::vector<double> parameters;  ///< neutral, but for one
  double change = 0;  ///< along the direction, whose unit may differ from the parameter's
  Eigen::VectorXd start_memory;  ///< empty: zeros
};

/// The change of one simulation along a direction: the derivatives of a ParameterSet and of its
/// other inputs. Members left empty do not change.
struct Direction {
  std::array<double, kSpringTypes> natural_length_m{}, stiffness_n_per_m{}, damping_ns_per_m{};
  std::array<double, kSpringTypes> critical_elongation{};
  Eigen::Vector3d gravity_m_per_s2 = Eigen::Vector3d::Zero();
  std::vector<std::vector<double>> effects;  ///< parameters of each effect of the cloth
  Eigen::Matrix3Xd start_position_m, start_velocity_m_per_s;  ///< 3 x vertices
  std::vector<Eigen::VectorXd> start_effect_memory;           ///< of each effect of the cloth
  /// The change of each held point's place (m). A point without a motion of its own moves with the
  /// start positions.
  std::vector<std::function<Eigen::Vector3d(double time_s)>> held_motion;
  std::optional<EmergingEffect> emerging;
};

/// The parameters of one simulation and their changes along directions, as many as lanes in each
/// group. Missing directions of the last group are zero.
template <class L = ExactLanes>
struct TangentParameters {
  LaneParameters<SingleLane> value;
  std::vector<LaneParameters<L>> tangent;  ///< of each group

  static TangentParameters of(const Cloth& cloth, const ParameterSet& set,
                              std::span<const Direction> directions);
};

/// Places or motions of one simulation with their changes along the directions of each group.
template <class L = ExactLanes>
struct TangentVectors {
  LaneVectors<SingleLane> value;
  std::vector<LaneVectors<L>> tangent;
};

/// One simulation and its derivatives along directions.
template <class L = ExactLanes>
struct TangentState {
  LaneState<SingleLane> value;
  std::vector<LaneState<L>> tangent;  ///< of each group

  /// Returns their start; one group at least.
  static TangentState of(const Cloth& cloth, const ParameterSet& set,
                         std::span<const Direction> directions);
};

/// Steps one simulation together with its derivatives along any number of directions. They are
/// exact for the discrete scheme, the springs at their strain limit included, where it is smooth.
/// The action of effects is linearised once for all of them. The simulation itself has the bits
/// that EulerStepper gives it. Holds scratch memory: one object per thread.
template <class L = ExactLanes>
class TangentStepper {
 public:
  /// `cloth` must outlive the stepper. `directions` name the effects that emerge along them.
  /// Derivatives of effects' forces serve for the steps within `kept_s`, where the force depends on
  /// no memory and does not set in suddenly. That is off by the motion in half of that time.
  explicit TangentStepper(const Cloth& cloth, std::span<const Direction> directions = {},
                          double kept_s = 0);

  /// Returns the memory of the effect that emerges along a direction; empty where none does.
  Eigen::VectorXd emerging_memory(size_t direction) const;

  /// Returns where the held points are.
  TangentVectors<L> locate(const TangentState<L>& state) const;

  /// Takes one time step, as EulerStepper::step does.
  void step(const TangentParameters<L>& parameters, const TangentVectors<L>& held_target_m,
            double time_s, double time_step_s, TangentState<L>& state);

 private:
  /// An effect that emerges along the direction of one lane of a group.
  struct Emerging {
    std::shared_ptr<const Effect> effect;
    size_t direction = 0;
    double per_change = 0;
    EffectValues<SingleLane> parameters;
    EffectMemory<SingleLane> memory;
    bool remembers() const { return memory.cols() > 0; }

    size_t group() const { return direction / L::kCount; }
    Eigen::Index lane() const { return static_cast<Eigen::Index>(direction % L::kCount); }
  };

  /// Derivatives of one effect's forces, when they were taken, and how long they serve.
  struct KeptDerivatives {
    EffectLinearisation of;
    double lasts_s = 0;
    double taken_s = -std::numeric_limits<double>::infinity();
  };

  void add_effect_forces(const TangentParameters<L>& parameters,
                         const EffectScene<SingleLane>& scene, TangentState<L>& state);
  template <class Linearise>
  const EffectLinearisation& derivatives_of(size_t effect, const TangentParameters<L>& parameters,
                                            const EffectScene<SingleLane>& scene,
                                            KeptDerivatives& kept, const Linearise& linearise);
  void add_emerging_forces(const EffectScene<SingleLane>& scene);
  void shift_supports(const TangentParameters<L>& parameters, const EffectScene<SingleLane>& scene,
                      TangentState<L>& state);
  void change_forces(const TangentParameters<L>& parameters, const EffectScene<SingleLane>& scene,
                     const TangentState<L>& state);
  /// Adds the products of derivatives of effect `e` with a group's tangents to those of its action.
  void add_actions(size_t e, const EffectLinearisation& derivatives,
                   const LaneParameters<L>& parameters, const LaneState<L>& state,
                   LaneVectors<L>& action);
  /// Adds them and advances the memory too; `pull_n` of held points, or null.
  void apply(size_t e, const EffectLinearisation& derivatives, const LaneParameters<L>& parameters,
             const LaneVectors<L>* pull_n, LaneVectors<L>& action, LaneState<L>& state);
  void apply_limit(const TangentParameters<L>& parameters, double time_step_s,
                   TangentState<L>& state);

  const Cloth& cloth_;
  Eigen::VectorXd inverse_mass_per_kg_;
  bool changes_force_ = false, shifts_supports_ = false;  ///< any effect
  HeldPlacement<SingleLane> held_value_;
  HeldPlacement<L> held_tangent_;
  ClothSweep<SingleLane> sweep_;
  TangentSweep tangent_sweep_;
  StrainLimiter<SingleLane> limiter_;
  std::vector<LimitMove> moves_;  ///< of the last step's strain limit
  TangentVectors<L> force_n_, pull_n_, target_m_;
  EffectLinearisation derivatives_;
  std::vector<EffectMemory<L>> next_memory_;             ///< of each effect
  std::vector<KeptDerivatives> of_forces_, of_changes_;  ///< of each effect
  std::vector<Emerging> emerging_;
  /// For each group: the emerging force until it is computed again, and when that last was.
  std::vector<LaneVectors<L>> carried_n_, emerged_last_n_;
  double since_emerged_s_ = 0;
  bool emerged_once_ = false;
  LaneVectors<L> changed_n_;
  LaneArray<L> tension_n_;  ///< changes of the pulls of one effect's springs
  LaneVectors<SingleLane> emerged_n_, emerged_target_m_;
};

}  // namespace clothfit
