// Checks contact with an obstacle of triangles. Not checked here: the search for the nearest part
// (obstacle_test.cpp), friction and damping (contact_plane_test.cpp).

#include <gtest/gtest.h>

#include "model/cloth/stability.h"
#include "tests/model/ball_mesh.h"
#include "tests/model/cloth_with_effect.h"

namespace clothfit {
namespace {

const std::vector<double> kContact = {3000, 4, 0.3};

std::vector<double> with(std::vector<double> parameters, const std::vector<double>& more) {
  parameters.insert(parameters.end(), more.begin(), more.end());
  return parameters;
}

Cloth above(const Cloth& bare, const TriangleMesh& mesh) {
  Cloth cloth = bare;
  cloth.obstacle = std::make_shared<const Obstacle>(mesh);
  return cloth;
}

/// Returns a square of 2 m in the plane through `point` normal to `turn`'s third column.
TriangleMesh square(const Eigen::Matrix3d& turn, const Eigen::Vector3d& point) {
  TriangleMesh mesh{Eigen::Matrix3Xd(3, 4), Eigen::Matrix3Xi(3, 2)};
  mesh.vertex_m << -1, 1, 1, -1, -1, -1, 1, 1, 0, 0, 0, 0;
  mesh.vertex_m = (turn * mesh.vertex_m).colwise() + point;
  mesh.triangle << 0, 0, 1, 2, 2, 3;
  return mesh;
}

TEST(ContactMesh, KeepsTheContractOfEffects) {
  expect_effect_contract("contact_mesh", {});
}

TEST(ContactMesh, OfAFlatMeshIsContactWithAPlane) {
  Uniform uniform(1);
  const Eigen::Matrix3d lean =
      Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 0).normalized()).toRotationMatrix();
  const Eigen::Vector3d n = lean.col(2), point = lean * Eigen::Vector3d(0.2, 0.2, -0.01);
  const Cloth bare = square_cloth(6);
  const Eigen::Matrix3Xd start = lean * crumpled(bare.mesh, 0.1, uniform);
  const ClothWithEffect on_mesh(above(bare, square(lean, point)), "contact_mesh", kContact, start);
  const ClothWithEffect on_plane(bare, "contact_plane",
                                 with(kContact, {n.x(), n.y(), n.z(), n.dot(point)}), start);

  const auto expected = on_plane.after(800, 2e-4), seen = on_mesh.after(800, 2e-4);

  // The sheet met the plane, and both went the same way.
  EXPECT_GT((n.transpose() * (expected.position_m.colwise() - point)).minCoeff(), -5e-3);
  EXPECT_LT((n.transpose() * (expected.position_m.colwise() - point)).minCoeff(), 0);
  EXPECT_LT((seen.position_m - expected.position_m).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(ContactMesh, OfAFinelyCutBallComesToContactWithABall) {
  const Eigen::Vector3d centre(0.17, 0.22, -0.145);
  const double radius = 0.15;
  Uniform uniform(2);
  const Cloth bare = square_cloth(9);
  const Eigen::Matrix3Xd p = crumpled(bare.mesh, 0.05, uniform), v = uniform.vectors(81, 0.5);
  const Eigen::Matrix3Xd ball =
      ClothWithEffect(bare, "contact_sphere",
                      with(kContact, {centre.x(), centre.y(), centre.z(), radius}), p)
          .force_n(p, v);

  double before = INFINITY;
  for (const int times : {3, 4, 5}) {
    SCOPED_TRACE(times);
    TriangleMesh mesh = ball_mesh(times);
    mesh.vertex_m = (radius * mesh.vertex_m).colwise() + centre;

    const Eigen::Matrix3Xd cut =
        ClothWithEffect(above(bare, mesh), "contact_mesh", kContact, p).force_n(p, v);

    // Halving the triangles' sides takes the surface four times as close, its normals twice.
    const double difference = (cut - ball).norm() / ball.norm();
    EXPECT_LT(difference, 0.6 * before);
    before = difference;
  }
  // Sides of 7 mm lie within 0.05 mm of the ball, at some 3 mm of depth, and lean by up to 3 %.
  EXPECT_LT(before, 0.05);
}

TEST(ContactMesh, TurnsWithTheSceneWhenTheObstacleTurnsToo) {
  Uniform uniform(3);
  const Eigen::Matrix3d turn = uniform.rotation();
  const Cloth bare = square_cloth(6);
  const Eigen::Matrix3Xd p = crumpled(bare.mesh, 0.2, uniform), v = uniform.vectors(36, 1);
  const TriangleMesh ground = hilly_ground();
  TriangleMesh turned = ground;
  turned.vertex_m = turn * ground.vertex_m;

  const Eigen::Matrix3Xd force =
      ClothWithEffect(above(bare, ground), "contact_mesh", kContact, p).force_n(p, v);

  EXPECT_GT(force.norm(), 0);
  EXPECT_LT((ClothWithEffect(above(bare, turned), "contact_mesh", kContact, p)
                 .force_n(turn * p, turn * v) -
             turn * force)
                .norm(),
            1e-12 * force.norm());
}

TEST(ContactMesh, ASheetComesToRestOnHillsAndIsCarried) {
  const Cloth bare = square_cloth(9);
  Eigen::Matrix3Xd start = flat_positions(bare.mesh);
  start.row(2).setConstant(0.03);
  const ClothWithEffect sheet(above(bare, hilly_ground()), "contact_mesh", {3000, 20, 0.5}, start);

  const auto rest = sheet.after(3000, 0.8 * stable_time_step_s(sheet.cloth, sheet.set));

  // Some creeping remains, and accelerations of a percent of gravity with it.
  EXPECT_NEAR(sheet.force_n(rest.position_m, rest.velocity_m_per_s).row(2).sum(), 0.025 * 9.81,
              0.01 * 0.025 * 9.81);
}

}  // namespace
}  // namespace clothfit
