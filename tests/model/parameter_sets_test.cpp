// Checks the parameter sets louchet5, louchet18 and fabric: conversion to springs and back,
// derivatives of both ways, refusals. Not checked here: a fabric as a continuum, by its energy
// (fabric_test.cpp), and longer flexion springs (preconstraint_test.cpp).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "data/input_error.h"
#include "model/fabric/fabric_conversion.h"
#include "model/fabric/louchet18.h"
#include "model/fabric/louchet5.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

const Mesh kSevenByNine{.columns = 7, .rows = 9, .width_m = 0.3, .height_m = 0.5};

Louchet5 random_louchet5(Uniform& uniform) {
  return {.natural_length_01_m = uniform(0.01, 0.05),
          .natural_length_23_m = uniform(0.01, 0.08),
          .natural_length_45_m = uniform(0.02, 0.1),
          .stiffness_n_per_m = uniform(1, 100),
          .critical_elongation = uniform(0, 0.3)};
}

SpringParameters random_springs(Uniform& uniform) {
  SpringVector numbers;
  for (int n = 0; n < kSpringNumbers; ++n)
    numbers[n] = n < stiffness_block ? uniform(0.01, 0.1)
                 : n < damping_block ? uniform(1, 100)
                                     : uniform(0.01, 0.3);
  return springs_of(numbers);
}

/// Returns central differences of `f` at `x`.
template <class Function>
Eigen::MatrixXd differences(const Function& f, const Eigen::VectorXd& x) {
  Eigen::MatrixXd result;
  for (Eigen::Index n = 0; n < x.size(); ++n) {
    const double step = 1e-6 * std::max(1.0, std::abs(x[n]));
    Eigen::VectorXd up = x, down = x;
    up[n] += step;
    down[n] -= step;
    const Eigen::VectorXd slope = (f(up) - f(down)) / (2 * step);
    if (n == 0) result.resize(slope.size(), x.size());
    result.col(n) = slope;
  }
  return result;
}

/// Returns the largest error, relative to the largest entry. Differences have 1e-9 of rounding and
/// truncation.
double error(const Eigen::MatrixXd& derivative, const Eigen::MatrixXd& difference) {
  return (derivative - difference).cwiseAbs().maxCoeff() / difference.cwiseAbs().maxCoeff();
}

TEST(SpringVector, HoldsEveryNumberOnce) {
  Uniform uniform(1);
  const SpringParameters springs = random_springs(uniform);
  const SpringVector numbers = to_vector(springs);

  EXPECT_EQ(numbers[natural_length_block + 2], springs.natural_length_m[2]);
  EXPECT_EQ(numbers[stiffness_block + 5], springs.stiffness_n_per_m[5]);
  EXPECT_EQ(numbers[damping_block + 1], springs.damping_ns_per_m[1]);
  EXPECT_EQ(numbers[elongation_block + 0], springs.critical_elongation[0]);
  EXPECT_EQ(to_vector(springs_of(numbers)), numbers);
}

TEST(Louchet5, GivesItsNumbersToThePairsOfTypes) {
  const SpringParameters springs = spring_parameters(Louchet5{.natural_length_01_m = 0.02,
                                                              .natural_length_23_m = 0.03,
                                                              .natural_length_45_m = 0.05,
                                                              .stiffness_n_per_m = 40,
                                                              .critical_elongation = 0.1});

  EXPECT_EQ(springs.natural_length_m, (std::array{0.02, 0.02, 0.03, 0.03, 0.05, 0.05}));
  EXPECT_EQ(springs.stiffness_n_per_m, (std::array<double, 6>{40, 40, 40, 40, 40, 40}));
  EXPECT_EQ(springs.damping_ns_per_m, (std::array<double, 6>{}));
  EXPECT_EQ(springs.critical_elongation, (std::array{0.1, 0.1, 0.1, 0.1, 0.1, 0.1}));
}

