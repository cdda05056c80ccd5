// Checks the engine of the fits on closed forms. Its callers: pooled_fit_test.cpp,
// tests/fit/cost/shooting_test.cpp, tests/fit/uncertainty/parameter_profiles_test.cpp.
#include "fit/refine/least_squares.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "fit/refine/derivative_reuse.h"

namespace clothfit {
namespace {

const Box kWide{.lower = Eigen::Vector2d(-1e3, -1e3), .upper = Eigen::Vector2d(1e3, 1e3)};

/// Half the square of residuals of two coordinates, with exact derivatives.
class Residuals final : public LeastSquares {
 public:
  using Of = std::function<Eigen::VectorXd(const Eigen::Vector2d&)>;
  using Slope = std::function<Eigen::MatrixXd(const Eigen::Vector2d&)>;
  Residuals(Of of, Slope slope, const Eigen::Vector2d& x)
      : of_(std::move(of)), slope_(std::move(slope)) {
    stand_at(x);
  }

  double cost() const override { return 0.5 * residual_.squaredNorm(); }
  const Eigen::VectorXd* gradient() override { return &gradient_; }
  Eigen::VectorXd step(double damping, const std::vector<bool>& held) override {
    Eigen::MatrixXd information = information_;
    Eigen::VectorXd right = -gradient_;
    information.diagonal() *= 1 + damping;
    for (int p = 0; p < 2; ++p) {
      if (!held[static_cast<size_t>(p)]) continue;
      information.row(p).setZero();
      information.col(p).setZero();
      information(p, p) = 1;
      right[p] = 0;
    }
    return information.ldlt().solve(right);
  }
  double predicted_decrease(const Eigen::VectorXd& way) const override {
    return -gradient_.dot(way) - 0.5 * way.dot(information_ * way);
  }
  bool move_to(const Eigen::VectorXd& next) override {
    ++trials;
    if (!(0.5 * of_(next).squaredNorm() < cost())) return false;
    stand_at(next);
    return true;
  }
  double least_decrease() const override { return 1e-14; }

  int trials = 0;

 private:
  void stand_at(const Eigen::Vector2d& x) {
    residual_ = of_(x);
    const Eigen::MatrixXd slope = slope_(x);
    gradient_ = slope.transpose() * residual_;
    information_ = slope.transpose() * slope;
  }

