// Checks partitions over the cloth and time, and ranges of correlation. Not checked here: whether a
// covariance over such blocks covers (cluster_covariance_test.cpp).

#include "fit/uncertainty/space_time_blocks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fit/jobs/draws.h"
#include "tests/fit/smooth_misfit.h"

namespace clothfit {
namespace {

TEST(SpaceTimeBlocks, CutTheExtentIntoEqualParts) {
  const ObservationPlaces places = misfit_places();

  const SpaceTimeBlocks blocks =
      space_time_blocks(places, {.along_s = 2, .along_t = 3, .in_time = 4});

  ASSERT_EQ(blocks.count, 24);
  Eigen::VectorXi size = Eigen::VectorXi::Zero(24);
  for (const int block : blocks.block) ++size[block];
  // A block of the 6 x 6 markers and 20 frames has 3 x 2 markers and 5 frames.
  EXPECT_EQ(size.minCoeff(), 30);
  EXPECT_EQ(size.maxCoeff(), 30);
  for (Eigen::Index i = 0; i < blocks.block.size(); ++i) {
    const int s = places.s_m[i] > 0.2, t = std::min(2, static_cast<int>(places.t_m[i] / 0.4 * 3)),
              time = std::min(3, static_cast<int>(places.time_s[i] * 4));
    EXPECT_EQ(blocks.block[i], (s * 3 + t) * 4 + time);
  }
}

TEST(SpaceTimeBlocks, HaveNoIndexWithoutObservations) {
  ObservationPlaces places{Eigen::VectorXd(3), Eigen::VectorXd::Zero(3), Eigen::VectorXd::Zero(3),
                           Eigen::VectorXi::Zero(3)};
  places.s_m << 0, 0.01, 1;

  const SpaceTimeBlocks blocks = space_time_blocks(places, {.along_s = 5, .along_t = 7});

  EXPECT_EQ(blocks.count, 2);
  EXPECT_EQ(blocks.block, Eigen::Vector3i(0, 0, 1));
}

TEST(CorrelationRanges, OfWhiteResidualsAreACellWide) {
  const ObservationPlaces places = misfit_places();
  Draws draws(5, 0, 0);
  SCOPED_TRACE("seed 5");
  Eigen::VectorXd residual(places.s_m.size());
  for (double& number : residual) number = 100 * draws.normal();

  const CorrelationRanges ranges = correlation_ranges(places, residual);

  // The range is one cell, or two where a lag happens to lie beyond two standard errors.
  EXPECT_LE(ranges.s_m, 2 * 0.4 / 8 + 1e-12);
  EXPECT_LE(ranges.t_m, 2 * 0.4 / 8 + 1e-12);
  EXPECT_LE(ranges.time_s, 2 * 1.0 / 32 + 1e-12);
}

TEST(CorrelationRanges, OfAStandingWaveAreAQuarterOfItsLength) {
  const ObservationPlaces places = misfit_places();
  Eigen::VectorXd residual(places.s_m.size());
  for (Eigen::Index i = 0; i < residual.size(); ++i)
    residual[i] = std::cos(2 * std::numbers::pi * places.time_s[i] / 0.4);

  const CorrelationRanges ranges = correlation_ranges(places, residual);

  EXPECT_NEAR(ranges.time_s, 0.1, 1.5 / 32);  // to a cell and a half
  EXPECT_DOUBLE_EQ(ranges.s_m, 0.4);          // the same everywhere on the cloth
  EXPECT_DOUBLE_EQ(ranges.t_m, 0.4);
}

TEST(BlockCounts, AreFewWhereResidualsReachFarAndManyWhereTheyDoNot) {
  const ObservationPlaces places = misfit_places();
  Eigen::VectorXd far(places.s_m.size()), white(places.s_m.size());
  Draws draws(6, 0, 0);
  SCOPED_TRACE("seed 6");
  for (Eigen::Index i = 0; i < far.size(); ++i) {
    far[i] = places.s_m[i] - 0.2;
    white[i] = draws.normal();
  }

  const BlockCounts few = choose_block_counts(places, far);
  const BlockCounts many = choose_block_counts(places, white);

  EXPECT_EQ(few.along_t, 2);
  EXPECT_EQ(many.along_s, 3);
  EXPECT_EQ(many.along_t, 3);
  EXPECT_EQ(few.in_time, 1);
  EXPECT_EQ(many.in_time, 1);
}

}  // namespace
}  // namespace clothfit
