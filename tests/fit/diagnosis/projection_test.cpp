// Checks the projection of residuals, and what columns explain of the rest.
#include "fit/diagnosis/projection.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "fit/problem/prior_cost.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(rng); });
}

Eigen::VectorXd ends(Eigen::Index size, double value) {
  return Eigen::VectorXd::Constant(size, value);
}

TEST(Projection, LeavesTheResidualsOfLeastSquares) {
  const Eigen::MatrixXd jacobian = random_matrix(40, 4, 1);
  const Eigen::VectorXd residual = random_matrix(40, 1, 2);
  const Eigen::VectorXd weight = random_matrix(40, 1, 3).cwiseAbs2();
  const Projection projection(jacobian, Eigen::MatrixXd::Zero(4, 4), Eigen::VectorXd::Zero(4),
                              Eigen::MatrixXd(40, 0), weight, residual);

  const Eigen::VectorXd root = weight.cwiseSqrt();
  const Eigen::MatrixXd a = root.asDiagonal() * jacobian;
  const Eigen::VectorXd b = root.cwiseProduct(residual);
  const Eigen::VectorXd left = b - a * a.colPivHouseholderQr().solve(b);

  EXPECT_LT((projection.residual().head(40) - left).norm(), 1e-9 * left.norm());
  EXPECT_LT((a.transpose() * projection.columns(residual).topRows(40)).norm(), 1e-9 * left.norm());
  EXPECT_NEAR(projection.taken(), 4, 1e-9);
  EXPECT_NEAR(projection.weights(), weight.sum(), 1e-12 * weight.sum());
}

TEST(Projection, LeavesAllWhereNothingIsFitted) {
  const Eigen::VectorXd residual = random_matrix(20, 1, 8);
  const Eigen::VectorXd weight = random_matrix(20, 1, 9).cwiseAbs2();
  const Projection projection(Eigen::MatrixXd(20, 0), Eigen::MatrixXd(0, 0), Eigen::VectorXd(0),
                              Eigen::MatrixXd(20, 0), weight, residual);

  const Eigen::VectorXd whitened = weight.cwiseSqrt().cwiseProduct(residual);
  EXPECT_EQ(projection.residual(), whitened);
  EXPECT_EQ(projection.columns(residual).col(0), whitened);
  EXPECT_EQ(projection.taken(), 0);
}

TEST(Projection, TakesOutDirectionsWhereNothingElseIsFitted) {
  const Eigen::VectorXd residual = random_matrix(20, 1, 10), direction = random_matrix(20, 1, 11);
  const Projection projection(Eigen::MatrixXd(20, 0), Eigen::MatrixXd(0, 0), Eigen::VectorXd(0),
                              direction, Eigen::VectorXd::Ones(20), residual);

  const Eigen::MatrixXd covariance =
      Eigen::MatrixXd::Identity(20, 20) + direction * direction.transpose();
  EXPECT_NEAR(projection.residual().squaredNorm(), residual.dot(covariance.inverse() * residual),
              1e-9 * residual.squaredNorm());
}

// Directions of unit variance are a covariance I + E E'. Amplitudes found with them are those of
// generalised least squares.
TEST(Projection, CountsUnitDirectionsAsACovariance) {
  const Eigen::MatrixXd jacobian = random_matrix(30, 3, 4), errs = 3 * random_matrix(30, 2, 5);
  const Eigen::MatrixXd effect = random_matrix(30, 2, 6);
  const Eigen::VectorXd residual = random_matrix(30, 1, 7);
  const Projection projection(jacobian, Eigen::MatrixXd::Zero(3, 3), Eigen::VectorXd::Zero(3), errs,
                              Eigen::VectorXd::Ones(30), residual);
  const Explained explained = explain(projection.residual(), projection.columns(effect),
                                      ends(2, -kInfinite), ends(2, kInfinite));

  const Eigen::MatrixXd inverse =
      (Eigen::MatrixXd::Identity(30, 30) + errs * errs.transpose()).inverse();
  Eigen::MatrixXd all(30, 5);
  all << jacobian, effect;
  const Eigen::VectorXd expected =
      -(all.transpose() * inverse * all).ldlt().solve(all.transpose() * inverse * residual);

  EXPECT_LT((explained.amplitude - expected.tail(2)).norm(), 1e-8 * expected.tail(2).norm());
  const double decrease = residual.dot(inverse * residual) -
                          (residual + all * expected).dot(inverse * (residual + all * expected)) -
                          (residual.dot(inverse * residual) - projection.residual().squaredNorm());
  EXPECT_NEAR(explained.decrease, decrease, 1e-8 * projection.residual().squaredNorm());
}

