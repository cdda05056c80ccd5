// Checks the place of the flat sheet, from 3D tracks or a camera's pixels. The camera's own place
// in the world is calib's business (tests/calib/placement/world_placement_test.cpp).
#include "fit/observe/sheet_placement.h"

#include <gtest/gtest.h>

#include <random>

#include "calib/camera/projection.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

Eigen::Matrix2Xd marker_grid() {
  Eigen::Matrix2Xd places(2, 25);
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j) places.col(5 * i + j) << 0.1 * j, 0.08 * i;
  return places;
}

Rigid3 true_pose() {
  const Eigen::Vector3d s_axis = Eigen::Vector3d(1, 0.1, -0.2).normalized();
  const Eigen::Vector3d t_axis = s_axis.cross(Eigen::Vector3d(0.3, 1, 0.2)).normalized();
  Eigen::Matrix3d rotation;
  rotation << s_axis, -t_axis, s_axis.cross(-t_axis);
  return {Eigen::Quaterniond(rotation), {0.02, 0.1, 0.05}};
}

ObservationSet seen_by(const std::optional<CameraParameters>& camera, double sigma,
                       std::mt19937_64& generator) {
  ObservationSet set{
      .kind = camera ? "front" : "tracks3d", .dimension = camera ? 2 : 3, .camera = camera};
  const Eigen::Matrix2Xd places = marker_grid();
  std::normal_distribution<double> normal;
  for (int m = 0; m < places.cols(); ++m) {
    const Eigen::Vector3d point = true_pose() * Eigen::Vector3d(places(0, m), places(1, m), 0.0);
    Observation row{.frame = 0, .marker = m, .observed = *set.predict(point), .sigma = sigma};
    for (int c = 0; c < set.dimension; ++c) row.observed[c] += sigma * normal(generator);
    set.rows.push_back(row);
  }
  return set;
}

TEST(SheetPlacement, FindsTheSheetInNoiseFreeTracks) {
  std::mt19937_64 generator(1);
  for (const bool pixels : {false, true}) {
    SCOPED_TRACE(pixels ? "pixels" : "3D");
    ObservationSet set =
        seen_by(pixels ? std::optional(synthetic_camera()) : std::nullopt, 1e-9, generator);

    const auto placed = place_flat_sheet({set}, marker_grid(), 1);

    ASSERT_TRUE(placed);
    const Rigid3 difference = inverse(true_pose()) * *placed;
    EXPECT_LT(difference.translation_m.norm(), 1e-8);
    EXPECT_LT(difference.rotation.vec().norm(), 1e-8);
  }
}

TEST(SheetPlacement, ErrorFromPixelsIsThatOfLeastSquares) {
  // Given 200 noisy views. The sheet's pose has 6 unknowns, so the residuals keep 2 N - 6 degrees
  // of freedom: their mean square must be sigma^2 (2 N - 6) / (2 N).
  constexpr double kSigma = 0.2;
  std::mt19937_64 generator(7);
  double sum = 0;
  int count = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const ObservationSet set = seen_by(synthetic_camera(), kSigma, generator);

    const auto placed = place_flat_sheet({set}, marker_grid(), 1);

    ASSERT_TRUE(placed);
    for (const Observation& row : set.rows) {
      const Eigen::Vector2d flat = marker_grid().col(row.marker);
      const auto seen = set.predict(*placed * Eigen::Vector3d(flat.x(), flat.y(), 0.0));
      sum += (*seen - row.observed).head<2>().squaredNorm();
      count += 2;
    }
  }
  // Huber's loss bends the squares slightly at 3 sigma; the mean of 10 000 squares scatters by 1.4
  // %.
  const double expected = kSigma * kSigma * (50.0 - 6.0) / 50.0;
  EXPECT_NEAR(sum / count, expected, 0.06 * expected);
}

TEST(SheetPlacement, RefusesTooFewMarkersAndMarkersOnALine) {
  std::mt19937_64 generator(1);
  ObservationSet few = seen_by(std::nullopt, 1e-4, generator);
  few.rows.resize(3);
  ObservationSet line = seen_by(std::nullopt, 1e-4, generator);
  line.rows.resize(5);  // the first row of the grid

  EXPECT_FALSE(place_flat_sheet({few}, marker_grid(), 1));
  EXPECT_FALSE(place_flat_sheet({line}, marker_grid(), 1));
}

}  // namespace
}  // namespace clothfit