TEST(Louchet5, ComesBackFromItsSprings) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    const Louchet5 set = random_louchet5(uniform);

    const Nearest<Louchet5> nearest = nearest_louchet5(spring_parameters(set));

    ASSERT_TRUE(nearest.usable());
    // A mean of six equal numbers is rounded.
    EXPECT_LT((to_vector(nearest.set) - to_vector(set)).cwiseAbs().maxCoeff(), 1e-13);
    EXPECT_LT(nearest.stiffness_n_per_m, 1e-13);
    EXPECT_EQ(nearest.damping_ns_per_m, 0);
  }
  Louchet5 unlimited{.natural_length_01_m = 1,
                     .natural_length_23_m = 1,
                     .natural_length_45_m = 1,
                     .stiffness_n_per_m = 1};
  const Nearest<Louchet5> nearest = nearest_louchet5(spring_parameters(unlimited));
  EXPECT_TRUE(nearest.usable());
  EXPECT_LT((to_vector(nearest.set) - to_vector(unlimited)).head<4>().norm(), 1e-15);
  EXPECT_EQ(nearest.set.critical_elongation, SpringParameters::kInfinite);
  EXPECT_EQ(nearest.critical_elongation, 0);
}

TEST(Louchet5, IsTheNearestThereIs) {
  Uniform uniform(5);
  const SpringParameters springs = random_springs(uniform);
  const Nearest<Louchet5> nearest = nearest_louchet5(springs);
  ASSERT_TRUE(nearest.usable());
  const auto sum_of_squares = [&](const Louchet5::Vector& set) {
    return (to_vector(spring_parameters(louchet5_of(set))) - to_vector(springs)).squaredNorm();
  };
  const double least = sum_of_squares(to_vector(nearest.set));

  for (int n = 0; n < Louchet5::kCount; ++n) {
    for (const double side : {-1e-3, 1e-3}) {
      Louchet5::Vector other = to_vector(nearest.set);
      other[n] += side;
      EXPECT_GT(sum_of_squares(other), least) << n;
    }
  }
  // The rest is reported, kind by kind.
  EXPECT_NEAR(
      6 * (std::pow(nearest.natural_length_m, 2) + std::pow(nearest.stiffness_n_per_m, 2) +
           std::pow(nearest.damping_ns_per_m, 2) + std::pow(nearest.critical_elongation, 2)),
      least, 1e-9 * least);
  EXPECT_GT(nearest.damping_ns_per_m, 0.01);
}

TEST(Louchet5, HasNoCommonLimitWhereSomeTypesHaveNone) {
  Uniform uniform(2);
  SpringParameters springs = random_springs(uniform);
  springs.critical_elongation[3] = SpringParameters::kInfinite;

  const Nearest<Louchet5> nearest = nearest_louchet5(springs);

  EXPECT_FALSE(nearest.usable());
  EXPECT_THAT(nearest.reason, testing::HasSubstr("critical elongation"));
}

TEST(Louchet5, HasTheDerivativesOfBothWays) {
  Uniform uniform(3);
  const auto springs_at = [](const Eigen::VectorXd& set) -> Eigen::VectorXd {
    return to_vector(spring_parameters(louchet5_of(set)));
  };
  const auto set_at = [](const Eigen::VectorXd& numbers) -> Eigen::VectorXd {
    return to_vector(nearest_louchet5(springs_of(numbers)).set);
  };

  EXPECT_LT(
      error(springs_by_louchet5(), differences(springs_at, to_vector(random_louchet5(uniform)))),
      1e-9);
  EXPECT_LT(error(louchet5_by_springs(), differences(set_at, to_vector(random_springs(uniform)))),
            1e-9);
  // The way there and back leads to the same set.
  EXPECT_LT(
      (louchet5_by_springs() * springs_by_louchet5() - Eigen::Matrix<double, 5, 5>::Identity())
          .norm(),
      1e-15);
}

TEST(Louchet18, HoldsEverySpringButItsDashpot) {
  Uniform uniform(4);
  SpringParameters springs = random_springs(uniform);

  const Nearest<Louchet18> nearest = nearest_louchet18(springs);

  EXPECT_TRUE(nearest.usable());
  const double damping = nearest.damping_ns_per_m;
  EXPECT_DOUBLE_EQ(damping,
                   std::sqrt(to_vector(springs).segment<6>(damping_block).squaredNorm() / 6));
  springs.damping_ns_per_m.fill(0);
  EXPECT_EQ(to_vector(spring_parameters(nearest.set)), to_vector(springs));
  EXPECT_EQ(to_vector(louchet18_of(to_vector(nearest.set))), to_vector(nearest.set));
}

