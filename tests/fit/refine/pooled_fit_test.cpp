// Several recordings of one cloth in one fit. What a single recording's residuals and derivatives
// are is checked in objective_test.cpp; what a pool of misspecified fits is good for, in
// tests/apps/study/trials/planted_drag_test.cpp.
#include "fit/refine/pooled_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "data/input_error.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/prior_cost.h"
#include "model/cloth/stability.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

SyntheticCloth tiny_cloth(unsigned seed) {
  return {
      .mesh = 5, .markers = 5, .frames = 20, .held_out_from = 20, .noise_m = 5e-4, .seed = seed};
}

std::map<std::string, double> truth() {
  return named(SyntheticCloth{}.fabric);
}

Eigen::VectorXd true_coordinates(const FitProblem& problem) {
  return start_with(problem, SyntheticCloth{}.fabric);
}

/// The problem's observations without noise: where the model with the true fabric has the markers,
/// the sheet being turned and shifted a little as `seed` has it.
void make_exact(FitProblem& problem, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Eigen::VectorXd values = true_coordinates(problem);
  for (const Binding& binding : problem.sheet_motion)
    values[binding.parameter] = 2e-3 * uniform(generator);
  const double time_step_s =
      stable_time_step_s(problem.cloth, parameter_set(problem, values)) / 1.5;
  const auto markers = marker_positions(
      problem.vertex_weights,
      run_model(problem, {values}, problem.frames(), time_step_s).front().position_m);
  for (Observation& row : problem.observations.front().rows)
    row.observed = markers[static_cast<size_t>(row.frame)].col(row.marker);
}

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Two recordings of one cloth, one with an uncertain vertical. A fit of both adds up their costs,
/// at a time step of 1 ms.
struct TwoRecordings {
  FitProblem first = make_problem(synthetic_input(tiny_cloth(1)), {}, 5, 5);
  FitProblem second = make_problem(seen(), {.observations = ObservationKind::tracks2d}, 5, 5);
  std::array<const FitProblem*, 2> problems{&first, &second};
  PooledSpace space{problems};

  static FitInput seen() {
    FitInput input = synthetic_input(tiny_cloth(2));
    input.cameras[0].camera_from_world->covariance = Eigen::Matrix<double, 6, 6>::Identity() * 9e-6;
    return input;
  }

  TrajectoryObjective objective(size_t n) const {
    return {*problems[n], problems[n]->first_held_out, 1e-3};
  }

  /// Near the truth, but off the optimum.
  Eigen::VectorXd somewhere() const {
    std::mt19937_64 generator(5);
    std::uniform_real_distribution<double> uniform(-0.2, 0.2);
    Eigen::VectorXd x = space.coordinates({true_coordinates(first), true_coordinates(second)});
    for (double& coordinate : x) coordinate += uniform(generator);
    return x;
  }

  /// Half the sum of squares of all residuals and of the priors. Directions, of each recording or
  /// none, are errors by as much as lowers it most.
  double cost_at(const Eigen::VectorXd& x, const std::vector<Eigen::MatrixXd>& directions) const {
    const std::vector<Eigen::VectorXd> values = space.values(x);
    double cost = 0;
    for (size_t n = 0; n < problems.size(); ++n) {
      const Eigen::VectorXd residual = objective(n).residuals({values[n]}).front();
      const Eigen::VectorXd amounts = best_amounts(directions[n], residual);
      cost += 0.5 * (residual + directions[n] * amounts).squaredNorm() +
              0.5 * amounts.squaredNorm() + prior_cost(*problems[n], values[n]).cost;
    }
    return cost;
  }

  PooledSpace::Expansion expansion_at(const Eigen::VectorXd& x,
                                      const std::vector<Eigen::MatrixXd>& directions) const {
    const std::vector<Eigen::VectorXd> values = space.values(x);
    std::vector<Quadratic> quadratics;
    for (size_t n = 0; n < problems.size(); ++n) {
      PooledPart part;
      part.values = values[n];
      part.frames = problems[n]->first_held_out;
      part.steps = 1e-3;
      part.linear = objective(n).linearise(values[n]);
      part.directions = directions[n];
      part.amplitudes = best_amounts(part.directions, part.linear.residual);
      quadratics.push_back(quadratic_of(*problems[n], part, kInfinite));
    }
    return space.gather(quadratics);
  }