  Of of_;
  Slope slope_;
  Eigen::VectorXd residual_, gradient_;
  Eigen::MatrixXd information_;
};

/// Residuals that are linear, of which the optimum is known.
Residuals line_fit(const Eigen::Vector2d& start) {
  const Eigen::MatrixXd slope = (Eigen::MatrixXd(3, 2) << 1, 0, 1, 1, 1, 3).finished();
  const Eigen::Vector3d seen(1, 3, 7);  // 1 + 2 t
  return {[=](const Eigen::Vector2d& x) { return Eigen::VectorXd(slope * x - seen); },
          [=](const Eigen::Vector2d&) { return slope; }, start};
}

/// Rosenbrock's function, whose optimum is (1, 1).
Residuals rosenbrock(const Eigen::Vector2d& start) {
  return {[](const Eigen::Vector2d& x) {
            return Eigen::VectorXd(Eigen::Vector2d(10 * (x[1] - x[0] * x[0]), 1 - x[0]));
          },
          [](const Eigen::Vector2d& x) {
            return Eigen::MatrixXd((Eigen::Matrix2d() << -20 * x[0], 10, -1, 0).finished());
          },
          start};
}

TEST(Minimise, EndsAtTheOptimumOfALinearProblemInAFewSteps) {
  Residuals problem = line_fit({0, 0});
  const Minimised found = minimise(problem, kWide, Eigen::Vector2d(0, 0), {});
  EXPECT_EQ(found.end, MinimiseEnd::converged);
  EXPECT_LE(found.iterations, 4);
  EXPECT_NEAR(found.x[0], 1, 1e-6);
  EXPECT_NEAR(found.x[1], 2, 1e-6);
}

TEST(Minimise, FollowsACurvedBasin) {
  Residuals problem = rosenbrock({-1.2, 1});
  const Minimised found = minimise(problem, kWide, Eigen::Vector2d(-1.2, 1), {});
  EXPECT_EQ(found.end, MinimiseEnd::converged);
  EXPECT_NEAR(found.x[0], 1, 1e-5);
  EXPECT_NEAR(found.x[1], 1, 1e-5);
}

TEST(Minimise, EndsAtTheLeastWithinItsBox) {
  // The intercept may not exceed 0: the slope is then that of a line through the origin.
  const Box box{.lower = Eigen::Vector2d(-5, -5), .upper = Eigen::Vector2d(0, 5)};
  Residuals problem = line_fit({-1, 0});
  const Minimised found = minimise(problem, box, Eigen::Vector2d(-1, 0), {});
  EXPECT_EQ(found.end, MinimiseEnd::converged);
  EXPECT_EQ(found.x[0], 0);
  EXPECT_NEAR(found.x[1], 24.0 / 10, 1e-6);  // sum t y / sum t^2
}

TEST(Minimise, SaysThatALimitEndedIt) {
  Residuals problem = rosenbrock({-1.2, 1});
  const Minimised found =
      minimise(problem, kWide, Eigen::Vector2d(-1.2, 1), {.most_iterations = 3});
  EXPECT_EQ(found.end, MinimiseEnd::limit);
  EXPECT_EQ(found.iterations, 3);
}

TEST(Minimise, SaysWhereNoStepDescends) {
  // The derivatives have the wrong sign.
  Residuals problem(
      [](const Eigen::Vector2d& x) { return Eigen::VectorXd(x); },
      [](const Eigen::Vector2d&) { return Eigen::MatrixXd(-Eigen::Matrix2d::Identity()); }, {1, 1});
  const Minimised found = minimise(problem, kWide, Eigen::Vector2d(1, 1), {.most_damping = 1e3});
  EXPECT_EQ(found.end, MinimiseEnd::no_descent);
  EXPECT_EQ(found.iterations, 0);
  EXPECT_EQ(found.refusals, problem.trials);
  EXPECT_EQ(found.x, Eigen::VectorXd(Eigen::Vector2d(1, 1)));
}

TEST(ReuseDerivatives, KeepsThoseThatPredictAndUpdatesThoseThatMissALittle) {
  const Eigen::Vector2d way(0.5, -0.25);
  Eigen::MatrixXd exact = Eigen::MatrixXd::Random(6, 2);
  const ReuseLimits limits{.kept_within = 0.01, .updated_within = 0.2};

  Eigen::MatrixXd jacobian = exact;
  EXPECT_EQ(reuse_derivatives(jacobian, way, exact * way, limits), DerivativeReuse::kept);
  EXPECT_EQ(jacobian, exact);

  const Eigen::VectorXd seen = 1.1 * (exact * way);
  EXPECT_EQ(reuse_derivatives(jacobian, way, seen, limits), DerivativeReuse::updated);
  // The update predicts what was seen, and says nothing new across the way.
  EXPECT_TRUE((jacobian * way).isApprox(seen, 1e-12));

  jacobian = exact;
  EXPECT_EQ(reuse_derivatives(jacobian, way, 2 * (exact * way), limits), DerivativeReuse::spent);
  EXPECT_EQ(jacobian, exact);
}

TEST(Box, BlocksWhatWouldLeaveIt) {
  const Box box{.lower = Eigen::Vector2d(0, 0), .upper = Eigen::Vector2d(1, 1)};
  // A positive gradient asks for a smaller coordinate.
  EXPECT_EQ(box.blocked(Eigen::Vector2d(0, 0), Eigen::Vector2d(1, -1)),
            (std::vector<bool>{true, false}));
  EXPECT_EQ(box.blocked(Eigen::Vector2d(1, 1), Eigen::Vector2d(1, -1)),
            (std::vector<bool>{false, true}));
  EXPECT_EQ(box.clamped(Eigen::Vector2d(-1, 0.5)), Eigen::VectorXd(Eigen::Vector2d(0, 0.5)));
}

}  // namespace
}  // namespace clothfit