TEST(Louchet18, HasTheDerivativesOfBothWays) {
  Uniform uniform(6);
  const SpringParameters springs = random_springs(uniform);
  const auto springs_at = [](const Eigen::VectorXd& set) -> Eigen::VectorXd {
    return to_vector(spring_parameters(louchet18_of(set)));
  };
  const auto set_at = [](const Eigen::VectorXd& numbers) -> Eigen::VectorXd {
    return to_vector(nearest_louchet18(springs_of(numbers)).set);
  };

  EXPECT_LT(error(springs_by_louchet18(),
                  differences(springs_at, to_vector(nearest_louchet18(springs).set))),
            1e-9);
  EXPECT_LT(error(louchet18_by_springs(), differences(set_at, to_vector(springs))), 1e-9);
}

TEST(Louchet18, OfALouchet5IsThatSet) {
  Uniform uniform(7);
  const Louchet5 set = random_louchet5(uniform);

  const Louchet18 wide = nearest_louchet18(spring_parameters(set)).set;

  EXPECT_LT((to_vector(nearest_louchet5(spring_parameters(wide)).set) - to_vector(set)).norm(),
            1e-13);
}

TEST(FabricConversion, ComesBackFromItsSprings) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    const Fabric fabric = random_fabric(uniform);

    const Nearest<Fabric> nearest =
        nearest_fabric(spring_parameters(fabric, kSevenByNine), kSevenByNine);

    ASSERT_TRUE(nearest.usable()) << nearest.reason;
    EXPECT_LT((to_vector(nearest.set) - to_vector(fabric)).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT(nearest.stiffness_n_per_m + nearest.damping_ns_per_m, 1e-13);
    EXPECT_EQ(nearest.natural_length_m + nearest.critical_elongation, 0);
    EXPECT_EQ(to_vector(fabric_of(to_vector(fabric))), to_vector(fabric));
  }
}

TEST(FabricConversion, IsTheNearestThereIs) {
  Uniform uniform(8);
  SpringParameters springs = random_springs(uniform);
  springs.critical_elongation = SpringParameters::kNoLimit;
  const Nearest<Fabric> nearest = nearest_fabric(springs, kSevenByNine);
  ASSERT_TRUE(nearest.usable());
  // Squares are least in stiffnesses first, then in dampings.
  const auto squares = [&](const FabricVector& numbers, SpringBlock block) {
    return (to_vector(spring_parameters(fabric_of(numbers), kSevenByNine)) - to_vector(springs))
        .segment<6>(block)
        .squaredNorm();
  };
  const FabricVector best = to_vector(nearest.set);

  for (int n = 0; n < kFabricNumbers; ++n) {
    const SpringBlock block = n < 5 ? stiffness_block : damping_block;
    for (const double side : {-1e-4, 1e-4}) {
      FabricVector other = best;
      other[n] += side;
      EXPECT_GT(squares(other, block), squares(best, block)) << n;
    }
  }
  EXPECT_NEAR(6 * std::pow(nearest.damping_ns_per_m, 2), squares(best, damping_block), 1e-12);
}

TEST(FabricConversion, SaysWhatItCannot) {
  Uniform uniform(9);
  SpringParameters springs = spring_parameters(random_fabric(uniform), kSevenByNine);
  springs.natural_length_m[flexion_t] *= 1.1;
  EXPECT_NEAR(nearest_fabric(springs, kSevenByNine).natural_length_m,
              0.1 * flat_lengths(kSevenByNine)[flexion_t] / std::sqrt(6), 1e-15);

  springs.stiffness_n_per_m.fill(0);
  springs.damping_ns_per_m.fill(0.1);
  EXPECT_THAT(nearest_fabric(springs, kSevenByNine).reason, testing::HasSubstr("no stiffness"));

  springs.stiffness_n_per_m.fill(10);
  springs.damping_ns_per_m = {0, 0.1, 0, 0, 0, 0.1};
  springs.damping_ns_per_m[shear_down] = springs.damping_ns_per_m[shear_up] = -0.05;
  EXPECT_THAT(nearest_fabric(springs, kSevenByNine).reason, testing::HasSubstr("below 0"));
}

