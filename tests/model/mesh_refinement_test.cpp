// Checks that one fabric on several meshes moves alike. Not checked here: effects one by one. Each
// says in its own file how it survives a change of mesh.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <vector>

#include "model/cloth/stability.h"
#include "model/effects/registry.h"
#include "model/integrate/simulate.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

constexpr int kCoarsest = 9;  // vertices per side, all of them on every mesh

/// Swings a cloth with bending stiffness but without flexion springs, released from 45 degrees and
/// held along its upper edge. Returns where the vertices of the coarsest mesh are 20 times a
/// second. Single held points would be point loads, under which no continuum converges.
std::vector<Eigen::Matrix3Xd> swing(int vertices_per_side, double time_step_s, int frames = 20) {
  Cloth cloth = square_cloth(vertices_per_side);
  for (int j = 0; j < vertices_per_side; ++j)
    cloth.held.push_back({.weights = {{.vertex = j, .weight = 1}}});
  add_effect(cloth, "bending_energy", "test");
  add_effect(cloth, "viscous_damping", "test");
  Fabric fabric = cotton();
  fabric.damping_warp_s = fabric.damping_weft_s = 3e-4;
  fabric.flexion_warp_n_per_m = fabric.flexion_weft_n_per_m = 0;
  const Eigen::Matrix3d tilt =
      Eigen::AngleAxisd(M_PI / 4, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const ParameterSet set{.springs = spring_parameters(fabric, cloth.mesh),
                         .effects = {{1e-4}, {1.0}},
                         .start_position_m = tilt * hung_flat(cloth.mesh)};
  Schedule schedule{.time_step_s = time_step_s};
  for (int frame = 0; frame <= frames; ++frame) schedule.frame_time_s.push_back(0.05 * frame);
  EXPECT_LT(time_step_s, stable_time_step_s(cloth, set));

  std::vector<Eigen::Matrix3Xd> seen;
  const SimulateResult result = simulate(cloth, {&set, 1}, schedule).front();
  for (const Eigen::Matrix3Xd& p : result.position_m) {
    const int stride = (vertices_per_side - 1) / (kCoarsest - 1);
    Eigen::Matrix3Xd common(3, kCoarsest * kCoarsest);
    for (int i = 0; i < kCoarsest; ++i)
      for (int j = 0; j < kCoarsest; ++j)
        common.col(i * kCoarsest + j) = p.col(cloth.mesh.vertex(i * stride, j * stride));
    seen.push_back(common);
  }
  return seen;
}

/// Returns the root mean square distance over vertices and times (m).
double distance_m(const std::vector<Eigen::Matrix3Xd>& a, const std::vector<Eigen::Matrix3Xd>& b) {
  double sum = 0;
  for (size_t n = 0; n < a.size(); ++n)
    sum += (a[n] - b[n]).squaredNorm() / static_cast<double>(a[n].cols());
  return std::sqrt(sum / static_cast<double>(a.size()));
}

TEST(MeshRefinement, AClothWithBendingStiffnessMovesAlikeOnEveryMesh) {
  const double step_s = 1e-4;  // the same on all, so that they differ by the mesh alone
  const auto coarse = swing(9, step_s), middle = swing(17, step_s), fine = swing(33, step_s);

  const double coarse_m = distance_m(coarse, middle), fine_m = distance_m(middle, fine);

  const std::vector<Eigen::Matrix3Xd> start(fine.size(), fine.front());
  EXPECT_GT(distance_m(fine, start), 0.1);  // it did swing
  std::printf("9 to 17: %.3f mm, 17 to 33: %.3f mm\n", 1e3 * coarse_m, 1e3 * fine_m);
  // The order is between the first of the lattice's border springs and the second of its
  // differences.
  EXPECT_GT(coarse_m / fine_m, 2.5);
  EXPECT_LT(fine_m, 2e-3);
}

TEST(MeshRefinement, GoesOnConvergingOnAFineMesh) {
  constexpr double kStep_s = 5e-5;
  constexpr int kFrames = 10;
  const auto middle = swing(17, kStep_s, kFrames), fine = swing(33, kStep_s, kFrames),
             finest = swing(65, kStep_s, kFrames);

  const double middle_m = distance_m(middle, fine), fine_m = distance_m(fine, finest);

  std::printf("17 to 33: %.3f mm, 33 to 65: %.3f mm\n", 1e3 * middle_m, 1e3 * fine_m);
  EXPECT_GT(middle_m / fine_m, 2.5);
}

}  // namespace
}  // namespace clothfit
