// Checks the numbers that a fit changes and the knowledge of them beforehand. The model's use of
// them is checked in problem_test.cpp.
#include "fit/problem/parameter_space.h"

#include <gtest/gtest.h>

namespace clothfit {
namespace {

ParameterSpace two_scales() {
  return {.parameters = {{.name = "stiffness",
                          .unit = "N/m",
                          .scale = ParameterScale::logarithmic,
                          .lower = 1,
                          .upper = 100,
                          .start = 10},
                         {.name = "tilt",
                          .unit = "rad",
                          .scale = ParameterScale::linear,
                          .lower = -1,
                          .upper = 1,
                          .start = 0,
                          .typical = 1e-3}}};
}

TEST(ParameterSpace, ValuesComeBackFromTheirCoordinates) {
  const ParameterSpace space = two_scales();
  const Eigen::Vector2d values(37.5, -2e-4);

  const Eigen::VectorXd back = space.values(space.coordinates(values));

  EXPECT_NEAR(back[0], 37.5, 1e-13 * 37.5);
  EXPECT_NEAR(back[1], -2e-4, 1e-18);
}

TEST(ParameterSpace, SlopeOfValuesAgreesWithDifferences) {
  const ParameterSpace space = two_scales();
  const Eigen::Vector2d values(37.5, -2e-4);
  const Eigen::VectorXd coordinates = space.coordinates(values);

  const Eigen::VectorXd slope = space.value_by_coordinate(values);

  constexpr double kStep = 1e-5;  // truncation 1e-11 relative, rounding 1e-11
  for (int p = 0; p < space.size(); ++p) {
    Eigen::VectorXd plus = coordinates, minus = coordinates;
    plus[p] += kStep;
    minus[p] -= kStep;
    const double difference = (space.values(plus)[p] - space.values(minus)[p]) / (2 * kStep);
    EXPECT_NEAR(slope[p], difference, 1e-9 * std::abs(difference));
  }
}

TEST(ParameterSpace, FindsParametersByName) {
  const ParameterSpace space = two_scales();

  EXPECT_EQ(space.index("tilt"), 1);
  EXPECT_EQ(space.index("torsion"), -1);
}

TEST(GaussianPrior, ResidualIsStandardNormalForDrawsFromThePrior) {
  // Given a correlated covariance and its square-root information
  Eigen::Matrix2d covariance;
  covariance << 4e-6, 1e-6, 1e-6, 1e-6;
  const GaussianPrior prior{.indices = {2, 0},
                            .mean = Eigen::Vector2d(1e-3, 2e-3),
                            .sqrt_information = covariance.inverse().llt().matrixU()};

  // When values one covariance ellipse away are asked for
  const Eigen::Matrix2d root = covariance.llt().matrixL();
  Eigen::Vector3d values = Eigen::Vector3d::Constant(7);
  const Eigen::Vector2d drawn = prior.mean + root * Eigen::Vector2d(0.6, -0.8);
  values[2] = drawn[0];
  values[0] = drawn[1];

  // Then the residual has the length of the draw: Mahalanobis distance 1
  EXPECT_NEAR(prior.residual(values).norm(), 1.0, 1e-12);
}

}  // namespace
}  // namespace clothfit
