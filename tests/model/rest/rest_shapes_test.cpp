// Checks shapes at rest of many parameter sets, as a fit needs them. Not checked here: single
// equilibria (equilibrium_test.cpp).

#include "model/rest/rest_shapes.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "model/cloth/stability.h"
#include "model/integrate/relax.h"
#include "model/integrate/simulate.h"
#include "model/rest/equilibrium.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

Cloth cloth_hung_by(int vertices_per_side, int corners) {
  Cloth cloth = square_cloth(vertices_per_side);
  cloth.held = {held_at(cloth.mesh, 0, 0)};
  if (corners == 2) cloth.held.push_back(held_at(cloth.mesh, 0.4, 0));
  return cloth;
}

/// Returns cotton whose springs of one type are stiffer by a share.
ParameterSet cotton_set(const Cloth& cloth, size_t type, double stiffer) {
  ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh),
                   .start_position_m = hung_flat(cloth.mesh)};
  set.springs.stiffness_n_per_m[type] *= 1 + stiffer;
  // The start is not quite flat: symmetry would keep it flat.
  for (Eigen::Index v = 0; v < set.start_position_m.cols(); ++v)
    set.start_position_m(1, v) =
        0.01 * std::sin(11 * set.start_position_m(0, v) + 5 * set.start_position_m(2, v));
  return set;
}

TEST(RestShapes, AreBalanced) {
  for (const int corners : {1, 2}) {
    const Cloth cloth = cloth_hung_by(8, corners);
    const ParameterSet set = cotton_set(cloth, 0, 0);
    const Eigen::Matrix3Xd shape = rest_shapes(cloth, {&set, 1}, 0).front();

    HangingEnergy energy(HangingCloth::of(cloth, set));
    MeshField gradient(energy.layout());
    energy.energy_and_gradient(MeshField::of(energy.layout(), shape), gradient);
    HeldProjection(cloth.mesh, cloth.held).project(gradient);

    // Turning about the vertical leaves the balance as it is, to rounding.
    EXPECT_LT(norm(gradient), 1.1e-9 * energy.cloth().weight_n()) << corners << " corners";
    EXPECT_LT(shape.row(2).minCoeff(), -0.3);
  }
}

TEST(RestShapes, AreWhereRelaxationEnds) {
  const Cloth cloth = cloth_hung_by(9, 2);
  ParameterSet set = cotton_set(cloth, 0, 0);
  const double h = 0.5 * stable_time_step_s(cloth, set);

  const Eigen::Matrix3Xd shape = rest_shapes(cloth, {&set, 1}, 0).front();
  for (int n = 0; n < 12; ++n)
    set.start_position_m = relax(cloth, {&set, 1}, 9.81, 0, h).front().position_m;

  EXPECT_LT((shape - set.start_position_m).colwise().norm().maxCoeff(), 1e-5);
}

TEST(RestShapes, AreSmoothInTheParameters) {
  for (const int corners : {1, 2}) {
    const Cloth cloth = cloth_hung_by(7, corners);
    for (const size_t type : {structural_t, structural_s, shear_down, flexion_t}) {
      SCOPED_TRACE(testing::Message() << corners << " corners, type " << type);
      const auto derivative = [&](double step) {
        const std::vector<ParameterSet> sets = {cotton_set(cloth, type, step),
                                                cotton_set(cloth, type, -step)};
        const auto shapes = rest_shapes(cloth, sets, 0);
        return Eigen::Matrix3Xd((shapes[0] - shapes[1]) / (2 * step));
      };

      const Eigen::Matrix3Xd coarse = derivative(2e-3), fine = derivative(1e-3);

      EXPECT_GT(fine.norm(), 1e-5);
      // The error of a difference falls by four with the step; shapes are good to micrometres.
      EXPECT_LT((coarse - fine).norm(), 0.02 * fine.norm() + 1e-6);
    }
  }
}

TEST(RestShapes, OfAClothOnOneCornerFaceTheirStart) {
  const Cloth cloth = cloth_hung_by(7, 1);
  const ParameterSet set = cotton_set(cloth, 0, 0);
  ParameterSet turned = set;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  turned.start_position_m = turn * set.start_position_m;

  const std::vector<ParameterSet> sets = {set, turned};
  const auto shapes = rest_shapes(cloth, sets, 0);

  EXPECT_LT((shapes[1] - turn * shapes[0]).colwise().norm().maxCoeff(), 1e-5);
}

TEST(RestShapes, DoNotDependOnTheOtherSetsOrTheThreads) {
  const Cloth cloth = cloth_hung_by(9, 2);
  std::vector<ParameterSet> sets;
  for (int n = 0; n < 5; ++n) sets.push_back(cotton_set(cloth, 1, 0.1 * n));
  const auto shapes = rest_shapes(cloth, sets, 0);
  ASSERT_EQ(shapes.size(), 5u);

  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const std::vector<ParameterSet> backwards(sets.rbegin(), sets.rend());
  const auto reversed = rest_shapes(cloth, backwards, 0);
  for (size_t n = 0; n < 5; ++n) EXPECT_EQ(shapes[n], reversed[4 - n]);
}

TEST(RestShapes, HaveHeldPointsWhereTheyAreAtThatTime) {
  Cloth cloth = cloth_hung_by(5, 2);
  cloth.held[1].motion = [](double time_s) { return Eigen::Vector3d(0.3 + 0.1 * time_s, 0, 0); };
  const ParameterSet set = cotton_set(cloth, 0, 0);

  const Eigen::Matrix3Xd p = rest_shapes(cloth, {&set, 1}, 0.5).front();

  EXPECT_LT((p.col(4) - Eigen::Vector3d(0.35, 0, 0)).norm(), 1e-15);
}

}  // namespace
}  // namespace clothfit
