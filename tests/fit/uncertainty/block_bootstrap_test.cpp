// Checks the bootstrap over blocks. Not checked here: how blocks are chosen
// (space_time_blocks_test.cpp).

#include "fit/uncertainty/block_bootstrap.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "fit/uncertainty/cluster_covariance.h"
#include "fit/uncertainty/space_time_blocks.h"
#include "tests/fit/smooth_misfit.h"

namespace clothfit {
namespace {

const BootstrapOptions kResampled{.weights = BlockWeights::resampled, .replicates = 199};
const BootstrapOptions kWild{.weights = BlockWeights::wild, .replicates = 199};

Eigen::VectorXi nine_blocks() {
  return space_time_blocks(misfit_places(), {.along_s = 3, .along_t = 3}).block;
}

TEST(BlockBootstrap, GivesTheSameBytesForAnyOrder) {
  Eigen::MatrixXd forward(9, 50), backward(9, 50);
  for (const BootstrapOptions& options : {kResampled, kWild}) {
    for (int k = 0; k < 50; ++k) forward.col(k) = block_weights(options, 9, k);
    for (int k = 49; k >= 0; --k) backward.col(k) = block_weights(options, 9, k);
    EXPECT_EQ(forward, backward);
  }
  const LinearisedFit fit = draw_misfit({}, 1, 0).fit;
  BootstrapOptions fewer = kWild;
  fewer.replicates = 50;
  EXPECT_EQ(bootstrap_linearised(fit, nine_blocks(), kWild).change.leftCols(50),
            bootstrap_linearised(fit, nine_blocks(), fewer).change);
}

TEST(BlockBootstrap, DrawsNumbersOfTheRightMeanAndVariance) {
  SCOPED_TRACE("seed 1");
  constexpr int kReplicates = 4000;
  for (const BootstrapOptions& options : {kResampled, kWild}) {
    const bool wild = options.weights == BlockWeights::wild;
    double sum = 0, squares = 0;
    for (int k = 0; k < kReplicates; ++k) {
      const Eigen::VectorXd weights = block_weights(options, 9, k);
      if (!wild) {
        EXPECT_EQ(weights.sum(), 9);
      }
      sum += weights.sum() / (9.0 * kReplicates);
      squares += weights.squaredNorm() / (9.0 * kReplicates);
    }
    // There are 36 000 numbers of variance 1. The mean scatters by 0.005, the mean square by less
    // than 0.01.
    EXPECT_NEAR(sum, wild ? 0 : 1, 0.025);
    EXPECT_NEAR(squares, wild ? 1 : 2 - 1.0 / 9, 0.05);
  }
}

TEST(BlockBootstrap, ByOneStepIsTheRefitOfALinearModel) {
  const MisfitReplicate given = draw_misfit({}, 2, 0);
  const Eigen::VectorXi block = nine_blocks();
  const Eigen::MatrixXd& j = given.fit.jacobian;

  const auto change = [&](const Eigen::MatrixXd& information, const Eigen::VectorXd& rows) {
    return Eigen::VectorXd(
        -information.ldlt().solve(j.transpose() * rows.cwiseProduct(given.fit.residual)));
  };
  const Bootstrap resampled = bootstrap_linearised(given.fit, block, kResampled);
  const Bootstrap wild = bootstrap_linearised(given.fit, block, kWild);
  const double scale = wild.change.colwise().norm().mean();
  for (int k = 0; k < kResampled.replicates; ++k) {
    const Eigen::VectorXd weight = block_weights(kResampled, 9, k)(block);
    const Eigen::VectorXd refitted = change(j.transpose() * weight.asDiagonal() * j, weight);
    EXPECT_LT((resampled.change.col(k) - refitted).norm(), 1e-9 * scale);
    const Eigen::VectorXd factor = block_weights(kWild, 9, k)(block);
    const Eigen::VectorXd redrawn = change(j.transpose() * j, factor);
    EXPECT_LT((wild.change.col(k) - redrawn).norm(), 1e-9 * scale);
  }
}

TEST(BlockBootstrap, ScattersAsTheSandwichSays) {
  SCOPED_TRACE("seed 3");
  const LinearisedFit fit = draw_misfit({}, 3, 0).fit;
  BootstrapOptions options = kWild;
  options.replicates = 4000;

  const Bootstrap bootstrap = bootstrap_linearised(fit, nine_blocks(), options);

  const Eigen::MatrixXd expected =
      cluster_covariance(fit, nine_blocks(), ClusterCorrection::none).covariance;
  const Eigen::MatrixXd scatter =
      bootstrap.change * bootstrap.change.transpose() / options.replicates;
  // Standard deviations from 4000 replicates scatter by about 1 %.
  for (int p = 0; p < 3; ++p) {
    EXPECT_NEAR(std::sqrt(scatter(p, p) / expected(p, p)), 1, 0.05);
    EXPECT_NEAR(bootstrap.sigma[p], std::sqrt(expected(p, p)), 1e-12);
  }
}

TEST(BlockBootstrap, CoversByStudentisedChangesWhereThePercentilesAreTooNarrow) {
  SCOPED_TRACE("seed 41");
  constexpr int kReplicates = 300;
  const Eigen::VectorXi block = nine_blocks();
  double studentised = 0, percentile = 0;
  for (int replicate = 0; replicate < kReplicates; ++replicate) {
    const MisfitReplicate given = draw_misfit({}, 41, replicate);
    BootstrapOptions options = kWild;
    options.seed = static_cast<unsigned long long>(replicate);
    const Bootstrap bootstrap = bootstrap_linearised(given.fit, block, options);
    const ChangeIntervals by_t = studentised_intervals(bootstrap, 0.9);
    const ChangeIntervals by_share = percentile_intervals(bootstrap, 0.9);
    for (int p = 0; p < 3; ++p) {
      const double truth = -given.estimate[p];
      studentised += (by_t.lower[p] <= truth && truth <= by_t.upper[p]) / (3.0 * kReplicates);
      percentile +=
          (by_share.lower[p] <= truth && truth <= by_share.upper[p]) / (3.0 * kReplicates);
    }
  }

  EXPECT_GE(studentised, 0.85);
  EXPECT_LE(studentised, 0.95);
  EXPECT_LT(percentile, studentised - 0.03);
}

TEST(BlockBootstrap, TakesQuantilesOfTheReplicatesThatHaveAnEstimate) {
  Bootstrap bootstrap;
  bootstrap.change.resize(1, 199);
  for (int k = 0; k < 199; ++k)
    bootstrap.change(0, k) = k % 2 == 0 ? std::numeric_limits<double>::quiet_NaN() : k;

  // They are the odd numbers 1 ... 197.
  const ChangeIntervals ends = percentile_intervals(bootstrap, 0.9);
  EXPECT_NEAR(ends.lower[0], 0.05 * 198, 2);
  EXPECT_NEAR(ends.upper[0], 0.95 * 198, 2);
}

TEST(BlockBootstrap, HasNoEstimateWhereTheDataSayNothing) {
  LinearisedFit fit = draw_misfit({}, 1, 0).fit;
  fit.jacobian.col(1).setZero();
  const Bootstrap bootstrap = bootstrap_linearised(fit, nine_blocks(), kWild);
  EXPECT_EQ(bootstrap.failed, kWild.replicates);
  EXPECT_TRUE(std::isnan(studentised_intervals(bootstrap, 0.9).lower[0]));
}

}  // namespace
}  // namespace clothfit
