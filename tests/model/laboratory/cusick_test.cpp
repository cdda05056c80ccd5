// Checks the drape test: its two ends, its measures, and that it repeats.

#include "model/laboratory/cusick.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "data/input_error.h"
#include "model/laboratory/shadow.h"
#include "tests/model/measured_cloth.h"

namespace clothfit {
namespace {

CusickOptions coarse() {
  CusickOptions options;
  options.spacing_m = 0.015;
  options.starts = 1;
  return options;
}

TEST(Cusick, OfAPlateIsNearlyOneAndFallsWithTheStiffness) {
  MeasuredFabric board = kMeasuredCloth, stiff = kMeasuredCloth;
  board.bending_warp_n_m = board.bending_weft_n_m = 5e-3;
  stiff.bending_warp_n_m = stiff.bending_weft_n_m = 1e-4;

  const CusickResult of_board = drape_cusick(board, coarse());
  const CusickResult of_stiff = drape_cusick(stiff, coarse());
  const CusickResult of_fabric = drape_cusick(kMeasuredCloth, coarse());

  ASSERT_EQ(of_board.usable + of_stiff.usable + of_fabric.usable, 3);
  EXPECT_GT(of_board.mean_coefficient, 0.99);
  EXPECT_EQ(of_board.mean_nodes, 0);
  EXPECT_LT(of_stiff.mean_coefficient, 0.95);
  EXPECT_LT(of_fabric.mean_coefficient, of_stiff.mean_coefficient - 0.1);
  EXPECT_GE(of_fabric.mean_nodes, 4);
}

TEST(Cusick, OfAnyLengthScaleIsTheSame) {
  // Lengths times k, bending times k^3, tension times k: the same shape.
  const double k = 2;
  MeasuredFabric large = kMeasuredCloth;
  large.bending_warp_n_m *= k * k * k;
  large.bending_weft_n_m *= k * k * k;
  large.tension_warp_n_per_m *= k;
  large.tension_weft_n_per_m *= k;
  large.shear_n_per_m *= k;
  MeasuredFabric stiff = kMeasuredCloth;
  CusickOptions options = coarse(), twice = coarse();
  twice.specimen_diameter_m *= k;
  twice.disc_diameter_m *= k;
  twice.spacing_m *= k;
  // A stiff fabric bends without folds, which an unevenness of one size would decide.
  for (MeasuredFabric* of : {&stiff, &large}) {
    of->bending_warp_n_m *= 30;
    of->bending_weft_n_m *= 30;
  }

  const CusickResult small = drape_cusick(stiff, options), big = drape_cusick(large, twice);

  ASSERT_EQ(small.usable + big.usable, 2);
  EXPECT_LT(small.mean_coefficient, 0.98);
  EXPECT_NEAR(small.mean_coefficient, big.mean_coefficient, 2e-3);
}

TEST(Cusick, IsTheSameAgainAndAnotherFromAnotherSeed) {
  CusickOptions options = coarse();
  options.spacing_m = 0.015;
  const CusickResult once = drape_cusick(kMeasuredCloth, options);
  options.starts = 2;

  const CusickResult again = drape_cusick(kMeasuredCloth, options);

  ASSERT_EQ(again.usable, 2);
  EXPECT_EQ(once.drapes[0].position_m, again.drapes[0].position_m);
  EXPECT_NE(again.drapes[0].position_m, again.drapes[1].position_m);
  EXPECT_TRUE(std::isnan(once.spread_coefficient));
  EXPECT_GE(again.spread_coefficient, 0);
}

TEST(Cusick, CountsTheWavesOfARimThatStandOut) {
  constexpr int kPoints = 200, kWaves = 7;
  Eigen::VectorXd radius(kPoints);
  for (int k = 0; k < kPoints; ++k) {
    const double angle = 2 * std::numbers::pi * k / kPoints;
    radius[k] = 0.12 + 0.01 * std::sin(kWaves * angle) + 0.0005 * std::sin(40 * angle);
  }
  EXPECT_EQ(count_nodes(radius, 0.005), kWaves);
  EXPECT_EQ(count_nodes(radius, 0.03), 0);
  EXPECT_EQ(count_nodes(Eigen::VectorXd::Ones(5), 0.01), 0);
}

TEST(Shadow, CountsWhatLiesBehindOneAnotherOnce) {
  Eigen::Matrix3Xd position(3, 8);
  position << 0, 0.2, 0.2, 0, 0.1, 0.3, 0.3, 0.1,  //
      0, 0, 0.1, 0.1, 0, 0, 0.1, 0.1,              //
      0, 0, 0, 0, 1, 1, 1, 1;
  Eigen::Matrix3Xi triangle(3, 4);
  triangle << 0, 0, 4, 4, 1, 2, 6, 7, 2, 3, 5, 6;  // the second square is seen from behind

  EXPECT_NEAR(shadow_area_m2(position, triangle, 1e-3), 0.3 * 0.1, 1e-12);
}

TEST(Cusick, RefusesDiscsAndMeshesOfNoTest) {
  CusickOptions options;
  options.disc_diameter_m = 0.31;
  EXPECT_THROW(drape_cusick(kMeasuredCloth, options), InputError);
  options = {};
  options.spacing_m = 0.05;
  EXPECT_THROW(drape_cusick(kMeasuredCloth, options), InputError);
  options = {};
  options.starts = 0;
  EXPECT_THROW(drape_cusick(kMeasuredCloth, options), InputError);
  options = {};
  options.go_on = [](double) { return false; };
  EXPECT_EQ(drape_cusick(kMeasuredCloth, options).drapes[0].reason, MinimiseReason::cancelled);
}

}  // namespace
}  // namespace clothfit
