// Checks which triangle of one mesh a point of another belongs to.

#include "model/topology/correspondence.h"

#include <gtest/gtest.h>

#include "model/topology/cloth_mesh.h"

namespace clothfit {
namespace {

ClothMesh ring_of_cloth(double spacing_m) {
  return mesh_cloth(
      {.border_m = {circle_m(0.1, spacing_m), circle_m(0.03, spacing_m)}, .line_m = {}}, spacing_m);
}

TEST(Correspondence, ByBoxesIsThatByAllTrianglesForEitherRule) {
  const ClothMesh coarse = ring_of_cloth(0.02), fine = ring_of_cloth(0.0071);
  for (const OutsidePoints outside :
       {OutsidePoints::nearest_centre, OutsidePoints::nearest_triangle}) {
    const Correspondence boxes =
        correspond(fine.material_m, coarse.material_m, coarse.triangles(), outside);

    const Correspondence all =
        correspond_by_all(fine.material_m, coarse.material_m, coarse.triangles(), outside);

    EXPECT_EQ(boxes.corner, all.corner);
    EXPECT_EQ(boxes.weight, all.weight);
  }
}

TEST(Correspondence, TransfersFlatShapesExactlyAlsoOutside) {
  const ClothMesh coarse = ring_of_cloth(0.02), fine = ring_of_cloth(0.0071);
  Eigen::Matrix<double, 3, 2> f;
  f << 1, 0.2, 0.1, 0.8, -0.5, 0.3;
  const Correspondence found = correspond(fine.material_m, coarse.material_m, coarse.triangles());
  ASSERT_LT(found.weight.minCoeff(), -1e-3) << "some points lie outside the coarse polygon";

  const Eigen::Matrix3Xd moved = found.transfer(f * coarse.material_m);

  EXPECT_LT((moved - f * fine.material_m).norm(), 1e-12);
}

TEST(Correspondence, ByThePapersRuleMayTakeAFarTriangleWhereOursTakesTheNearest) {
  // A long triangle passes near the point; the centre of a small one is nearer.
  Eigen::Matrix2Xd vertex(2, 6);
  vertex << 0, 10, 10, 0.4, 0.8, 0.6, 0, 0, 1, -1, -1, -0.6;
  Eigen::Matrix3Xi triangle(3, 2);
  triangle << 0, 3, 1, 4, 2, 5;
  Eigen::Matrix2Xd point(2, 1);
  point << 0.6, -0.05;

  EXPECT_EQ(correspond(point, vertex, triangle).corner(0, 0), 0);
  EXPECT_EQ(correspond(point, vertex, triangle, OutsidePoints::nearest_centre).corner(0, 0), 3);
}

}  // namespace
}  // namespace clothfit