  static Eigen::VectorXd best_amounts(const Eigen::MatrixXd& directions,
                                      const Eigen::VectorXd& residual) {
    if (directions.cols() == 0) return {};
    Eigen::MatrixXd information = directions.transpose() * directions;
    information.diagonal().array() += 1;
    return -information.ldlt().solve(directions.transpose() * residual);
  }

  /// `count` smooth fields of some sigmas for each recording.
  std::vector<Eigen::MatrixXd> directions(int count) const {
    std::vector<Eigen::MatrixXd> all;
    for (size_t n = 0; n < problems.size(); ++n)
      all.push_back(Eigen::MatrixXd::NullaryExpr(
          objective(n).residual_count(), count, [&](Eigen::Index row, Eigen::Index column) {
            return 2 * std::sin(0.01 * static_cast<double>((column + 1) * row));
          }));
    return all;
  }
};

TEST(Quadratic, HasTheGradientThatDifferencesOfTheCostShow) {
  const TwoRecordings both;
  const PooledSpace& space = both.space;
  ASSERT_EQ(space.shared(), 7);
  ASSERT_EQ(space.size(), 7 + 6 + 8);  // each its sheet's pose; the second its vertical too
  const Eigen::VectorXd x = both.somewhere();
  for (const int count : {0, 2}) {
    SCOPED_TRACE(testing::Message() << count << " directions");
    const std::vector<Eigen::MatrixXd> directions = both.directions(count);

    const PooledSpace::Expansion expansion = both.expansion_at(x, directions);

    ASSERT_TRUE(expansion.usable);
    EXPECT_NEAR(expansion.cost, both.cost_at(x, directions), 1e-9 * expansion.cost);
    for (int p = 0; p < space.size(); ++p) {
      SCOPED_TRACE(p);
      Eigen::VectorXd above = x, below = x;
      above[p] += 1e-4;
      below[p] -= 1e-4;
      const double difference =
          (both.cost_at(above, directions) - both.cost_at(below, directions)) / 2e-4;
      // Truncation of the difference is its step's square, 1e-8, times the cost's third derivative.
      EXPECT_NEAR(expansion.gradient[p], difference,
                  1e-5 * expansion.gradient.cwiseAbs().maxCoeff());
    }
  }
}

// Directions of unit variance are a covariance I + E E': with these eliminated a part's
// cost is that of generalised least squares, of the residual less what is expected.
TEST(Quadratic, CountsDirectionsAsACovariance) {
  const FitProblem problem = make_problem(synthetic_input(tiny_cloth(1)), {}, 5, 5);
  ASSERT_TRUE(problem.priors.empty());
  const Eigen::Index rows = TrajectoryObjective(problem, 4, 1e-3).residual_count();
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  const auto random = [&](Eigen::Index columns) {
    return Eigen::MatrixXd(
        Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(generator); }));
  };
  const Eigen::MatrixXd jacobian = random(problem.space.size()), errs = 2 * random(3);
  const Eigen::VectorXd residual = random(1), correction = random(1);
  PooledPart part;
  part.values = true_coordinates(problem);
  part.frames = 4;
  part.steps = 1e-3;
  part.linear.residual = residual - correction;
  part.correction = correction;
  part.linear.residual_by_coordinate = jacobian;
  part.linear.usable = true;
  part.directions = errs;
  part.amplitudes = TwoRecordings::best_amounts(errs, residual);

  const Quadratic quadratic = quadratic_of(problem, part, kInfinite);

  const Eigen::MatrixXd inverse =
      (Eigen::MatrixXd::Identity(rows, rows) + errs * errs.transpose()).inverse();
  ASSERT_TRUE(quadratic.usable);
  EXPECT_NEAR(quadratic.cost, 0.5 * residual.dot(inverse * residual), 1e-9 * quadratic.cost);
  const Eigen::VectorXd gradient = jacobian.transpose() * inverse * residual;
  EXPECT_LT((quadratic.gradient - gradient).norm(), 1e-9 * gradient.norm());
  const Eigen::MatrixXd information = jacobian.transpose() * inverse * jacobian;
  EXPECT_LT((quadratic.information - information).norm(), 1e-9 * information.norm());
  // Amounts that are not at their least give the same way down.
  part.amplitudes.setZero();
  EXPECT_LT((quadratic_of(problem, part, kInfinite).gradient - gradient).norm(),
            1e-9 * gradient.norm());
}

