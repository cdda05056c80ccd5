// Surfaces as obstacles: which side they enclose, and whether cloth goes through them.

#include "fit/preflight/obstacle_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

namespace clothfit {
namespace {

/// A box from `low` to `high`, its faces outwards.
SurfaceMesh box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  SurfaceMesh surface;
  surface.vertex_m.resize(3, 8);
  for (int v = 0; v < 8; ++v)
    for (int axis = 0; axis < 3; ++axis)
      surface.vertex_m(axis, v) = (v >> axis & 1) != 0 ? high[axis] : low[axis];
  surface.triangle.resize(3, 12);
  surface.triangle << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,  //
      2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7,                  //
      3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5;
  return surface;
}

SurfaceMesh turned_round(SurfaceMesh surface) {
  surface.triangle.row(1).swap(surface.triangle.row(2));
  return surface;
}

TEST(Obstacles, EncloseTheVolumeOfABox) {
  const SurfaceMesh surface = box({0, 0, 0}, {0.2, 0.3, 0.5});

  EXPECT_NEAR(*enclosed_volume_m3(surface), 0.03, 1e-15);
  EXPECT_NEAR(*enclosed_volume_m3(turned_round(surface)), -0.03, 1e-15);
}

TEST(Obstacles, EncloseNothingWhereTheyAreOpen) {
  SurfaceMesh surface = box({0, 0, 0}, {1, 1, 1});
  surface.triangle.conservativeResize(3, 11);

  EXPECT_FALSE(enclosed_volume_m3(surface));
}

TEST(Obstacles, HavePointsBehindThem) {
  Eigen::Matrix3Xd points(3, 3);
  points.col(0) << 0.1, 0.12, 0.57;
  points.col(1) << 0.1, 0.1, 0.61;
  points.col(2) << -0.01, 0.2, 0.3;
  const SurfaceMesh surface = box({0, 0, 0}, {0.2, 0.3, 0.6});
  const auto is = [](double depth_m) { return testing::DoubleNear(depth_m, 1e-12); };

  EXPECT_THAT(depth_behind_m(surface, points), testing::ElementsAre(is(0.03), is(0), is(0)));
  EXPECT_THAT(depth_behind_m(turned_round(surface), points),
              testing::ElementsAre(is(0), is(0.01), is(0.01)));
}

TEST(Obstacles, AreAsNarrowAsTheirThinnestPart) {
  SurfaceMesh both = box({0, 0, 0}, {1, 1, 0.5});
  const SurfaceMesh post = box({2, 0, 0}, {2.01, 0.02, 0.7});
  const Eigen::Index vertices = both.vertex_m.cols(), faces = both.triangle.cols();
  both.vertex_m.conservativeResize(3, vertices + post.vertex_m.cols());
  both.vertex_m.rightCols(post.vertex_m.cols()) = post.vertex_m;
  both.triangle.conservativeResize(3, faces + post.triangle.cols());
  both.triangle.rightCols(post.triangle.cols()) =
      post.triangle.array() + static_cast<int>(vertices);

  EXPECT_NEAR(*narrowest_part_m(post), 0.02, 1e-15);
  EXPECT_NEAR(*narrowest_part_m(both), 0.02, 1e-15);
}

TEST(Obstacles, PierceAClothThatTheyStandIn) {
  const Mesh mesh{5, 5, 0.4, 0.4};
  const SurfaceMesh post = box({0.14, 0.14, 0}, {0.15, 0.15, 0.5});
  std::vector<Eigen::Matrix3Xd> position_m;
  for (const double height_m : {0.7, 0.51, 0.4, 0.3}) {
    position_m.push_back(Eigen::Matrix3Xd::Zero(3, 25));
    for (int i = 0; i < 5; ++i)
      for (int j = 0; j < 5; ++j)
        position_m.back().col(mesh.vertex(i, j)) << 0.1 * j, 0.1 * i, height_m;
  }

  EXPECT_EQ(frame_pierced(post, mesh, position_m), 2);
  position_m.resize(2);
  EXPECT_EQ(frame_pierced(post, mesh, position_m), std::nullopt);
}

TEST(Obstacles, AreHeldAgainstTheClothThatMeetsThem) {
  const Mesh mesh{9, 9, 0.4, 0.4};
  Eigen::Matrix3Xd start_m(3, 81);
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 9; ++j) start_m.col(mesh.vertex(i, j)) << 0.05 * j, 0.05 * i, 0.6;
  const SurfaceMesh wide = box({0, 0, 0}, {0.4, 0.4, 0.5});

  EXPECT_TRUE(check_obstacle(wide, "box.obj", mesh, start_m).empty());
  const auto state = [&](const SurfaceMesh& surface, const char* words) {
    const Findings findings = check_obstacle(surface, "box.obj", mesh, start_m);
    if (findings.size() != 1) return FindingState::passed;
    EXPECT_THAT(sentence(findings.front()), testing::HasSubstr(words));
    return findings.front().state;
  };
  EXPECT_EQ(state(turned_round(wide), "inwards"), FindingState::refused);
  EXPECT_EQ(state(box({-1, -1, 0}, {1, 1, 1}), "81 of 81"), FindingState::refused);
  EXPECT_EQ(state(box({0.1, 0.1, 0}, {0.13, 0.12, 0.5}), "30 mm wide"), FindingState::warning);
  SurfaceMesh ceiling;  // seen from above
  ceiling.vertex_m.resize(3, 3);
  ceiling.vertex_m << -5, 5, 0, -5, -5, 9, 0.7, 0.7, 0.7;
  ceiling.triangle.resize(3, 1);
  ceiling.triangle << 0, 1, 2;
  EXPECT_EQ(state(ceiling, "behind"), FindingState::warning);
}

}  // namespace
}  // namespace clothfit
