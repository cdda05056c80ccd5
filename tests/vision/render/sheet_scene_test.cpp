// Checks lines of sight onto sheets: which place, which side, which normal, which sheet is in
// front. Pictures are in render_cloth_test.cpp, markers in true_markers_test.cpp.

#include "vision/render/sheet_scene.h"

#include <gtest/gtest.h>
#include <xmmintrin.h>

#include <cfenv>
#include <cmath>
#include <limits>
#include <random>

#include "tests/vision/tag_sheet.h"

namespace clothfit {
namespace {

const MarkerSet kBlank;

TEST(SheetScene, FindsThePlaceThatALineOfSightWasAimedAt) {
  // A waving sheet lies far from the world's origin and is turned. Embree's work in single
  // precision is about the camera's centre, and the place is computed in double.
  const std::uint64_t seed = 1;
  SCOPED_TRACE(seed);
  const SheetPrint print(kBlank, 0.4, 0.5);
  const Eigen::Vector3d far_m(1000, -2000, 500);
  const PlacedSheet sheet = place_sheet(print, 41, [&](double s, double t) {
    return Eigen::Vector3d(far_m + Eigen::Vector3d(s - 0.2, 0.03 * std::sin(20 * s + 9 * t), -t));
  });
  Rigid3 camera_from_world{Eigen::Quaterniond(0.7, 0.71, 0.05, 0.02).normalized(), {}};
  camera_from_world.translation_m =
      Eigen::Vector3d(0.02, 0.3, 1.2) - camera_from_world.rotation * far_m;
  const SheetScene scene({&sheet, 1}, camera_from_world);
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> unit(0, 1);

  int seen = 0;
  for (int k = 0; k < 500; ++k) {
    const double s_m = 0.4 * unit(rng), t_m = 0.5 * unit(rng);
    const SheetPoint aim = scene.point(0, s_m, t_m);
    const Eigen::Vector2d direction = aim.point_m.hnormalized();
    SheetHit hit;
    scene.look({&direction, 1}, {&hit, 1});

    ASSERT_EQ(hit.sheet, 0);
    if (scene.is_hidden(aim.point_m)) continue;
    ++seen;
    // World coordinates of a kilometre leave 1e-12 m, seen askew by up to 80 degrees.
    EXPECT_NEAR(hit.place_m.x(), s_m, 1e-10);
    EXPECT_NEAR(hit.place_m.y(), t_m, 1e-10);
    EXPECT_EQ(hit.printed_side, aim.outward.dot(aim.point_m) < 0);
    EXPECT_LT(hit.normal.dot(aim.point_m), 0.1) << "of the side that is seen";
  }
  EXPECT_GT(seen, 400);
}

TEST(SheetScene, KnowsHowThePlaceMovesWithTheLineOfSight) {
  const SheetPrint print(kBlank, 0.4, 0.6);
  const PlacedSheet sheet = place_sheet(print, 2, [](double s, double t) {
    return Eigen::Vector3d(s - 0.2, t - 0.3 + 0.2 * s, 1 + 0.5 * s - 0.3 * t);  // a plane
  });
  const SheetScene scene({&sheet, 1}, {});
  constexpr double kStep = 1e-4;

  for (const Eigen::Vector2d& at : {Eigen::Vector2d(-0.1, -0.1), Eigen::Vector2d(0.08, 0.17)}) {
    const std::vector<Eigen::Vector2d> direction = {
        at, at + Eigen::Vector2d(kStep, 0), at - Eigen::Vector2d(kStep, 0),
        at + Eigen::Vector2d(0, kStep), at - Eigen::Vector2d(0, kStep)};
    std::vector<SheetHit> hit(5);
    scene.look(direction, hit);
    Eigen::Matrix2d difference;
    difference << hit[1].place_m - hit[2].place_m, hit[3].place_m - hit[4].place_m;
    difference /= 2 * kStep;
    EXPECT_LT((hit[0].place_by_direction - difference).norm(), 1e-6) << "in either triangle";
  }
}

TEST(SheetScene, TurnsNormalsSmoothlyAroundACylinder) {
  // Around a cylinder of radius r the normal is that of its circle. The mesh's error is of second
  // order in its spacing, (0.4 / 40 / r)^2 / 6 = 7e-4 rad between the ends.
  const double r = 0.15;
  const SheetPrint print(kBlank, 0.2, 0.2);
  const PlacedSheet sheet = place_sheet(print, 21, [&](double s, double t) {
    const double angle = (s - 0.1) / r;
    return Eigen::Vector3d(r * std::sin(angle), t - 0.1, 1 - r * std::cos(angle));
  });
  const SheetScene scene({&sheet, 1}, {});

  for (double s_m = 0.013; s_m < 0.19; s_m += 0.007) {
    const double angle = (s_m - 0.1) / r;
    const Eigen::Vector2d direction = scene.point(0, s_m, 0.083).point_m.hnormalized();
    SheetHit hit;
    scene.look({&direction, 1}, {&hit, 1});
    EXPECT_TRUE(hit.printed_side);
    EXPECT_LT((hit.normal - Eigen::Vector3d(std::sin(angle), 0, -std::cos(angle))).norm(), 2e-3);
  }
}

TEST(SheetScene, SeesTheNearerSheetAndNothingBesideThem) {
  const SheetPrint large(kBlank, 1, 1), small(kBlank, 0.2, 0.2);
  const std::vector<PlacedSheet> sheets = {
      place_sheet(large, 2, [](double s, double t) { return Eigen::Vector3d(s - .5, t - .5, 2); }),
      place_sheet(small, 3, [](double s, double t) { return Eigen::Vector3d(.1 - s, t - .1, 1); })};
  const SheetScene scene(sheets, {});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Eigen::Vector2d> direction = {{0.05, 0}, {0.2, 0}, {0.3, 0}, {nan, nan}};
  std::vector<SheetHit> hit(4);

  scene.look(direction, hit);

  EXPECT_EQ(hit[0].sheet, 1);
  EXPECT_FALSE(hit[0].printed_side) << "its s runs to the left";
  EXPECT_NEAR(hit[0].place_m.x(), 0.05, 1e-12);
  EXPECT_EQ(hit[1].sheet, 0);
  EXPECT_TRUE(hit[1].printed_side);
  EXPECT_NEAR(hit[1].place_m.x(), 0.9, 1e-12);
  EXPECT_EQ(hit[2].sheet, -1);
  EXPECT_EQ(hit[3].sheet, -1);
  EXPECT_TRUE(scene.is_hidden({0.1, 0, 2}));
  EXPECT_FALSE(scene.is_hidden({0.4, 0, 2}));
}

TEST(SheetScene, LeavesTheCallersArithmeticAlone) {
  constexpr unsigned kSettings = 0xffc0;  // bits of MXCSR: all but the sticky flags
  const unsigned before = _mm_getcsr() & kSettings;
  const SheetPrint print(kBlank, 1, 1);
  const PlacedSheet sheet = place_sheet(
      print, 200, [](double s, double t) { return Eigen::Vector3d(s - 0.5, t - 0.5, 1); });

  const SheetScene scene({&sheet, 1}, {});
  const Eigen::Vector2d direction(0.1, 0.1);
  SheetHit hit;
  scene.look({&direction, 1}, {&hit, 1});

  EXPECT_EQ(hit.sheet, 0);
  EXPECT_EQ(_mm_getcsr() & kSettings, before);
  EXPECT_EQ(std::fegetround(), FE_TONEAREST);
}

}  // namespace
}  // namespace clothfit