TEST(PooledSpace, StepsAsTheWholeSystemOfEquationsSays) {
  const FitProblem first = make_problem(synthetic_input(tiny_cloth(1)), {}, 5, 5);
  const FitProblem second = make_problem(synthetic_input(tiny_cloth(2)), {}, 5, 5);
  const FitProblem* const problems[] = {&first, &second};
  const PooledSpace space(problems);
  std::vector<Quadratic> quadratics;
  for (const FitProblem* problem : problems) {
    const Eigen::VectorXd values = true_coordinates(*problem);
    const TrajectoryObjective objective(*problem, problem->first_held_out, 1e-3);
    PooledPart part;
    part.values = values;
    part.frames = problem->first_held_out;
    part.steps = 1e-3;
    part.linear = objective.linearise(values);
    quadratics.push_back(quadratic_of(*problem, part, kInfinite));
  }
  const PooledSpace::Expansion e = space.gather(quadratics);
  ASSERT_TRUE(e.usable);
  ASSERT_EQ(space.size(), 19);
  std::vector<bool> held(19, false);
  held[2] = held[9] = true;

  const Eigen::VectorXd step = space.step(e, 0.1, held);

  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(19, 19);
  whole.topLeftCorner(7, 7) = e.shared;
  for (int n = 0; n < 2; ++n) {
    whole.block(7 + 6 * n, 7 + 6 * n, 6, 6) = e.own[static_cast<size_t>(n)];
    whole.block(7 + 6 * n, 0, 6, 7) = e.between[static_cast<size_t>(n)];
    whole.block(0, 7 + 6 * n, 7, 6) = e.between[static_cast<size_t>(n)].transpose();
  }
  const double fall = -e.gradient.dot(step) - 0.5 * step.dot(whole * step);
  EXPECT_NEAR(space.predicted_decrease(e, step), fall, 1e-9 * fall);
  EXPECT_GT(fall, 0);
  whole.diagonal() *= 1.1;
  std::vector<int> free;
  for (int p = 0; p < 19; ++p)
    if (!held[static_cast<size_t>(p)]) free.push_back(p);
  const Eigen::MatrixXd system = whole(free, free);
  const Eigen::VectorXd expected = system.ldlt().solve(Eigen::VectorXd(-e.gradient(free)));
  EXPECT_LT((step(free) - expected).norm(), 1e-8 * expected.norm());
  EXPECT_EQ(step[2], 0);
  EXPECT_EQ(step[9], 0);
}

TEST(PooledFit, RecoversTheTruthFromTwoRecordingsWithoutNoise) {
  FitProblem first = make_problem(synthetic_input(tiny_cloth(1)), {}, 5, 5);
  FitProblem second = make_problem(synthetic_input(tiny_cloth(2)), {}, 5, 5);
  make_exact(first, 1);
  make_exact(second, 2);
  const FitProblem* const problems[] = {&first, &second};
  std::map<std::string, double> start = truth();
  double off = 1.3;
  for (auto& [name, value] : start) {
    value *= off;
    off = 1 / off;
  }

  const PooledFit found = fit_pooled(problems, start, {}, {});

  ASSERT_TRUE(found.usable);
  EXPECT_TRUE(found.converged) << found.message << " after " << found.iterations;
  for (const auto& [name, value] : truth()) {
    SCOPED_TRACE(name);
    // The last round's time steps are those of values this near.
    EXPECT_NEAR(found.shared.at(name), value, 1e-4 * value);
  }
}

