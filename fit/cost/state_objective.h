#pragma once

#include <Eigen/Core>
#include <vector>

#include "fit/cost/objective.h"

namespace clothfit {

/// Positions and velocities of every vertex at successive times, 3 x vertices each (world, m, m/s).
struct RecordedStates {
  std::vector<double> time_s;
  std::vector<Eigen::Matrix3Xd> position_m, velocity_m_per_s;
  int last() const { return static_cast<int>(time_s.size()) - 1; }
};

/// Returns every state of a run of `duration_s`, with a state at each of its equal time steps.
RecordedStates simulate_states(const Cloth& cloth, const ParameterSet& parameters,
                               double time_step_s, double duration_s);

/// Return the transitions of the founding paper's cost functions [louchet1995, section 3.2]. State
/// n is predicted from state n - 1.
std::vector<int> full_cost_transitions(const RecordedStates& states);   ///< 1, 2, ... last
std::vector<int> small_cost_transitions(const RecordedStates& states);  ///< the last alone

/// The founding paper's cost [louchet1995, section 3.2]. The model predicts each state from the
/// recorded one before, so that prediction and record cannot drift apart:
///
///   sum over transitions and vertices of |p_p - p_r|^2 + dt^2 |v_p - v_r|^2
///
/// dt is the interval between the two states. The paper leaves it open ("of the same order of
/// magnitude as the time step"). Residuals are those six differences of each vertex, in `unit_m`.
/// Intervals are cut into equal time steps of at most `time_step_s`.
class StateObjective final : public Objective {
 public:
  /// `problem` gives parameters, mesh, gravity, effects and held points; its observations and its
  /// start play no part. `problem` and `states` must outlive the objective.
  StateObjective(const FitProblem& problem, const RecordedStates& states,
                 std::vector<int> transitions, double time_step_s, double unit_m = 1);

  std::string name() const override;
  bool needs_stable_step() const override { return false; }
  double spring_steps_per_run() const override;
  std::vector<Eigen::VectorXd> residuals(const std::vector<Eigen::VectorXd>& values) const override;
  using Objective::linearise;
  Linearisation linearise(const Eigen::VectorXd& values) const override;

 private:
  ParameterSet between_states(const Eigen::VectorXd& values) const;

  const RecordedStates& states_;
  std::vector<int> transitions_;
  double unit_m_;
};

}  // namespace clothfit