TEST(FabricConversion, HasTheDerivativesOfBothWays) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    Uniform uniform(seed);
    const Fabric fabric = random_fabric(uniform);
    const SpringParameters springs = random_springs(uniform);
    const auto springs_at = [](const Eigen::VectorXd& numbers) -> Eigen::VectorXd {
      const SpringParameters at = spring_parameters(fabric_of(numbers), kSevenByNine);
      return to_vector(at).head<elongation_block>();
    };
    const auto fabric_at = [](const Eigen::VectorXd& numbers) -> Eigen::VectorXd {
      return to_vector(nearest_fabric(springs_of(numbers), kSevenByNine).set);
    };

    EXPECT_LT(error(springs_by_fabric(fabric).topRows<elongation_block>(),
                    differences(springs_at, to_vector(fabric))),
              1e-8);
    EXPECT_EQ(springs_by_fabric(fabric).bottomRows<6>().norm(), 0);
    const Eigen::MatrixXd derivative = fabric_by_springs(springs);
    const Eigen::MatrixXd difference = differences(fabric_at, to_vector(springs));
    EXPECT_LT(error(derivative.topRows<5>(), difference.topRows<5>()), 1e-8);
    EXPECT_LT(error(derivative.bottomRows<2>(), difference.bottomRows<2>()), 1e-6);
    // The way there and back leads to the same fabric.
    const SpringParameters own = spring_parameters(fabric, kSevenByNine);
    EXPECT_LT((fabric_by_springs(own) * springs_by_fabric(fabric) -
               Eigen::Matrix<double, 7, 7>::Identity())
                  .norm(),
              1e-9);
  }
}

TEST(FabricConversion, CatchesAWrongDerivative) {
  Uniform uniform(1);
  const SpringParameters springs = random_springs(uniform);
  Eigen::MatrixXd wrong = fabric_by_springs(springs);
  wrong(5, stiffness_block) *= 1.001;
  const auto fabric_at = [](const Eigen::VectorXd& numbers) -> Eigen::VectorXd {
    return to_vector(nearest_fabric(springs_of(numbers), kSevenByNine).set);
  };

  const Eigen::MatrixXd difference = differences(fabric_at, to_vector(springs));
  EXPECT_GT(std::abs(wrong(5, stiffness_block) / difference(5, stiffness_block) - 1), 5e-4);
}

TEST(Springs, ThatCannotBeAreRefused) {
  Uniform uniform(1);
  const SpringParameters good = random_springs(uniform);
  EXPECT_NO_THROW(require_possible(good, "test"));
  EXPECT_NO_THROW(require_possible(spring_parameters(cotton(), kSevenByNine), "test"));
  const auto refusal = [&](int number, double value) {
    SpringVector numbers = to_vector(good);
    numbers[number] = value;
    try {
      require_possible(springs_of(numbers), "test");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };

  EXPECT_THAT(refusal(natural_length_block + 1, 0),
              testing::StartsWith("test: natural length of type 1 = 0.0"));
  EXPECT_THAT(refusal(natural_length_block, INFINITY), testing::HasSubstr("natural length"));
  EXPECT_THAT(refusal(stiffness_block + 2, -1), testing::HasSubstr("stiffness of type 2 = -1"));
  EXPECT_THAT(refusal(stiffness_block + 2, NAN), testing::HasSubstr("stiffness of type 2"));
  EXPECT_THAT(refusal(damping_block + 3, -1), testing::HasSubstr("damping of type 3"));
  EXPECT_THAT(refusal(elongation_block + 4, -0.1), testing::HasSubstr("critical elongation"));
  EXPECT_EQ(refusal(elongation_block + 4, INFINITY), "accepted");
  EXPECT_EQ(refusal(stiffness_block + 2, 0), "accepted");

  SpringParameters limp = good;
  limp.stiffness_n_per_m.fill(0);
  EXPECT_THROW(require_possible(limp, "test"), InputError);
}

}  // namespace
}  // namespace clothfit