TEST(PooledFit, EndsAfterTheWorkThatItIsAllowed) {
  FitProblem problem = make_problem(synthetic_input(tiny_cloth(1)), {}, 5, 5);
  make_exact(problem, 1);
  const FitProblem* const problems[] = {&problem};
  std::map<std::string, double> start = truth();
  for (auto& [name, value] : start) value *= 1.3;
  PooledOptions options;
  options.most_spring_steps = 1;  // the first derivatives cost far more

  const PooledFit found = fit_pooled(problems, start, options, {});

  ASSERT_TRUE(found.usable);
  EXPECT_FALSE(found.converged);
  EXPECT_EQ(found.iterations, 0);
  options.most_spring_steps = 1e18;
  EXPECT_GT(fit_pooled(problems, start, options, {}).iterations, 1);
}

TEST(PooledFit, OfTheRecordingsOwnAloneLeavesThePhysicsWhereItIs) {
  FitProblem problem = make_problem(synthetic_input(tiny_cloth(1)), {}, 5, 5);
  make_exact(problem, 1);
  ASSERT_FALSE(problem.sheet_motion.empty());
  const FitProblem* const problems[] = {&problem};

  const PooledFit found = fit_pooled(problems, truth(), {.own_only = true}, {});

  ASSERT_TRUE(found.usable);
  EXPECT_TRUE(found.converged) << found.message;
  for (const auto& [name, value] : truth())
    EXPECT_NEAR(found.shared.at(name), value, 1e-12 * value);
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const Binding& binding : problem.sheet_motion)
    EXPECT_NEAR(found.parts.front().values[binding.parameter], 2e-3 * uniform(generator), 1e-6);
}

TEST(PooledFit, GoesRoughlyTheWholeWayWithTheDerivativesThatItBeginsWith) {
  FitProblem problem = make_problem(synthetic_input(tiny_cloth(1)), {}, 5, 5);
  make_exact(problem, 1);
  const FitProblem* const problems[] = {&problem};
  PooledPart part;
  part.values = 1.05 * true_coordinates(problem);
  part.frames = problem.first_held_out;
  part.steps = stable_time_steps(problem.cloth, parameter_set(problem, part.values)).times(0.5);
  part.linear = TrajectoryObjective(problem, part.frames, part.steps).linearise(part.values);
  part.borrowed = true;
  const double start = 0.5 * part.linear.residual.squaredNorm();

  const PooledFit found =
      fit_pooled(problems, {part}, {.updated_within = 0.1, .unrefined = true}, {});

  ASSERT_TRUE(found.usable);
  EXPECT_LT(found.cost, 1e-3 * start);
  EXPECT_TRUE(found.parts.front().borrowed) << "derivatives were computed";
}

TEST(PooledFit, LiesBetweenTheFitsOfItsRecordingsAlone) {
  const FitProblem first = make_problem(synthetic_input(tiny_cloth(3)), {}, 5, 5);
  const FitProblem second = make_problem(synthetic_input(tiny_cloth(4)), {}, 5, 5);
  const FitProblem* const both[] = {&first, &second};

  const PooledFit pooled = fit_pooled(both, truth(), {}, {});
  const PooledFit one = fit_pooled(std::span(both).first(1), truth(), {}, {});
  const PooledFit other = fit_pooled(std::span(both).last(1), truth(), {}, {});

  ASSERT_TRUE(pooled.usable && one.usable && other.usable);
  // Together they cannot be explained better than each by itself.
  EXPECT_GT(pooled.cost, one.cost + other.cost);
  // The best determined parameter hardly trades against others, so it lies between the two.
  const auto [low, high] = std::minmax(one.shared.at("shear"), other.shared.at("shear"));
  EXPECT_GT(pooled.shared.at("shear"), low);
  EXPECT_LT(pooled.shared.at("shear"), high);
}

TEST(PooledFit, RefusesRecordingsOfDifferentPhysics) {
  const FitProblem plain = make_problem(synthetic_input(tiny_cloth(1)), {}, 5, 5);
  const FitProblem windy =
      make_problem(synthetic_input(tiny_cloth(1)), {.effects = {"wind"}}, 5, 5);
  const FitProblem* const problems[] = {&plain, &windy};
  const FitProblem* const turned[] = {&windy, &plain};

  EXPECT_THROW(fit_pooled(problems, truth(), {}, {}), InputError);
  EXPECT_THROW(fit_pooled(turned, truth(), {}, {}), InputError);
}

}  // namespace
}  // namespace clothfit
