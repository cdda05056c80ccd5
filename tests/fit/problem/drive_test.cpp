// Checks the motion of held points. That the model keeps them there is checked in
// tests/model/integrate/step_test.cpp, the smoothing itself in smoothing_spline_test.cpp.
#include "fit/problem/drive.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "data/input_error.h"

namespace clothfit {
namespace {

using ::testing::HasSubstr;

const Mesh kMesh{.columns = 5, .rows = 4, .width_m = 0.4, .height_m = 0.3};

Recording recording_with(const HeldPoint& held) {
  Recording recording;
  recording.folder = "somewhere";
  recording.markers.markers = {{.name = "corner", .s_m = 0, .t_m = 0},
                               {.name = "other", .s_m = 0.4, .t_m = 0}};
  recording.held = {held};
  return recording;
}

std::string refusal(const Recording& recording, const Tracks3d& tracks) {
  try {
    make_drive(recording, kMesh, tracks, std::vector<double>(40, 0.0));
  } catch (const InputError& error) {
    return error.what();
  }
  return "not refused";
}

TEST(Drive, FixedPointsHaveNoMotionOfTheirOwn) {
  const Drive drive = make_drive(recording_with({.at_m = {0.4, 0.0}}), kMesh, {}, {0.0});

  ASSERT_EQ(drive.held.size(), 1u);
  EXPECT_FALSE(drive.held[0].motion);
  EXPECT_TRUE(drive.driving_markers.empty());
}

TEST(Drive, TrackedPointsFollowTheirMarkerThroughItsNoise) {
  // Given a corner that swings sideways by 5 cm once a second, measured with 2 mm noise
  const auto path = [](double t) {
    return Eigen::Vector3d(0.05 * std::sin(2 * std::numbers::pi * t), 0.01 * t, 0.3);
  };
  constexpr double kNoise = 2e-3;
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  Tracks3d tracks;
  std::vector<double> time_s;
  for (int f = 0; f < 120; ++f) {
    time_s.push_back(f / 60.0);
    Eigen::Vector3d noise;
    for (double& n : noise) n = kNoise * normal(generator);
    tracks.push_back({.frame = f, .marker = 0, .position_m = path(time_s.back()) + noise});
    tracks.push_back({.frame = f, .marker = 1, .position_m = Eigen::Vector3d::Zero()});
  }

  const Drive drive =
      make_drive(recording_with({.motion = HeldMotion::tracked}), kMesh, tracks, time_s);

  // Then the drive is well below the noise off the true path, between frames too
  ASSERT_EQ(drive.held.size(), 1u);
  EXPECT_EQ(drive.driving_markers, std::vector<int>{0});
  double sum = 0;
  int count = 0;
  for (double t = 0.1; t < 1.9; t += 0.007, ++count)
    sum += (drive.held[0].motion(t) - path(t)).squaredNorm() / 3;
  EXPECT_LT(std::sqrt(sum / count), 0.6 * kNoise);
}

TEST(Drive, KnownPathsAreFollowedThroughEverySample) {
  const auto file = std::filesystem::temp_directory_path() /
                    ("clothfit_drive_test_" + std::to_string(::getpid()) + ".csv");
  std::ofstream(file) << "time,x,y,z\n0,0,0,0\n0.5,0.1,0,0.2\n1.0,0.1,0.3,0.1\n1.5,0,0,0\n";

  const Drive drive =
      make_drive(recording_with({.motion = HeldMotion::path, .file = file}), kMesh, {}, {0.0});

  EXPECT_LT((drive.held[0].motion(0.5) - Eigen::Vector3d(0.1, 0, 0.2)).norm(), 1e-9);
  EXPECT_LT((drive.held[0].motion(1.0) - Eigen::Vector3d(0.1, 0.3, 0.1)).norm(), 1e-9);
  std::filesystem::remove(file);
}

TEST(Drive, AnEdgeHoldsEveryVertexOnIt) {
  const auto vertices = [](ClothEdge edge) {
    std::vector<int> result;
    for (const HeldVertexWeights& held :
         make_drive(recording_with({.edge = edge}), kMesh, {}, {0.0}).held)
      result.push_back(held.weights.front().vertex);
    return result;
  };

  EXPECT_THAT(vertices(ClothEdge::top), ::testing::ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(vertices(ClothEdge::bottom), ::testing::ElementsAre(15, 16, 17, 18, 19));
  EXPECT_THAT(vertices(ClothEdge::left), ::testing::ElementsAre(0, 5, 10, 15));
  EXPECT_THAT(vertices(ClothEdge::right), ::testing::ElementsAre(4, 9, 14, 19));
}

TEST(Drive, RefusesATrackedPointThatNobodyTracked) {
  EXPECT_THAT(refusal(recording_with({.at_m = {0.2, 0.0}, .motion = HeldMotion::tracked}), {}),
              HasSubstr("no marker lies at the held point"));
  EXPECT_THAT(refusal(recording_with({.motion = HeldMotion::tracked}), {}),
              HasSubstr("has only 0 positions of its marker corner"));
}

}  // namespace
}  // namespace clothfit
