// The fit again on another mesh. What its difference is worth on folding cloth is not checked.
#include "fit/refine/other_mesh.h"

#include <gtest/gtest.h>

#include "fit/problem/mesh_ladder.h"
#include "fit/uncertainty/uncertainty.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {
namespace {

TEST(OtherMesh, HasHalfTheCellsWhereEnoughVerticesAreLeft) {
  EXPECT_EQ(other_mesh_of(17, 13, 7), std::pair(9, 7));
  EXPECT_EQ(other_mesh_of(11, 11, 7), std::pair(21, 21));
  EXPECT_EQ(other_mesh_of(2, 5, 7), std::pair(3, 9));
  // Both ways alike: half the cells would leave too few along the rows.
  EXPECT_EQ(other_mesh_of(17, 9, 7), std::pair(33, 17));
}

TEST(OtherMesh, ShowsWhatACoarseMeshDoesToTheParameters) {
  // Given a cloth of 9 x 9 vertices, fitted with 5 x 5
  const FitInput input = synthetic_input(
      {.mesh = 9, .markers = 5, .frames = 20, .held_out_from = 20, .noise_m = 5e-4, .seed = 12});
  const FitProblem coarse = make_problem(input, {}, 5, 5), fine = make_problem(input, {}, 9, 9);
  const RefineResult here = refine(coarse, 20, coarse.space.start(), {}, {});
  ASSERT_TRUE(here.usable) << here.message;

  const OtherMesh other = fit_on_other_mesh(fine, here.values, {}, {});

  // Then its shift leads from many sigmas off to the truth
  ASSERT_TRUE(other.usable) << other.message;
  EXPECT_EQ(other.columns, 9);
  const Eigen::VectorXd there = here.values + other.shift;
  const RefineResult again = refine(fine, 20, there, {}, {});
  const Uncertainty uncertainty =
      estimate_uncertainty(TrajectoryObjective(fine, 20, again.time_step_s), again.values);
  ASSERT_TRUE(uncertainty.usable);
  const int shear = fine.space.index("shear");
  const double truth = SyntheticCloth{}.fabric.shear_n_per_m;
  EXPECT_GT(std::abs(here.values[shear] - truth), 8 * uncertainty.sigma[shear]);
  EXPECT_LT(std::abs(there[shear] - truth), 4 * uncertainty.sigma[shear]);
}

}  // namespace
}  // namespace clothfit
