// Checks profile likelihood on costs given by formulas. Not checked here: profiles over a cloth's
// fits.

#include "fit/uncertainty/profile_likelihood.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>
#include <cmath>

#include "fit/jobs/draws.h"

namespace clothfit {
namespace {

constexpr double kFactor90 = 1.6448536269514722;  // of the normal distribution, two-sided

ProfilePoint point(double value, double cost) {
  return {.usable = true, .value = value, .cost = cost};
}

TEST(ProfileLikelihood, OfALinearModelIsTheNormalInterval) {
  // Given a cost x' H x / 2 of three correlated parameters, the first of them held
  Eigen::Matrix3d h;
  h << 4, 1, -0.5, 1, 3, 0.8, -0.5, 0.8, 2;
  const double sigma = std::sqrt(h.inverse()(0, 0));
  const ProfiledCost cost = [&](double value, const Eigen::VectorXd& start) {
    EXPECT_EQ(start.size(), 2);
    Eigen::Vector3d x;
    x[0] = value - 1.5;
    x.tail<2>() = -h.bottomRightCorner<2, 2>().llt().solve(h.bottomLeftCorner<2, 1>() * x[0]);
    return ProfilePoint{
        .usable = true, .value = value, .cost = 7 + 0.5 * x.dot(h * x), .others = x.tail<2>()};
  };
  ProfilePoint best = point(1.5, 7);
  best.others = Eigen::Vector2d::Zero();

  const ProfileInterval found =
      profile_interval(best, cost, {.lower = -10, .upper = 10, .sigma = sigma});

  EXPECT_EQ(found.lower_end, ProfileEnd::found);
  EXPECT_EQ(found.upper_end, ProfileEnd::found);
  EXPECT_NEAR(found.lower, 1.5 - kFactor90 * sigma, 1e-9);
  EXPECT_NEAR(found.upper, 1.5 + kFactor90 * sigma, 1e-9);
  EXPECT_NEAR(found.upper_excess, 0, 1e-9);
  EXPECT_FALSE(found.preferable());
  EXPECT_EQ(found.points.size(), 3u);  // the optimum and one at each end: the first guess is exact
}

TEST(ProfileLikelihood, WidensWithTheResidualsVariance) {
  const ProfiledCost cost = [](double value, const Eigen::VectorXd&) {
    return point(value, 0.5 * value * value);
  };

  const ProfileInterval found = profile_interval(
      point(0, 0), cost, {.lower = -10, .upper = 10, .sigma = 1, .residual_variance = 4});

  EXPECT_NEAR(found.upper, 2 * kFactor90, 1e-9);
  EXPECT_FALSE(found.preferable());
}

TEST(ProfileLikelihood, FindsTheEndsOfASkewedCostFromAPoorSigma) {
  // The cost is cosh-like to the right and flat to the left, with ends known in closed form.
  const auto height = [](double x) { return std::exp(x) - 1 - x; };
  const ProfiledCost cost = [&](double value, const Eigen::VectorXd&) {
    return point(value, height(value));
  };
  const double rise = 0.5 * kFactor90 * kFactor90;
  for (const double sigma : {0.03, 1.0, 30.0}) {
    const ProfileInterval found =
        profile_interval(point(0, 0), cost, {.lower = -60, .upper = 60, .sigma = sigma});

    ASSERT_EQ(found.lower_end, ProfileEnd::found);
    ASSERT_EQ(found.upper_end, ProfileEnd::found);
    // The tolerance of an end is a thousandth of its distance.
    EXPECT_NEAR(height(found.lower), rise, 3e-3 * rise);
    EXPECT_NEAR(height(found.upper), rise, 3e-3 * rise);
    EXPECT_LT(found.upper, -found.lower);
    EXPECT_TRUE(found.preferable());
    EXPECT_LT(found.points.size(), 30u);
  }
}

TEST(ProfileLikelihood, SaysWhereItIsOpen) {
  // The cost saturates at 1 to the right, below the rise of 1.35 that 90 % needs.
  const ProfiledCost cost = [](double value, const Eigen::VectorXd&) {
    return point(value, value < 0 ? 0.5 * value * value : 1 - std::exp(-0.5 * value * value));
  };

  const ProfileInterval found =
      profile_interval(point(0, 0), cost, {.lower = -10, .upper = 8, .sigma = 1});

  EXPECT_EQ(found.lower_end, ProfileEnd::found);
  EXPECT_EQ(found.upper_end, ProfileEnd::open);
  EXPECT_EQ(found.upper, 8);
  EXPECT_TRUE(found.preferable());
}

TEST(ProfileLikelihood, SaysWhereThereIsNoCost) {
  const ProfiledCost cost = [](double value, const Eigen::VectorXd&) {
    ProfilePoint at = point(value, 0.5 * value * value);
    at.usable = value < 1;
    return at;
  };

  const ProfileInterval found =
      profile_interval(point(0, 0), cost, {.lower = -10, .upper = 10, .sigma = 1});

  EXPECT_EQ(found.upper_end, ProfileEnd::no_cost);
  EXPECT_NEAR(found.upper, 1, 2e-3);
  EXPECT_LT(found.upper, 1);
  EXPECT_EQ(found.lower_end, ProfileEnd::found);
}

TEST(ProfileLikelihood, NoticesThatTheOptimumWasNone) {
  const ProfiledCost cost = [](double value, const Eigen::VectorXd&) {
    return point(value, 0.5 * (value - 1) * (value - 1));
  };

  const ProfileInterval found =
      profile_interval(point(0, 0.5), cost, {.lower = -10, .upper = 10, .sigma = 1});

  EXPECT_TRUE(found.optimum_was_none);
}

/// Observations exp(-rate t) + noise at four times. The model is far from linear over the width of
/// its interval.
struct Decay {
  std::array<double, 4> times{0.5, 1, 2, 4};
  double rate = 1.2, noise = 0.4;

