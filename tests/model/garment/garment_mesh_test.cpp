// Checks patterns, and that their meshes keep lengths, areas, seams and correspondences.

#include "model/garment/garment_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "data/input_error.h"
#include "model/garment/pattern_outline.h"
#include "tests/model/garment/patterns.h"

namespace clothfit {
namespace {

/// A panel with a curved edge of each kind: an arc, a quadratic and a cubic curve.
Panel curved() {
  Panel panel = rectangle(0.3, 0.4, 0);
  panel.edges[0].bulge = 0.3;
  panel.edges[1].control_m = {{0.25, 0.2}};
  panel.edges[3].control_m = {{-0.2, 0.3}, {-0.1, 0.1}};
  return panel;
}

TEST(PatternOutline, MeasuresCurvesByTheirClosedForms) {
  Panel panel = rectangle(0.2, 0.4, 0);
  panel.edges[0].bulge = 1;  // half a circle below
  EXPECT_NEAR(edge_length_m(panel, 0), 0.1 * std::numbers::pi, 1e-5);
  const Eigen::Matrix2Xd lowest = points_of_edge_m(panel, 0, {0.5});
  EXPECT_NEAR((lowest.col(0) - Eigen::Vector2d(0, -0.1)).norm(), 0, 1e-5);

  panel.edges[0].bulge = std::tan(3 * std::numbers::pi / 8);  // three quarters of a circle
  EXPECT_NEAR(edge_length_m(panel, 0), 1.5 * std::numbers::pi * 0.1 * std::sqrt(2.0), 1e-4);

  panel.edges[1].control_m = {{0.3, 0.2}};  // a parabola of chord 0.4 and height 0.1
  const double a = 1.0;                     // 4 height / chord
  EXPECT_NEAR(edge_length_m(panel, 1), 0.2 * (std::sqrt(1 + a * a) + std::asinh(a) / a), 1e-5);
}

TEST(PatternOutline, KeepsCornersOfTheFlattestArcs) {
  Panel panel = rectangle(0.3, 0.4, 0);
  for (const double bulge : {1e-8, 1e-13, 1e-16, 1e-17}) {
    panel.edges[0].bulge = bulge;
    const Eigen::Matrix2Xd points = points_of_edge_m(panel, 0, {0, 0.5, 1});
    EXPECT_LT((points.col(0) - panel.corner_m.col(0)).norm(), 1e-15);
    EXPECT_LT((points.col(1) - Eigen::Vector2d(0, -0.15 * bulge)).norm(), 1e-15);
  }
}

TEST(PatternOutline, SpacesPointsEvenlyAlongACurve) {
  const Panel panel = curved();
  const Eigen::Matrix2Xd points = points_of_edge_m(panel, 3, {0, 0.25, 0.5, 0.75, 1});
  const double length_m = edge_length_m(panel, 3);
  for (int k = 0; k < 4; ++k) {
    const double chord_m = (points.col(k + 1) - points.col(k)).norm();
    EXPECT_LT(chord_m, 0.25 * length_m * (1 + 1e-9));
    EXPECT_GT(chord_m, 0.24 * length_m);
  }
  EXPECT_EQ(points.col(4), panel.corner_m.col(0));
}

TEST(PatternOutline, RefusesWhatCannotBeCutOrSewn) {
  const auto expect_refused = [](const Pattern& pattern, const std::string& words) {
    try {
      check_pattern(pattern);
      ADD_FAILURE() << "not refused: " << words;
    } catch (const InputError& error) {
      EXPECT_NE(error.problem().find(words), std::string::npos) << error.what();
    }
  };
  EXPECT_NO_THROW(check_pattern(tube(0.3, 0.4, 0.2)));
  Pattern bad = tube(0.3, 0.4, 0.2);
  bad.panels[0].corner_m.row(0) *= -1;
  expect_refused(bad, "panel front: its outline runs clockwise");
  bad = tube(0.3, 0.4, 0.2);
  bad.panels[1].corner_m.col(2).swap(bad.panels[1].corner_m.col(3));
  expect_refused(bad, "panel back: its outline crosses itself");
  bad = tube(0.3, 0.4, 0.2);
  bad.panels[0].corner_m.col(1) = bad.panels[0].corner_m.col(0);
  expect_refused(bad, "panel front: edge 0 is 0 mm long");
  bad = tube(0.3, 0.4, 0.2);
  bad.seams[0].sides[1] = bad.seams[0].sides[0];
  expect_refused(bad, "edge 1 of panel front is sewn to itself");
  bad = tube(0.3, 0.4, 0.2);
  bad.seams.push_back(bad.seams[0]);
  expect_refused(bad, "edge 1 of panel front belongs to an earlier seam");
  bad = tube(0.3, 0.4, 0.2);
  bad.panels[1].corner_m(1, 2) = 0.45;
  expect_refused(bad, "the seam's sides are 400.0 mm and 450.0 mm long, 12.5 % apart");
  for (Seam& of : bad.seams) of.easing = 0.2;
  EXPECT_NO_THROW(check_pattern(bad)) << "a gather that is meant";
  bad = tube(0.3, 0.4, 0.2);
  bad.seams[0].sides[0].edges = {4};
  expect_refused(bad, "a seam of edge 4 of panel front");
}

TEST(GarmentMesh, KeepsAreaLengthAndGrain) {
  Pattern pattern = pattern_of({curved()});
  pattern.panels[0].grain_rad = 0.5;
  const GarmentMesh mesh = mesh_garment(pattern, 0.01);

  // The area between the curves and the rectangle's sides, by Green's theorem on a fine polygon.
  double twice_m2 = 0;
  Eigen::Vector2d last = pattern.panels[0].corner_m.col(0);
  for (int edge = 0; edge < 4; ++edge)
    for (int k = 1; k <= 1000; ++k) {
      const Eigen::Vector2d next = points_of_edge_m(pattern.panels[0], edge, {k / 1000.0}).col(0);
      twice_m2 += last.x() * next.y() - last.y() * next.x();
      last = next;
    }
  EXPECT_NEAR(mesh.cloth.total_area_m2() / (0.5 * twice_m2), 1, 2e-3) << "chords of 10 mm";

  // Placing is a motion: distances between vertices are those of the flat cloth.
  const auto vertices = mesh.cloth.vertex_count();
  for (int v = 1; v < vertices; v += 7)
    EXPECT_NEAR((mesh.placed_m.col(v) - mesh.placed_m.col(0)).norm(),
                (mesh.cloth.material_m.col(v) - mesh.cloth.material_m.col(0)).norm(), 1e-12);
  // The panel's y axis stands up; the warp (t) lies half a radian to its left.
  const Eigen::Vector3d top =
      mesh.placed_m.col(0) + Eigen::Vector3d(-std::sin(0.5), 0, std::cos(0.5));
  const Eigen::Vector2d along_warp = mesh.cloth.material_m.col(0) + Eigen::Vector2d(0, 1);
  for (int v = 1; v < vertices; v += 7)
    EXPECT_NEAR((mesh.placed_m.col(v) - top).norm(),
                (mesh.cloth.material_m.col(v) - along_warp).norm(), 1e-12);
}

TEST(GarmentMesh, SewsSidesOfDifferentLengthPointByPoint) {
  Pattern pattern = tube(0.3, 0.4, 0.2);
  pattern.panels[1].corner_m.row(1) *= 1.5;  // gathered
  for (Seam& of : pattern.seams) of.easing = 0.6;
  for (const double spacing_m : {0.05, 0.02, 0.007}) {
    const GarmentMesh mesh = mesh_garment(pattern, spacing_m);
    int joined = 0;
    for (const auto& seam : mesh.seams) {
      EXPECT_EQ(seam.size(), static_cast<size_t>(std::ceil(0.6 / spacing_m - 1e-6)) + 1);
      joined += static_cast<int>(seam.size());
      for (size_t k = 0; k < seam.size(); ++k) {
        // Shares of both lengths are the same, from the same end.
        const double up = mesh.placed_m(2, seam[k][0]), other_up = mesh.placed_m(2, seam[k][1]);
        EXPECT_NEAR(1.5 * up, other_up, 1e-12);
        EXPECT_NEAR(mesh.placed_m(0, seam[k][0]), mesh.placed_m(0, seam[k][1]), 1e-12);
      }
    }
    EXPECT_EQ(mesh.particles, mesh.cloth.vertex_count() - joined);
  }
}

TEST(GarmentMesh, MeetsAtTheCornersOfBothSides) {
  // The right side of one panel is one edge; that of the other has a corner at a third.
  Pattern pattern = tube(0.3, 0.3, 0.2);
  Panel& back = pattern.panels[1];
  back.corner_m.resize(2, 5);
  back.corner_m << -0.15, 0.15, 0.15, -0.15, -0.15,  //
      0, 0, 0.3, 0.3, 0.1;
  back.edges.resize(5);
  pattern.seams[0].sides = {SeamSide{0, {1}}, SeamSide{1, {3, 4}}};
  ASSERT_NO_THROW(check_pattern(pattern));
  const GarmentMesh mesh = mesh_garment(pattern, 0.04);
  bool met = false;
  for (const auto& [a, b] : mesh.seams[0])
    met = met || (std::abs(mesh.placed_m(2, b) - 0.1) < 1e-12 &&
                  std::abs(mesh.placed_m(2, a) - 0.1) < 1e-12);
  EXPECT_TRUE(met);
}

TEST(GarmentMesh, PairsCornersInOrderWhereSeveralAreNear) {
  // Corners of one side at 0.500 and 0.515 of its way, of the other at 0.520 alone.
  Pattern pattern = tube(0.3, 0.5, 0.2);
  Panel &front = pattern.panels[0], &back = pattern.panels[1];
  front.corner_m.resize(2, 6);
  front.corner_m << -0.15, 0.15, 0.15, 0.15, 0.15, -0.15,  //
      0, 0, 0.25, 0.2575, 0.5, 0.5;
  front.edges.resize(6);
  back.corner_m.resize(2, 5);
  back.corner_m << -0.15, 0.15, 0.15, -0.15, -0.15,  //
      0, 0, 0.5, 0.5, 0.26;
  back.edges.resize(5);
  pattern.seams.resize(1);
  pattern.seams[0].sides = {SeamSide{0, {1, 2, 3}}, SeamSide{1, {3, 4}}};
  ASSERT_NO_THROW(check_pattern(pattern));
  const GarmentMesh mesh = mesh_garment(pattern, 0.04);
  double met = 0;
  for (size_t k = 0; k + 1 < mesh.seams[0].size(); ++k) {
    const auto [a, b] = mesh.seams[0][k];
    const auto [next_a, next_b] = mesh.seams[0][k + 1];
    EXPECT_GT(mesh.placed_m(2, next_a), mesh.placed_m(2, a));
    EXPECT_GT(mesh.placed_m(2, next_b), mesh.placed_m(2, b));
    if (std::abs(mesh.placed_m(2, b) - 0.26) < 1e-9) met = mesh.placed_m(2, a);
  }
  EXPECT_NEAR(met, 0.2575, 1e-9) << "the nearer of both";
  double length_m = 0;
  for (const double of : mesh.seam_length_m[0]) length_m += of;
  EXPECT_NEAR(length_m, 0.5, 1e-12);
}

TEST(GarmentMesh, ClosesADartThatPartsASide) {
  // The upper edge of a panel has a dart in its middle and is sewn to one without.
  Panel panel = rectangle(0.3, 0.3, 0);
  panel.corner_m.resize(2, 7);
  panel.corner_m << -0.15, 0.15, 0.15, 0.02, 0, -0.02, -0.15,  //
      0, 0, 0.3, 0.3, 0.2, 0.3, 0.3;
  panel.edges.resize(7);
  Panel band = rectangle(0.26, 0.05, 0);
  Pattern pattern = pattern_of({panel, band});
  Seam waist;
  waist.sides = {SeamSide{0, {2, 5}}, SeamSide{1, {0}}};
  pattern.seams = {waist, seam(0, 3, 0, 4)};
  ASSERT_NO_THROW(check_pattern(pattern));
  const GarmentMesh mesh = mesh_garment(pattern, 0.02);
  // Both of the dart's corners and the band's middle are one particle; its tip is one vertex.
  std::set<int> middle;
  for (int v = 0; v < mesh.cloth.vertex_count(); ++v) {
    const bool of_dart = mesh.panel_of[static_cast<size_t>(v)] == 0 &&
                         std::abs(mesh.placed_m(2, v) - 0.3) < 1e-9 &&
                         std::abs(std::abs(mesh.placed_m(0, v)) - 0.02) < 1e-9;
    const bool of_band = mesh.panel_of[static_cast<size_t>(v)] == 1 &&
                         std::abs(mesh.placed_m(2, v)) < 1e-9 &&
                         std::abs(mesh.placed_m(0, v)) < 1e-9;
    if (of_dart || of_band) middle.insert(mesh.particle_of[static_cast<size_t>(v)]);
  }
  EXPECT_EQ(middle.size(), 1U);
}

TEST(GarmentMesh, CarriesALinearFieldFromMeshToMesh) {
  Pattern pattern = tube(0.3, 0.4, 0.2);
  pattern.panels[0] = curved();
  pattern.panels[0].name = "front";
  pattern.seams.clear();
  pattern.panels[1].grain_rad = 0.3;
  const GarmentMesh coarse = mesh_garment(pattern, 0.04), fine = mesh_garment(pattern, 0.015);
  EXPECT_LT((correspond(fine, coarse).transfer(coarse.placed_m) - fine.placed_m)
                .colwise()
                .norm()
                .maxCoeff(),
            1e-9);
}

}  // namespace
}  // namespace clothfit