TEST(Projection, LeavesNothingOfWhatTheModelCanDoItself) {
  const Eigen::MatrixXd jacobian = random_matrix(40, 4, 8);
  const Projection projection(jacobian, Eigen::MatrixXd::Zero(4, 4), Eigen::VectorXd::Zero(4),
                              Eigen::MatrixXd(40, 0), Eigen::VectorXd::Ones(40),
                              random_matrix(40, 1, 9));

  EXPECT_EQ(projection.columns(jacobian * random_matrix(4, 2, 10)).norm(), 0);
}

/// Makes two small recordings of one cloth, with random numbers for the residuals of runs. The
/// second one has a vertical that is known by a prior.
FittedModel model_of_noise(int directions) {
  const SyntheticCloth tiny{.mesh = 5, .markers = 5, .frames = 20, .held_out_from = 20};
  const FitInput plain = synthetic_input(tiny);
  FitInput uncertain = plain;
  uncertain.cameras[0].camera_from_world->covariance =
      1e-6 * Eigen::Matrix<double, 6, 6>::Identity();
  FittedModel model;
  for (const FitInput& input : {plain, uncertain}) {
    model.problems.push_back(std::make_shared<const FitProblem>(
        make_problem(input, {.observations = ObservationKind::tracks2d}, 5, 5)));
    const FitProblem& problem = *model.problems.back();
    const auto seed = static_cast<unsigned>(model.problems.size());
    const int frames = 4;
    const Eigen::Index rows = TrajectoryObjective(problem, frames, 1e-3).residual_count();
    PooledPart& part = model.parts.emplace_back();
    part.values = problem.space.start();
    part.frames = frames;
    part.steps = 1e-3;
    part.linear.residual = random_matrix(rows, 1, 20 + seed);
    part.linear.residual_by_coordinate = random_matrix(rows, problem.space.size(), 30 + seed);
    part.linear.usable = true;
    part.directions = 2 * random_matrix(rows, directions, 40 + seed);
    part.amplitudes = Eigen::VectorXd::Zero(directions);
    // The values are off the prior's mean by less than its sigma, so that it pulls.
    for (const GaussianPrior& prior : problem.priors)
      for (const int p : prior.indices) part.values[p] += 7e-4;
  }
  model.state = FitState::complete;
  return model;
}

/// Returns the same as one matrix: shared parameters first, then each recording's own.
Projection projection_at_once(const FittedModel& model, bool with_directions) {
  const std::vector<const FitProblem*> problems = model.problem_pointers();
  const PooledSpace space(problems);
  const Eigen::Index rows = model.residual_count(), shared = space.shared();
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(rows, space.size());
  Eigen::MatrixXd priors = Eigen::MatrixXd::Zero(space.size(), space.size());
  Eigen::VectorXd pull = Eigen::VectorXd::Zero(space.size()), residual(rows);
  const Eigen::Index each = with_directions ? model.parts.front().directions.cols() : 0;
  Eigen::MatrixXd errs =
      Eigen::MatrixXd::Zero(rows, each * static_cast<Eigen::Index>(problems.size()));
  Eigen::Index row = 0;
  for (size_t n = 0; n < problems.size(); ++n) {
    const PooledPart& part = model.parts[n];
    const Eigen::Index count = part.linear.residual.size();
    std::vector<int> places(static_cast<size_t>(problems[n]->space.size()));
    const std::vector<int> common = space.shared_of(n), own = space.own_of(n);
    for (size_t k = 0; k < common.size(); ++k)
      places[static_cast<size_t>(common[k])] = static_cast<int>(k);
    for (size_t k = 0; k < own.size(); ++k)
      places[static_cast<size_t>(own[k])] = space.first_own(n) + static_cast<int>(k);
    const PriorCost prior = prior_cost(*problems[n], part.values);
    for (size_t p = 0; p < places.size(); ++p) {
      const auto from = static_cast<Eigen::Index>(p);
      jacobian.col(places[p]).segment(row, count) = part.linear.residual_by_coordinate.col(from);
      pull[places[p]] += prior.gradient[from];
      for (size_t q = 0; q < places.size(); ++q)
        priors(places[p], places[q]) += prior.information(from, static_cast<Eigen::Index>(q));
    }
    if (each > 0)
      errs.block(row, each * static_cast<Eigen::Index>(n), count, each) = part.directions;
    residual.segment(row, count) = part.linear.residual;
    row += count;
  }
  EXPECT_GT(priors.norm(), 0);
  EXPECT_EQ(priors.topLeftCorner(shared, shared).norm(), 0);
  return {jacobian, priors, pull, errs, Eigen::VectorXd::Ones(rows), residual};
}

