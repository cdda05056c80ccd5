// Checks meshes of flat cloth of any outline. Not checked here: the triangles themselves
// (delaunay_test.cpp).

#include "model/topology/cloth_mesh.h"

#include <gtest/gtest.h>

#include <map>
#include <numbers>

#include "data/input_error.h"

namespace clothfit {
namespace {

Eigen::Matrix2Xd rectangle(double s0, double t0, double s1, double t1) {
  Eigen::Matrix2Xd corners(2, 4);
  corners << s0, s1, s1, s0, t0, t0, t1, t1;
  return corners;
}

int squares(const ClothMesh& mesh) {
  int count = 0;
  for (const ClothCell& cell : mesh.cells) count += cell.corners == 4;
  return count;
}

double area_of_cells(const ClothMesh& mesh) {
  double sum = 0;
  for (const ClothCell& cell : mesh.cells) sum += cell.area_m2;
  return sum;
}

/// Expects the cells to fill the cloth: every edge once each way but for those of the border.
void expect_closed(const ClothMesh& mesh) {
  std::map<std::array<int, 2>, int> edges;
  for (const ClothCell& cell : mesh.cells)
    for (int k = 0; k < cell.corners; ++k)
      ++edges[{cell.vertex[static_cast<size_t>(k)],
               cell.vertex[static_cast<size_t>((k + 1) % cell.corners)]}];
  size_t open = 0;
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    open += edges.count({edge[1], edge[0]}) == 0;
  }
  size_t border = 0;
  for (const std::vector<int>& loop : mesh.border) border += loop.size();
  EXPECT_EQ(open, border);
}

TEST(ClothMesh, OfARectangleOfWholeSquaresHasSquaresOnly) {
  const ClothMesh mesh =
      mesh_cloth({.border_m = {sampled_m(rectangle(0, 0, 0.3, 0.2), 0.02)}, .line_m = {}}, 0.02);

  EXPECT_EQ(squares(mesh), 15 * 10);
  EXPECT_EQ(mesh.cells.size(), 150);
  EXPECT_EQ(mesh.vertex_count(), 16 * 11);
  EXPECT_NEAR(mesh.area_m2.minCoeff(), 0.25 * 0.02 * 0.02, 1e-15) << "a corner";
  EXPECT_NEAR(mesh.total_area_m2(), 0.06, 1e-15);
  expect_closed(mesh);
}

TEST(ClothMesh, OfADiscWithAHoleKeepsBothCirclesAndFillsWhatIsBetween) {
  const Eigen::Matrix2Xd outer = circle_m(0.15, 0.01), inner = circle_m(0.06, 0.01);

  const ClothMesh mesh = mesh_cloth({.border_m = {outer, inner}, .line_m = {}}, 0.01);

  ASSERT_EQ(mesh.border.size(), 2);
  EXPECT_EQ(mesh.border[0].size(), outer.cols());
  EXPECT_EQ(mesh.border[1].size(), inner.cols());
  const auto polygon = [](double radius, double corners) {
    return 0.5 * corners * radius * radius * std::sin(2 * std::numbers::pi / corners);
  };
  EXPECT_NEAR(area_of_cells(mesh),
              polygon(0.15, static_cast<double>(outer.cols())) -
                  polygon(0.06, static_cast<double>(inner.cols())),
              1e-12);
  EXPECT_NEAR(mesh.total_area_m2(), area_of_cells(mesh), 1e-12);
  EXPECT_GT(squares(mesh), mesh.vertex_count() / 2) << "most of it is lattice";
  expect_closed(mesh);
}

TEST(ClothMesh, OfALineInsideHasItsPointsAndEdges) {
  Eigen::Matrix2Xd line(2, 3);
  line << 0.03, 0.051, 0.08, 0.03, 0.041, 0.055;

  const ClothMesh mesh = mesh_cloth(
      {.border_m = {sampled_m(rectangle(0, 0, 0.1, 0.1), 0.025)}, .line_m = {line}}, 0.025);

  ASSERT_EQ(mesh.line.size(), 1);
  for (size_t k = 0; k < 3; ++k)
    EXPECT_EQ(mesh.material_m.col(mesh.line[0][k]), line.col(static_cast<Eigen::Index>(k)));
  EXPECT_NEAR(mesh.total_area_m2(), 0.01, 1e-15);
  expect_closed(mesh);
}

TEST(ClothMesh, KnowsTheDeformationOfItsCellsExactlyWhereItIsUniform) {
  const ClothMesh mesh = mesh_cloth({.border_m = {circle_m(0.1, 0.013)}, .line_m = {}}, 0.013);
  Eigen::Matrix<double, 3, 2> f;
  f << 1.1, 0.2, -0.3, 0.9, 0.4, 0.1;
  const Eigen::Matrix3Xd position = f * mesh.material_m;

  for (const ClothCell& cell : mesh.cells) {
    Eigen::Matrix<double, 3, 2> found = Eigen::Matrix<double, 3, 2>::Zero();
    for (int k = 0; k < cell.corners; ++k)
      found += position.col(cell.vertex[static_cast<size_t>(k)]) *
               cell.gradient_per_m.col(k).transpose();
    EXPECT_LT((found - f).norm(), 1e-12);
  }
}

TEST(ClothMesh, TurnsBordersThatRunTheWrongWayRound) {
  const Eigen::Matrix2Xd outer = circle_m(0.1, 0.02), inner = circle_m(0.04, 0.02);

  const ClothMesh mesh = mesh_cloth(
      {.border_m = {outer.rowwise().reverse(), inner.rowwise().reverse()}, .line_m = {}}, 0.02);

  EXPECT_NEAR(mesh.total_area_m2(),
              mesh_cloth({.border_m = {outer, inner}, .line_m = {}}, 0.02).total_area_m2(), 1e-15);
}

TEST(ClothMesh, RefusesOutlinesThatEncloseNothingOrCrossThemselves) {
  const auto mesh = [](const Eigen::Matrix2Xd& border, double spacing_m) {
    return mesh_cloth({.border_m = {border}, .line_m = {}}, spacing_m);
  };
  Eigen::Matrix2Xd bow(2, 4);  // a figure of eight, its two halves of different size
  bow << 0, 0.1, 0, 0.12, 0, 0.1, 0.1, 0;
  EXPECT_THROW(mesh(bow, 0.02), InputError);
  EXPECT_THROW(mesh(rectangle(0, 0, 0.1, 0), 0.02), InputError);
  EXPECT_THROW(mesh(rectangle(0, 0, 0.1, 0.1).leftCols(2), 0.02), InputError);
  EXPECT_THROW(mesh(rectangle(0, 0, 0.1, 0.1), 0), InputError);
  EXPECT_THROW(mesh_cloth({}, 0.02), InputError);
}

}  // namespace
}  // namespace clothfit
