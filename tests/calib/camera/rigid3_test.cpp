// Checks algebra and estimation of rigid transforms. Does not check poses found from pixels: see
// world_placement_test.cpp.

#include "calib/camera/rigid3.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace clothfit {
namespace {

Rigid3 random_rigid(std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  return turn_and_shift({normal(rng), normal(rng), normal(rng)},
                        {normal(rng), normal(rng), normal(rng)});
}

Eigen::Matrix3Xd random_points(int count, std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  Eigen::Matrix3Xd points(3, count);
  for (Eigen::Index i = 0; i < points.size(); ++i) points(i) = normal(rng);
  return points;
}

Eigen::Matrix3Xd transformed(const Rigid3& b_from_a, const Eigen::Matrix3Xd& a) {
  Eigen::Matrix3Xd b(3, a.cols());
  for (Eigen::Index i = 0; i < a.cols(); ++i) b.col(i) = b_from_a * Eigen::Vector3d(a.col(i));
  return b;
}

TEST(Rigid3, CompositionIsOneTransformAfterTheOther) {
  std::mt19937_64 rng(1);
  SCOPED_TRACE("seed 1");
  const Rigid3 c_from_b = random_rigid(rng);
  const Rigid3 b_from_a = random_rigid(rng);
  const Eigen::Vector3d in_a(0.3, -0.7, 1.1);

  const Eigen::Vector3d in_c = (c_from_b * b_from_a) * in_a;

  EXPECT_LT((in_c - c_from_b * (b_from_a * in_a)).norm(), 1e-14);
}

TEST(Rigid3, InverseLeadsBack) {
  std::mt19937_64 rng(2);
  SCOPED_TRACE("seed 2");
  const Rigid3 b_from_a = random_rigid(rng);

  const Rigid3 nothing = inverse(b_from_a) * b_from_a;

  EXPECT_LT(nothing.translation_m.norm(), 1e-14);
  EXPECT_LT(rotation_vector(nothing.rotation).norm(), 1e-14);
}

TEST(Rigid3, AQuarterTurnAboutZTakesXToY) {
  const Rigid3 turn = turn_and_shift({0, 0, std::numbers::pi / 2}, {0, 0, 3});

  const Eigen::Vector3d moved = turn * Eigen::Vector3d(1, 0, 0);

  EXPECT_LT((moved - Eigen::Vector3d(0, 1, 3)).norm(), 1e-15);
}

TEST(Rigid3, RotationVectorInvertsTurning) {
  // Angles go from far below rounding to just below a half turn, either sign of the quaternion.
  for (const double angle : {0.0, 1e-12, 1e-9, 1e-5, 1e-3, 0.5, 3.1}) {
    SCOPED_TRACE(angle);
    const Eigen::Vector3d w = angle * Eigen::Vector3d(1, -2, 2) / 3;
    Eigen::Quaterniond rotation = turn_and_shift(w, Eigen::Vector3d::Zero()).rotation;

    EXPECT_NEAR(rotation.norm(), 1, 1e-15);
    EXPECT_LT((rotation_vector(rotation) - w).norm(), 1e-14);
    rotation.coeffs() *= -1;
    EXPECT_LT((rotation_vector(rotation) - w).norm(), 1e-14);
  }
}

TEST(FitRigid, RecoversATransformExactlyWithoutNoise) {
  std::mt19937_64 rng(3);
  for (int trial = 0; trial < 50; ++trial) {
    SCOPED_TRACE("seed 3, trial " + std::to_string(trial));
    const Rigid3 b_from_a = random_rigid(rng);
    Eigen::Matrix3Xd a = random_points(3 + trial % 5, rng);
    if (trial % 2 == 0) a.row(2).setZero();  // flat figures have a mirror image as good

    const Rigid3 fitted = fit_rigid(a, transformed(b_from_a, a));

    const Rigid3 error = fitted * inverse(b_from_a);
    EXPECT_LT(rotation_vector(error.rotation).norm(), 1e-12);
    EXPECT_LT(error.translation_m.norm(), 1e-12);
  }
}

TEST(FitRigid, NeverReturnsAReflection) {
  std::mt19937_64 rng(4);
  SCOPED_TRACE("seed 4");
  const Eigen::Matrix3Xd a = random_points(12, rng);
  Eigen::Matrix3Xd mirrored = a;
  mirrored.row(0) *= -1;

  const Rigid3 fitted = fit_rigid(a, mirrored);

  EXPECT_NEAR(fitted.rotation.toRotationMatrix().determinant(), 1, 1e-12);
  EXPECT_GT((transformed(fitted, a) - mirrored).norm(), 0.5);  // a mirror image cannot be reached
}

TEST(FitRigid, ScattersAsTheNormalEquationsPredict) {
  // The points are eight corners of a cube of side 2 h. An angle has variance sigma2 / (16 h2),
  // each coordinate of the middle sigma2 / 8.
  constexpr double kHalfSide = 0.1, kSigma = 1e-4;
  constexpr int kTrials = 4000;
  Eigen::Matrix3Xd a(3, 8);
  for (int i = 0; i < 8; ++i)
    a.col(i) = kHalfSide * Eigen::Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
  std::mt19937_64 rng(5);
  SCOPED_TRACE("seed 5");
  double angle2 = 0, shift2 = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Rigid3 fitted = fit_rigid(a, a + kSigma * random_points(8, rng));
    angle2 += rotation_vector(fitted.rotation).squaredNorm() / (3 * kTrials);
    shift2 += fitted.translation_m.squaredNorm() / (3 * kTrials);
  }

  // The mean of 12000 squares is known to 1.3 %.
  EXPECT_NEAR(angle2 / (kSigma * kSigma / (16 * kHalfSide * kHalfSide)), 1, 0.05);
  EXPECT_NEAR(shift2 / (kSigma * kSigma / 8), 1, 0.05);
}

TEST(FitRigid, AWeightOfZeroTakesAPointOut) {
  std::mt19937_64 rng(6);
  SCOPED_TRACE("seed 6");
  const Rigid3 b_from_a = random_rigid(rng);
  const Eigen::Matrix3Xd a = random_points(6, rng);
  Eigen::Matrix3Xd b = transformed(b_from_a, a);
  b.col(2) += Eigen::Vector3d(5, 5, 5);
  Eigen::VectorXd weight = Eigen::VectorXd::Constant(6, 3.0);
  weight[2] = 0;

  const Rigid3 error = fit_rigid(a, b, weight) * inverse(b_from_a);

  EXPECT_LT(rotation_vector(error.rotation).norm(), 1e-12);
  EXPECT_LT(error.translation_m.norm(), 1e-12);
}

}  // namespace
}  // namespace clothfit
