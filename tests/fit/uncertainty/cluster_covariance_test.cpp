// Checks the sandwich over blocks: closed forms, and coverage where the model is wrong in a smooth
// way. Not checked here: how blocks are chosen (space_time_blocks_test.cpp), and a cloth's own
// residuals, whose coverage docs/theory/identification.md states.

#include "fit/uncertainty/cluster_covariance.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "data/input_error.h"
#include "fit/jobs/draws.h"
#include "fit/uncertainty/space_time_blocks.h"
#include "tests/fit/smooth_misfit.h"

namespace clothfit {
namespace {

LinearisedFit line_fit() {
  LinearisedFit fit{.residual = Eigen::VectorXd(6), .jacobian = Eigen::MatrixXd(6, 2)};
  fit.jacobian << 1, 0, 1, 1, 1, 2, 1, 3, 1, 4, 1, 7;
  const Eigen::VectorXd y = (Eigen::VectorXd(6) << 1, 0, 2, 5, 3, 9).finished();
  const Eigen::MatrixXd& j = fit.jacobian;
  fit.residual = j * (j.transpose() * j).inverse() * (j.transpose() * y) - y;
  return fit;
}

const Eigen::VectorXi kEachItsOwn = Eigen::VectorXi::LinSpaced(6, 0, 5);

TEST(ClusterCovariance, OfSingleObservationsIsWhitesWithItsCorrections) {
  const LinearisedFit fit = line_fit();
  const Eigen::MatrixXd& j = fit.jacobian;
  const Eigen::MatrixXd inverse = (j.transpose() * j).inverse();
  const Eigen::VectorXd freedom =
      Eigen::VectorXd::Ones(6) - (j * inverse * j.transpose()).diagonal();

  const auto expect = [&](ClusterCorrection correction, const Eigen::VectorXd& factor) {
    const Eigen::VectorXd squares = fit.residual.cwiseAbs2().cwiseProduct(factor);
    const Eigen::MatrixXd expected = inverse * j.transpose() * squares.asDiagonal() * j * inverse;
    const ClusterCovariance found = cluster_covariance(fit, kEachItsOwn, correction);
    ASSERT_TRUE(found.usable);
    EXPECT_LT((found.covariance - expected).norm(), 1e-12 * expected.norm());
  };
  expect(ClusterCorrection::none, Eigen::VectorXd::Ones(6));                 // HC0
  expect(ClusterCorrection::bias_reduced, freedom.cwiseInverse());           // HC2
  expect(ClusterCorrection::jackknife, freedom.cwiseAbs2().cwiseInverse());  // HC3
}

TEST(ClusterCovariance, OfAMeanOfEqualBlocksIsThatOfTheirMeans) {
  // Given 5 blocks of 4 observations of one mean
  LinearisedFit fit{.residual = Eigen::VectorXd(20), .jacobian = Eigen::MatrixXd::Ones(20, 1)};
  Eigen::VectorXi block(20);
  Draws draws(3, 0, 0);
  SCOPED_TRACE("seed 3");
  for (int i = 0; i < 20; ++i) {
    block[i] = i / 4;
    fit.residual[i] = draws.normal() + i / 4;
  }
  fit.residual.array() -= fit.residual.mean();
  const Eigen::VectorXd means = fit.residual.reshaped(4, 5).colwise().mean().transpose();

  // then the variance is that of a mean of 5 independent numbers, with Student's 4 degrees.
  const ClusterCovariance found = cluster_covariance(fit, block);
  ASSERT_TRUE(found.usable);
  EXPECT_NEAR(found.covariance(0, 0), means.squaredNorm() / (5 * 4), 1e-12);
  EXPECT_NEAR(found.degrees_of_freedom[0], 4, 1e-9);
  EXPECT_NEAR(half_width(found, 0.9)[0], 2.1318467863 * std::sqrt(found.covariance(0, 0)), 1e-8);
}

TEST(ClusterCovariance, ByTheJackknifeIsTheScatterOfFitsWithoutEachBlock) {
  const MisfitReplicate given = draw_misfit({}, 11, 0);
  SCOPED_TRACE("seed 11");
  const SpaceTimeBlocks blocks = space_time_blocks(misfit_places(), {.along_s = 2, .along_t = 2});
  const Eigen::MatrixXd& j = given.fit.jacobian;
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(3, 3);
  for (int b = 0; b < blocks.count; ++b) {
    const Eigen::VectorXd kept = (blocks.block.array() != b).cast<double>();
    const Eigen::VectorXd change = -(j.transpose() * kept.asDiagonal() * j).inverse() *
                                   (j.transpose() * kept.cwiseProduct(given.fit.residual));
    expected += change * change.transpose();
  }

  const ClusterCovariance found =
      cluster_covariance(given.fit, blocks.block, ClusterCorrection::jackknife);

  EXPECT_LT((found.covariance - expected).norm(), 1e-9 * expected.norm());
}

TEST(ClusterCovariance, IsUnbiasedForWhiteResidualsWhenItsBiasIsReduced) {
  SCOPED_TRACE("seed 21");
  const SpaceTimeBlocks blocks = space_time_blocks(misfit_places(), {.along_s = 2, .along_t = 2});
  MisfitReplicate given = draw_misfit({}, 21, 0);
  const Eigen::MatrixXd j = given.fit.jacobian;
  const Eigen::MatrixXd inverse = (j.transpose() * j).inverse();
  constexpr int kReplicates = 2000;
  Eigen::VectorXd reduced = Eigen::VectorXd::Zero(3), plain = reduced, spread = reduced;
  Eigen::VectorXd degrees;
  for (int replicate = 0; replicate < kReplicates; ++replicate) {
    Draws draws(21, 1 + replicate, 0);
    Eigen::VectorXd noise(j.rows());
    for (double& number : noise) number = draws.normal();
    given.fit.residual = noise - j * (inverse * (j.transpose() * noise));
    const ClusterCovariance found = cluster_covariance(given.fit, blocks.block);
    reduced += found.covariance.diagonal() / kReplicates;
    spread += found.covariance.diagonal().cwiseAbs2() / kReplicates;
    degrees = found.degrees_of_freedom;
    plain +=
        cluster_covariance(given.fit, blocks.block, ClusterCorrection::none).covariance.diagonal() /
        kReplicates;
  }
  for (int p = 0; p < 3; ++p) {
    // The mean of 2000 chi-squares of about 2.5 degrees scatters by 2 %.
    EXPECT_NEAR(reduced[p] / inverse(p, p), 1, 0.08);
    EXPECT_LT(plain[p] / inverse(p, p), 0.9);
    // Satterthwaite: degrees = 2 mean^2 / variance; a variance from 2000 scatters by some 6 %.
    const double variance = spread[p] - reduced[p] * reduced[p];
    EXPECT_NEAR(2 * reduced[p] * reduced[p] / variance / degrees[p], 1, 0.3);
  }
}

TEST(ClusterCovariance, CoversWhereTheModelIsWrongInASmoothWay) {
  // Given errors that reach a third of the cloth and a fifth of the recording
  SCOPED_TRACE("seed 31");
  constexpr int kReplicates = 1000;
  const ObservationPlaces places = misfit_places();
  Eigen::Vector3d robust = Eigen::Vector3d::Zero(), plain = Eigen::Vector3d::Zero();
  for (int replicate = 0; replicate < kReplicates; ++replicate) {
    const MisfitReplicate given = draw_misfit({}, 31, replicate);
    const Eigen::MatrixXd& j = given.fit.jacobian;
    const BlockCounts counts = choose_block_counts(places, given.fit.residual);
    const Eigen::VectorXi block = space_time_blocks(places, counts).block;
    const Eigen::VectorXd width = half_width(cluster_covariance(given.fit, block), 0.9);
    const double variance =
        given.fit.residual.squaredNorm() / static_cast<double>(j.rows() - j.cols());
    const Eigen::VectorXd sigma = ((j.transpose() * j).inverse().diagonal() * variance).cwiseSqrt();
    for (int p = 0; p < 3; ++p) {
      robust[p] += std::abs(given.estimate[p]) <= width[p];
      plain[p] += std::abs(given.estimate[p]) <= 1.645 * sigma[p];
    }
  }

  for (int p = 0; p < 3; ++p) {
    EXPECT_GE(robust[p] / kReplicates, 0.85);
    EXPECT_LE(robust[p] / kReplicates, 0.95);
    EXPECT_LT(plain[p] / kReplicates, 0.65);
  }
}

TEST(ClusterCovariance, CountsAPriorAsASourceOfScatter) {
  // Given a coordinate that the data say next to nothing of
  LinearisedFit fit = line_fit();
  fit.jacobian.col(1) *= 1e-6;
  fit.prior_information = Eigen::MatrixXd::Zero(2, 2);
  fit.prior_information(1, 1) = 4;

  const ClusterCovariance found = cluster_covariance(fit, kEachItsOwn);

  // then its variance is the prior's, and known as well.
  EXPECT_NEAR(found.covariance(1, 1), 0.25, 1e-6);
  EXPECT_GT(found.degrees_of_freedom[1], 1e6);
}

TEST(ClusterCovariance, TakesAWeightedRowAsOneDividedByAsMuch) {
  LinearisedFit weighted = line_fit(), divided = weighted;
  weighted.weight = (Eigen::VectorXd(6) << 1, 0.5, 1, 0.25, 1, 1).finished();
  const Eigen::VectorXd root = weighted.weight.cwiseSqrt();
  divided.residual = root.cwiseProduct(divided.residual);
  divided.jacobian = root.asDiagonal() * divided.jacobian;

  const Eigen::MatrixXd a = cluster_covariance(weighted, kEachItsOwn).covariance;
  const Eigen::MatrixXd b = cluster_covariance(divided, kEachItsOwn).covariance;

  EXPECT_LT((a - b).norm(), 1e-12 * a.norm());
}

TEST(ClusterCovariance, SaysWhatItCannotKnow) {
  LinearisedFit fit = line_fit();
  fit.jacobian.conservativeResize(6, 3);
  fit.jacobian.col(2).setZero();
  const ClusterCovariance at_bound = cluster_covariance(fit, kEachItsOwn);
  EXPECT_TRUE(at_bound.usable);
  EXPECT_TRUE(std::isinf(half_width(at_bound, 0.9)[2]));
  EXPECT_LT((at_bound.covariance.topLeftCorner(2, 2) -
             cluster_covariance(line_fit(), kEachItsOwn).covariance)
                .norm(),
            1e-12);

  fit.jacobian.col(2) = 2 * fit.jacobian.col(0);
  const ClusterCovariance alike = cluster_covariance(fit, kEachItsOwn);
  EXPECT_FALSE(alike.usable);
  EXPECT_FALSE(alike.reason.empty());
}

TEST(ClusterCovariance, RefusesOneBlockAndWhatIsNotFinite) {
  LinearisedFit fit = line_fit();
  EXPECT_THROW(cluster_covariance(fit, Eigen::VectorXi::Zero(6)), InputError);  // one block
  fit.residual[0] = std::nan("");
  EXPECT_THROW(cluster_covariance(fit, kEachItsOwn), InputError);
}

}  // namespace
}  // namespace clothfit
