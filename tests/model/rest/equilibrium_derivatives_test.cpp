// Checks how an equilibrium moves with the parameters. Not checked here: equilibria themselves
// (equilibrium_test.cpp).

#include "model/rest/equilibrium_derivatives.h"

#include <gtest/gtest.h>

#include <array>

#include "model/rest/equilibrium.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

const EquilibriumOptions kTight{.tolerance = 1e-12, .most_iterations = 500};

/// A cloth held by a corner and between vertices, sagging.
struct Sagging {
  HangingCloth cloth;
  std::vector<HeldVertexWeights> held;
  Eigen::Matrix3Xd target_m;

  Sagging() {
    const Mesh mesh = square_mesh(8);
    cloth = {.mesh = mesh,
             .natural_length_m = flat_lengths(mesh),
             .stiffness_n_per_m = {50, 40, 20, 20, 10, 10},
             .mass_kg = masses_by_area(mesh, 0.03)};
    held = {held_at(mesh, 0, 0), held_at(mesh, 0.39, 0.01)};
    target_m.resize(3, 2);
    target_m << 0, 0.37, 0, 0.02, 0, 0.01;
  }
  Sagging moved(const EquilibriumDirection& along, double by) const {
    Sagging result = *this;
    for (size_t t = 0; t < kSpringTypes; ++t) {
      result.cloth.stiffness_n_per_m[t] += by * along.stiffness_n_per_m[t];
      result.cloth.natural_length_m[t] += by * along.natural_length_m[t];
    }
    result.cloth.gravity_m_per_s2 += by * along.gravity_m_per_s2;
    if (along.mass_kg.size() > 0) result.cloth.mass_kg += by * along.mass_kg;
    if (along.held_target_m.size() > 0) result.target_m += by * along.held_target_m;
    return result;
  }
  Eigen::Matrix3Xd shape(const Eigen::Matrix3Xd& start_m) const {
    const EquilibriumResult result = find_equilibrium(cloth, held, target_m, start_m, kTight);
    EXPECT_LT(result.imbalance, 1e-11) << describe(result.reason);
    return result.position_m;
  }
};

TEST(EquilibriumDerivatives, AgreeWithDifferencesOfEquilibria) {
  SCOPED_TRACE("seed 1");
  Uniform uniform(1);
  const Sagging sagging;
  // The cascade has one mesh only, so that neighbours are found from the shape itself.
  const Eigen::Matrix3Xd shape = sagging.shape(flat_positions(sagging.cloth.mesh));
  std::vector<EquilibriumDirection> directions(5);
  directions[0].stiffness_n_per_m = {1, -2, 3, 1, 2, -1};
  directions[1].natural_length_m = {1e-3, 2e-3, -1e-3, 1e-3, 1e-3, -1e-3};
  directions[2].gravity_m_per_s2 = {0.3, -0.2, 1};
  directions[3].mass_kg = (uniform.vectors(64, 1e-4)).row(0).transpose();
  directions[4].held_target_m = uniform.vectors(2, 0.1);

  const EquilibriumDerivatives derivatives =
      equilibrium_derivatives(sagging.cloth, sagging.held, shape, directions);

  ASSERT_TRUE(derivatives.usable());
  for (size_t n = 0; n < directions.size(); ++n) {
    // The step lies between the error of equilibria, 1e-10 m, and the place where folds change
    // their stiffness.
    const double h = std::array{1e-2, 1e-5, 1e-4, 1e-4, 1e-5}[n];
    const Eigen::Matrix3Xd difference = (sagging.moved(directions[n], h).shape(shape) -
                                         sagging.moved(directions[n], -h).shape(shape)) /
                                        (2 * h);
    EXPECT_GT(difference.norm(), 1e-4) << n;
    // The error is of second order in h, for folds whose stiffness itself changes within
    // millimetres.
    EXPECT_LT((derivatives.position_m[n] - difference).norm(), 1e-4 * difference.norm()) << n;
  }
}

TEST(EquilibriumDerivatives, OfHeldPointsThatMoveTogetherMoveTheWholeCloth) {
  const Sagging sagging;
  const Eigen::Matrix3Xd shape = sagging.shape(flat_positions(sagging.cloth.mesh));
  EquilibriumDirection up;
  up.held_target_m = Eigen::Vector3d(1, 2, 3).replicate(1, 2);

  const EquilibriumDerivatives derivatives =
      equilibrium_derivatives(sagging.cloth, sagging.held, shape, {&up, 1});

  ASSERT_TRUE(derivatives.usable());
  EXPECT_LT((derivatives.position_m[0].colwise() - Eigen::Vector3d(1, 2, 3)).norm(), 1e-8);
}

TEST(EquilibriumDerivatives, SayWhenSomeMotionIsFree) {
  // A cloth that hangs from one corner turns about the vertical.
  Sagging sagging;
  sagging.held.resize(1);
  sagging.target_m.conservativeResize(3, 1);
  const Eigen::Matrix3Xd shape = sagging.shape(flat_positions(sagging.cloth.mesh));
  const EquilibriumDirection any{.gravity_m_per_s2 = {0, 0, 1}};

  const EquilibriumDerivatives derivatives =
      equilibrium_derivatives(sagging.cloth, sagging.held, shape, {&any, 1});

  EXPECT_EQ(derivatives.reason, DerivativeReason::singular);
  EXPECT_TRUE(derivatives.position_m.empty());
}

TEST(EquilibriumDerivatives, SayWhenTheShapeIsASaddle) {
  // A flat vertical sheet whose held corners are pushed together stays flat by symmetry,
  // compressed.
  Sagging sagging;
  sagging.held = {held_at(sagging.cloth.mesh, 0, 0), held_at(sagging.cloth.mesh, 0.4, 0)};
  sagging.target_m << 0, 0.37, 0, 0, 0, 0;
  const Eigen::Matrix3Xd shape = sagging.shape(hung_flat(sagging.cloth.mesh));
  ASSERT_LT(shape.row(1).cwiseAbs().maxCoeff(), 1e-12);
  const EquilibriumDirection any{.gravity_m_per_s2 = {0, 0, 1}};

  const EquilibriumDerivatives derivatives =
      equilibrium_derivatives(sagging.cloth, sagging.held, shape, {&any, 1});

  EXPECT_EQ(derivatives.reason, DerivativeReason::unstable);
}

}  // namespace
}  // namespace clothfit
