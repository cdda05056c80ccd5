// Checks springs counted on positions that are written down. A fit's report of them is in
// fit_test.cpp.
#include "fit/problem/springs_on_limit.h"

#include <gtest/gtest.h>

#include "model/topology/mesh.h"

namespace clothfit {
namespace {

TEST(SpringsOnLimit, AreThoseAsLongAsTheirCriticalElongationAllows) {
  // Given a 3 x 3 cloth whose springs may become a tenth longer, pulled along s by just that
  const Mesh mesh{3, 3, 0.2, 0.2};
  Cloth cloth = Cloth::of(mesh, Eigen::VectorXd::Constant(9, 0.001));
  cloth.strain_limit.mode = StrainLimitMode::positions;
  SpringParameters springs = spring_parameters(
      Fabric{.tension_warp_n_per_m = 1, .tension_weft_n_per_m = 1, .shear_n_per_m = 1}, mesh);
  springs.critical_elongation.fill(0.1);
  const Eigen::Matrix3Xd flat = flat_positions(mesh);
  Eigen::Matrix3Xd pulled = flat, slack = flat;
  pulled.row(0) *= 1.1;
  slack.row(0) *= 1.09;

  // Then of two frames after the start, all weft springs in one of them
  const SpringsOnLimit count = springs_on_limit(cloth, springs, {flat, pulled, slack});
  EXPECT_EQ(count.all[structural_s], 2 * 6);
  EXPECT_EQ(count.on[structural_s], 6);
  EXPECT_EQ(count.on[flexion_s], 3);
  EXPECT_EQ(count.on[structural_t], 0);
  EXPECT_EQ(count.on[shear_up], 0);  // 5 % longer

  cloth.strain_limit.mode = StrainLimitMode::off;
  EXPECT_EQ(springs_on_limit(cloth, springs, {flat, pulled}).on[structural_s], 0);
}

}  // namespace
}  // namespace clothfit