  double cost(const Eigen::Vector4d& observed, double at) const {
    double sum = 0;
    for (int i = 0; i < 4; ++i) {
      const double r = (std::exp(-at * times[static_cast<size_t>(i)]) - observed[i]) / noise;
      sum += 0.5 * r * r;
    }
    return sum;
  }
  double sigma(double at) const {
    double information = 0;
    for (const double t : times) information += std::pow(t * std::exp(-at * t) / noise, 2);
    return 1 / std::sqrt(information);
  }
};

TEST(ProfileLikelihood, CoversWhereTheSymmetricIntervalDoesNot) {
  SCOPED_TRACE("seed 51");
  const Decay decay;
  constexpr int kReplicates = 1000;
  int by_profile = 0, by_sigma = 0, longer_upwards = 0;
  for (int replicate = 0; replicate < kReplicates; ++replicate) {
    Draws draws(51, replicate, 0);
    Eigen::Vector4d observed;
    for (int i = 0; i < 4; ++i)
      observed[i] = std::exp(-decay.rate * decay.times[static_cast<size_t>(i)]) +
                    decay.noise * draws.normal();
    // A fine grid and a golden section find the optimum over rates 0 ... 40.
    double best = 0;
    for (double rate = 0; rate <= 40; rate += rate < 5 ? 0.02 : 0.5)
      if (decay.cost(observed, rate) < decay.cost(observed, best)) best = rate;
    double lower = std::max(0.0, best - 0.5), upper = std::min(40.0, best + 0.5);
    for (int i = 0; i < 60; ++i) {
      const double a = lower + 0.382 * (upper - lower), b = lower + 0.618 * (upper - lower);
      (decay.cost(observed, a) < decay.cost(observed, b) ? upper : lower) =
          decay.cost(observed, a) < decay.cost(observed, b) ? b : a;
    }
    best = 0.5 * (lower + upper);

    const double sigma = decay.sigma(best);
    const ProfileInterval found =
        profile_interval(point(best, decay.cost(observed, best)),
                         [&](double value, const Eigen::VectorXd&) {
                           return point(value, decay.cost(observed, value));
                         },
                         {.lower = 0, .upper = 40, .sigma = std::min(sigma, 10.0)});
    by_profile += found.lower <= decay.rate && decay.rate <= found.upper;
    by_sigma += std::abs(best - decay.rate) <= kFactor90 * sigma;
    longer_upwards += found.upper - best > best - found.lower;
  }

  // Of 1000 replicates a share of 0.9 scatters by 0.0095.
  EXPECT_NEAR(by_profile / 1000.0, 0.9, 0.03);
  EXPECT_LT(by_sigma / 1000.0, 0.87);
  EXPECT_GT(longer_upwards, 900);
}

}  // namespace
}  // namespace clothfit
