// Checks the founding paper's costs over recorded states. Not checked here: a step and its
// derivatives (tests/model), how the searches lower a cost (evolutionary_strategy_test.cpp), and
// the paper's experiment as a whole (louchet1995_test.cpp).
#include "fit/cost/state_objective.h"

#include <gtest/gtest.h>

#include "apps/study/louchet1995/paper_problem.h"
#include "fit/problem/parameterised_model.h"
#include "model/integrate/simulate.h"

namespace clothfit {
namespace {

/// A small cloth of the paper's kind after half a second, many of its springs at the limit.
struct SmallExperiment {
  PaperExperiment experiment{.vertices_per_side = 7,
                             .time_step_s = 0.01,
                             .duration_s = 0.5,
                             .damping_per_s = 0.5,
                             .limit = StrainLimitMode::positions};
  RecordedStates states;
  FitProblem problem;

  explicit SmallExperiment(SpringSet set = SpringSet::louchet5) {
    experiment.reference.critical_elongation = 0.1;
    states = paper_states(experiment);
    problem = paper_problem(experiment, states, set);
  }
  Eigen::VectorXd truth() const { return paper_truth(experiment, problem.spring_set); }
  StateObjective full() const {
    return {problem, states, full_cost_transitions(states), experiment.time_step_s};
  }
  StateObjective small() const {
    return {problem, states, small_cost_transitions(states), experiment.time_step_s};
  }
};

TEST(StateObjective, VanishesAtTheTruthAndNowhereNearIt) {
  for (const SpringSet set : {SpringSet::louchet5, SpringSet::louchet18}) {
    const SmallExperiment paper(set);
    for (const StateObjective& objective : {paper.full(), paper.small()}) {
      SCOPED_TRACE(to_string(set) + " " + objective.name());
      EXPECT_EQ(objective.residuals({paper.truth()}).front().norm(), 0);  // the same steps
      for (int p = 0; p < paper.problem.space.size(); ++p) {
        Eigen::VectorXd off = paper.truth();
        off[p] *= 1.001;
        EXPECT_GT(objective.residuals({off}).front().norm(), 0) << p;
      }
    }
  }
}

TEST(StateObjective, IsThePapersSum) {
  // Given another stiffness, and the prediction of the last state from the one before it by hand,
  const SmallExperiment paper;
  Eigen::VectorXd values = paper.truth();
  values[3] *= 1.5;
  const size_t last = paper.states.time_s.size() - 1;
  ParameterSet set = parameter_set(paper.problem, values);
  set.start_position_m = paper.states.position_m[last - 1];
  set.start_velocity_m_per_s = paper.states.velocity_m_per_s[last - 1];
  const double dt_s = paper.states.time_s[last] - paper.states.time_s[last - 1];
  const SimulateResult run =
      simulate(paper.problem.cloth, {&set, 1},
               {.frame_time_s = {0, dt_s}, .time_step_s = 1, .velocities = true})
          .front();

  const double cost = paper.small().residuals({values}).front().squaredNorm();

  // then the cost is the sum of squared differences of positions and dt times velocities.
  const double by_hand =
      (run.position_m[1] - paper.states.position_m[last]).squaredNorm() +
      dt_s * dt_s * (run.velocity_m_per_s[1] - paper.states.velocity_m_per_s[last]).squaredNorm();
  EXPECT_NEAR(cost, by_hand, 1e-12 * by_hand);
  EXPECT_GT(cost, 1e-8);
  // The full cost adds the other transitions'.
  double sum = 0;
  for (const int transition : full_cost_transitions(paper.states))
    sum += StateObjective(paper.problem, paper.states, {transition}, paper.experiment.time_step_s)
               .residuals({values})
               .front()
               .squaredNorm();
  EXPECT_NEAR(paper.full().residuals({values}).front().squaredNorm(), sum, 1e-12 * sum);
}

TEST(StateObjective, DerivativesAgreeWithDifferences) {
  for (const SpringSet set : {SpringSet::louchet5, SpringSet::louchet18}) {
    const SmallExperiment paper(set);
    Eigen::VectorXd values = paper.truth();
    for (int p = 0; p < values.size(); ++p) values[p] *= p % 2 == 0 ? 1.003 : 0.998;
    for (const StateObjective& objective : {paper.full(), paper.small()}) {
      SCOPED_TRACE(to_string(set) + " " + objective.name());
      const Linearisation exact = objective.linearise(values);
      // The step is narrow, so that no spring comes to its limit or leaves it in between.
      const Linearisation narrow = objective.linearise(values, Derivatives::central, 1e-7);

      ASSERT_TRUE(exact.usable && narrow.usable);
      EXPECT_EQ(exact.residual, objective.residuals({values}).front());
      for (int p = 0; p < values.size(); ++p) {
        const Eigen::VectorXd& column = exact.residual_by_coordinate.col(p);
        EXPECT_LT((column - narrow.residual_by_coordinate.col(p)).norm(), 1e-6 * column.norm())
            << paper.problem.space.parameters[static_cast<size_t>(p)].name;
      }
    }
  }
}

TEST(StateObjective, SaysNothingOfAClothAtRestInItsNaturalLengths) {
  // The paper itself makes this exception: in its first state no spring is stretched, so no
  // stiffness shows.
  const SmallExperiment paper;
  const StateObjective first(paper.problem, paper.states, {1}, paper.experiment.time_step_s);

  const Linearisation linear = first.linearise(paper.truth());

  ASSERT_TRUE(linear.usable);
  EXPECT_LT(linear.residual_by_coordinate.col(3).norm(), 1e-12);  // K
  EXPECT_EQ(linear.residual_by_coordinate.col(4).norm(), 0);      // tau
  EXPECT_GT(linear.residual_by_coordinate.col(0).norm(), 1e-5);   // l01
}

}  // namespace
}  // namespace clothfit
