// Checks pieces of the founding paper's study: what determines a parameter, and that finished
// pieces come back from a journal as they went in. The whole: louchet1995_test.cpp.
#include "apps/study/louchet1995/study.h"

#include <gtest/gtest.h>

#include <cmath>

#include "apps/study/louchet1995/determination.h"
#include "apps/study/louchet1995/payload.h"

namespace clothfit {
namespace {

struct SmallMotion {
  PaperExperiment experiment{.vertices_per_side = 5, .duration_s = 0.4};
  RecordedStates states = paper_states(experiment);
};

TEST(Louchet1995Determination, FindsNoStiffnessInTheFirstTransition) {
  const SmallMotion motion;
  const Eigen::VectorXd sigma =
      transition_sigmas(motion.experiment, motion.states, SpringSet::louchet5, 1, 1e-3);
  EXPECT_FALSE(std::isfinite(sigma[3]));  // K
  EXPECT_FALSE(std::isfinite(sigma[4]));  // tau
}

TEST(Louchet1995Determination, GrowsWithTheNoise) {
  const SmallMotion motion;
  const int last = motion.states.last();
  const Eigen::VectorXd once =
      transition_sigmas(motion.experiment, motion.states, SpringSet::louchet5, last, 1e-3);
  const Eigen::VectorXd twice =
      transition_sigmas(motion.experiment, motion.states, SpringSet::louchet5, last, 2e-3);
  ASSERT_TRUE(once.allFinite());
  EXPECT_TRUE(twice.isApprox(2 * once, 1e-6));
}

TEST(Louchet1995Determination, IsTheInverseOfTheInformation) {
  // The textbook's way serves where the problem is well enough conditioned for it.
  const SmallMotion motion;
  const FitProblem problem = paper_problem(motion.experiment, motion.states, SpringSet::louchet5);
  const Eigen::VectorXd truth = paper_truth(motion.experiment, SpringSet::louchet5);
  const StateObjective objective(problem, motion.states, full_cost_transitions(motion.states),
                                 motion.experiment.time_step_s, 1e-3);
  const Eigen::MatrixXd jacobian =
      objective.linearise(truth, Derivatives::tangents).residual_by_coordinate;
  const Eigen::MatrixXd covariance = (jacobian.transpose() * jacobian).inverse();
  const Eigen::VectorXd by_hand = covariance.diagonal()
                                      .cwiseSqrt()
                                      .cwiseProduct(problem.space.value_by_coordinate(truth))
                                      .cwiseQuotient(truth);
  EXPECT_TRUE(relative_sigmas(objective, truth).isApprox(by_hand, 1e-6));
}

TEST(Louchet1995Payload, ComesBackAsItWentIn) {
  SettingSearch search;
  search.grid.resize(2);
  search.grid[0].experiment.vertex_mass_kg = 0.1;
  search.grid[0].match = {
      .usable = true, .cost = {}, .factor = 1.0 / 3, .spread = 0.2, .overshoot = 2};
  search.nearest = {{search.grid[0], 0.1, INFINITY}};
  const SettingSearch read = setting_search_of(to_payload(search));
  ASSERT_EQ(read.grid.size(), 2u);
  EXPECT_EQ(read.grid[0].match.factor, 1.0 / 3);  // every bit
  EXPECT_EQ(read.grid[0].experiment.vertex_mass_kg, 0.1);
  EXPECT_FALSE(read.grid[1].match.usable);
  EXPECT_FALSE(std::isfinite(rank(read.grid[1])));
  EXPECT_EQ(to_payload(read), to_payload(search));

  CostLandscape map{.reference_elongation = 0.5,
                    .stiffness_n_per_m = {1, 2, 3},
                    .elongation = {0.1, 0.2},
                    .value_m2 = Eigen::MatrixXd::Random(3, 2)};
  map.value_m2(2, 1) = INFINITY;
  EXPECT_EQ(landscape_of(to_payload(map)).value_m2, map.value_m2);

  Recovery recovery{.listed = std::vector<Individual>(10), .exact = true, .iterations = 7};
  for (Individual& individual : recovery.listed) individual.values = Eigen::VectorXd::Random(5);
  recovery.strategy = recovery.refined = recovery.listed[3];
  const Recovery again = recovery_of(to_payload(recovery), 5);
  EXPECT_EQ(again.listed[9].values, recovery.listed[9].values);
  EXPECT_EQ(to_payload(again), to_payload(recovery));
}

TEST(Louchet1995Payload, IsRefusedWhereItCannotBeOfThePiece) {
  const auto individual = [](const char* values) {
    return std::string(R"({"values": )") + values + R"(, "cost": 1})";
  };
  const auto recovery = [&](const std::string& listed, const std::string& strategy) {
    return R"({"listed": [)" + listed + R"(], "strategy": )" + strategy + R"(, "refined": )" +
           individual("[1, 2]") +
           R"(, "exact": true, "searches": 1, "refinements": 1, "iterations": 1})";
  };
  const std::string good = individual("[1, 2]"), shorter = individual("[1]");
  EXPECT_NO_THROW(recovery_of(recovery(good, good), 2));
  EXPECT_THROW(recovery_of(recovery("", good), 2), std::exception);
  EXPECT_THROW(recovery_of(recovery(shorter, good), 2), std::exception);
  EXPECT_THROW(recovery_of(recovery(good, shorter), 2), std::exception);
  EXPECT_THROW(recovery_of("[]", 2), std::exception);

  const auto landscape = [](const char* cost, const char* stiffness) {
    return std::string(R"({"reference_elongation": 0.5, "cost": )") + cost + R"(, "stiffness": )" +
           stiffness + R"(, "elongation": [1, 2], "value": [1, 2, 3, 4], "transitions": 3})";
  };
  EXPECT_NO_THROW(landscape_of(landscape("1", "[1, 2]")));
  EXPECT_THROW(landscape_of(landscape("2", "[1, 2]")), std::exception);
  EXPECT_THROW(landscape_of(landscape("-1", "[1, 2]")), std::exception);
  EXPECT_THROW(landscape_of(landscape("1", "[1, 2, 3]")), std::exception);
}

TEST(CostLandscape, CountsTheTrapsBesideTheLowestPlace) {
  CostLandscape map;
  map.value_m2.resize(5, 3);
  map.value_m2 << 9, 9, 9,  //
      9, 0, 9,              //
      9, 9, 9,              //
      9, 9, 4,              //
      9, 9, 9;
  EXPECT_EQ(map.lowest(), (std::pair<Eigen::Index, Eigen::Index>(1, 1)));
  EXPECT_EQ(map.other_minima(), 1);
}

}  // namespace
}  // namespace clothfit
