// Checks distances of measured clouds from a surface by closed forms.
#include "fit/observe/cloud_errors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/jobs/draws.h"

namespace clothfit {
namespace {

TEST(ChamferDistance, IsTwiceTheSquareBetweenASetAndItsCopyNearby) {
  Eigen::Matrix3Xd points(3, 25);
  for (int k = 0; k < 25; ++k) points.col(k) << k % 5, k / 5, 0;
  const Eigen::Matrix3Xd moved = points.colwise() + Eigen::Vector3d(0, 0, 0.3);

  EXPECT_EQ(chamfer_distance_m2(points, points), 0);
  EXPECT_NEAR(chamfer_distance_m2(points, moved), 2 * 0.09, 1e-12);
}

TEST(ChamferDistance, CountsBothWays) {
  // One point of the second set is far from all of the first; none of the first is far from the
  // second.
  const Eigen::Matrix3Xd first = Eigen::Matrix3Xd::Zero(3, 4);
  Eigen::Matrix3Xd second = Eigen::Matrix3Xd::Zero(3, 2);
  second(0, 1) = 2;
  EXPECT_NEAR(chamfer_distance_m2(first, second), 4.0 / 2, 1e-12);
  EXPECT_NEAR(chamfer_distance_m2(second, first), 4.0 / 2, 1e-12);
  EXPECT_EQ(mean_square_to_nearest_m2(first, second), 0);
  EXPECT_NEAR(mean_square_to_nearest_m2(second, first), 4.0 / 2, 1e-12);
}

class CloudsOfASheet : public testing::Test {
 protected:
  /// Returns points of the flat sheet of 0.4 m, moved off it.
  static Eigen::Matrix3Xd cloud(double off_m, int seed) {
    Draws draws(static_cast<std::uint64_t>(seed), 1, 0);
    Eigen::Matrix3Xd points_m(3, 4000);
    for (auto point : points_m.colwise())
      point << 0.4 * draws.uniform(), 0.4 * draws.uniform(), off_m;
    return points_m;
  }

  const Mesh mesh_{.columns = 9, .rows = 9, .width_m = 0.4, .height_m = 0.4};
  const std::vector<Eigen::Matrix3Xd> position_m_ =
      std::vector<Eigen::Matrix3Xd>(6, flat_positions(mesh_));
};

TEST_F(CloudsOfASheet, AreAsFarAsTheyWereMoved) {
  const double off_m = 0.02;
  const CloudErrors errors = cloud_errors({{0, cloud(off_m, 1)}}, mesh_, position_m_, 4);
  // The nearest of 4000 random points of a square is about half a spacing aside. In the mean square
  // that is half of its area per point, over pi.
  const double sampling_m2 = 0.16 / 4000 / M_PI;
  EXPECT_NEAR(errors.all.chamfer_m2, 2 * (off_m * off_m + sampling_m2), 0.2 * 2 * sampling_m2);
}

TEST_F(CloudsOfASheet, AreJudgedInTheFramesThatTheyWereSeenIn) {
  const PointClouds clouds{
      {1, cloud(0.01, 1)}, {3, cloud(0.01, 2)}, {5, cloud(0.03, 3)}, {6, cloud(1, 4)}};
  const CloudErrors errors = cloud_errors(clouds, mesh_, position_m_, 4);

  EXPECT_EQ(errors.fitted.frames, 2);
  EXPECT_EQ(errors.held_out.frames, 1);  // nothing was simulated in frame 6
  EXPECT_EQ(errors.all.frames, 3);
  EXPECT_NEAR(errors.held_out.chamfer_m2 - errors.fitted.chamfer_m2, 2 * (9e-4 - 1e-4), 5e-6);
  EXPECT_NEAR(errors.all.chamfer_m2,
              (2 * errors.fitted.chamfer_m2 + errors.held_out.chamfer_m2) / 3, 1e-12);
}

}  // namespace
}  // namespace clothfit