// Each recording's own parameters are eliminated before those that they share. Products of
// projected vectors are the same.
TEST(ModelProjection, IsThatOfAllRecordingsAtOnce) {
  const FittedModel model = model_of_noise(2);
  const Eigen::MatrixXd effect = random_matrix(model.residual_count(), 3, 50);
  const Eigen::Index first = model.parts.front().linear.residual.size();
  const std::vector<Eigen::MatrixXd> columns{effect.topRows(first),
                                             effect.bottomRows(effect.rows() - first)};
  for (const bool with_directions : {true, false}) {
    SCOPED_TRACE(with_directions ? "with directions" : "without");
    const Projection whole = projection_at_once(model, with_directions);
    const ModelProjection parts(model, Loss::squared, with_directions);

    const Eigen::MatrixXd left = parts.columns(columns), expected = whole.columns(effect);
    const Eigen::MatrixXd information = expected.transpose() * expected;
    EXPECT_LT((left.transpose() * left - information).norm(), 1e-8 * information.norm());
    EXPECT_LT(
        (left.transpose() * parts.residual() - expected.transpose() * whole.residual()).norm(),
        1e-8 * information.norm());
    EXPECT_NEAR(parts.residual().squaredNorm(), whole.residual().squaredNorm(),
                1e-8 * whole.residual().squaredNorm());
    EXPECT_EQ(parts.weights(), whole.weights());
    // Each recording's residuals keep their places.
    EXPECT_EQ(parts.first_row(0), 0);
    EXPECT_GE(parts.first_row(1), first);
    EXPECT_LT((parts.residual().head(first) - whole.residual().head(first)).norm(),
              1e-8 * whole.residual().norm());
  }
}

// Without priors and directions each parameter takes one number.
TEST(ModelProjection, TakesANumberForEachParameter) {
  FittedModel model = model_of_noise(0);
  FitProblem without_priors = *model.problems.front();
  without_priors.priors.clear();
  model.problems.front() = std::make_shared<const FitProblem>(std::move(without_priors));
  model.problems.back() = model.problems.front();
  model.parts.back().values = model.parts.front().values;
  model.parts.back().linear.residual_by_coordinate.conservativeResize(
      Eigen::NoChange, model.problems.front()->space.size());

  const std::vector<const FitProblem*> problems = model.problem_pointers();
  EXPECT_NEAR(ModelProjection(model, Loss::squared).taken(), PooledSpace(problems).size(), 1e-8);
}

TEST(Explain, FindsTheAmplitudesAndTheDecrease) {
  const Eigen::MatrixXd columns = random_matrix(50, 3, 11);
  const Eigen::Vector3d amplitudes(0.5, -2, 1);
  const Eigen::VectorXd residual = -columns * amplitudes;
  const Explained explained = explain(residual, columns, ends(3, -kInfinite), ends(3, kInfinite));

  EXPECT_LT((explained.amplitude - amplitudes).norm(), 1e-4);
  EXPECT_NEAR(explained.decrease, residual.squaredNorm(), 1e-8 * residual.squaredNorm());
}

// Drag cannot be negative. A residual that asks for that is explained by nothing, and others do not
// lean on it.
TEST(Explain, KeepsAmplitudesWithinTheirEnds) {
  const Eigen::MatrixXd columns = random_matrix(50, 2, 12);
  const Eigen::VectorXd residual = -columns * Eigen::Vector2d(-1, 3);
  const Explained explained = explain(residual, columns, ends(2, 0), ends(2, kInfinite));

  const double alone = -columns.col(1).dot(residual) / columns.col(1).squaredNorm();
  EXPECT_EQ(explained.amplitude[0], 0);
  EXPECT_NEAR(explained.amplitude[1], alone, 1e-9);
  EXPECT_NEAR(explained.decrease, alone * alone * columns.col(1).squaredNorm(), 1e-6);
}

}  // namespace
}  // namespace clothfit
