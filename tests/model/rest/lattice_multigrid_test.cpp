// Checks the preconditioner of Newton's steps as a linear map. Not checked here: the steps
// themselves (equilibrium_test.cpp).

#include "model/rest/lattice_multigrid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

/// A cloth stretched by a few percent and waved, held by two corners, and its linear system.
struct System {
  Mesh mesh;
  HangingEnergy energy;
  std::vector<int> fixed;
  EnergyTangent tangent;
  Eigen::ArrayXd shift;
  LatticeMultigrid multigrid;

  System(const Mesh& on, std::vector<int> held)
      : mesh(on),
        energy({.mesh = on,
                .natural_length_m = flat_lengths(on),
                .stiffness_n_per_m = {50, 50, 20, 20, 10, 10},
                .mass_kg = masses_by_area(on, 0.03)}),
        fixed(std::move(held)),
        multigrid(energy.layout(), fixed) {
    Eigen::Matrix3Xd p = 1.03 * flat_positions(mesh);
    for (Eigen::Index v = 0; v < p.cols(); ++v)
      p(2, v) = 0.02 * std::sin(9 * p(0, v) + 4 * p(1, v));
    energy.linearise(MeshField::of(energy.layout(), p), Curvature::clamped, tangent);
    shift = Eigen::ArrayXd::Zero(energy.layout().plane());
    for (int v = 0; v < mesh.vertex_count(); ++v)
      shift[energy.layout().at(v)] = 1e-3 * energy.cloth().mass_kg[v];
    multigrid.set(tangent, shift);
  }
  void hold(MeshField& field) const {
    for (const int vertex : fixed) field.set(vertex, Eigen::Vector3d::Zero());
  }
  MeshField apply(const MeshField& r) {
    MeshField v(energy.layout());
    multigrid.apply(r, v);
    return v;
  }
  MeshField random(Uniform& uniform) {
    MeshField field = MeshField::of(energy.layout(), uniform.vectors(mesh.vertex_count(), 1));
    hold(field);
    return field;
  }
  /// Counts steps of preconditioned conjugate gradients until the residual is a millionth.
  int steps_to_a_millionth(Uniform& uniform) {
    MeshField residual = random(uniform), product(energy.layout());
    const double enough = 1e-6 * norm(residual);
    MeshField conditioned = apply(residual), search = conditioned;
    double rz = dot(residual, conditioned);
    for (int n = 1; n < 1000; ++n) {
      energy.multiply(tangent, search, product);
      for (int axis = 0; axis < 3; ++axis)
        Eigen::Map<Eigen::ArrayXd>(product.plane(axis), shift.size()) +=
            shift * Eigen::Map<const Eigen::ArrayXd>(search.plane(axis), shift.size());
      hold(product);
      add_scaled(-rz / dot(search, product), product, residual);
      if (norm(residual) < enough) return n;
      conditioned = apply(residual);
      const double next = dot(residual, conditioned);
      scale_and_add(conditioned, next / rz, search);
      rz = next;
    }
    return 1000;
  }
};

TEST(LatticeMultigrid, IsSymmetricAndPositive) {
  SCOPED_TRACE("seed 1");
  Uniform uniform(1);
  System system({.columns = 30, .rows = 41, .width_m = 0.3, .height_m = 0.4}, {0, 29});
  for (int trial = 0; trial < 5; ++trial) {
    const MeshField a = system.random(uniform), b = system.random(uniform);
    const MeshField ma = system.apply(a), mb = system.apply(b);

    EXPECT_NEAR(dot(b, ma), dot(a, mb), 1e-10 * norm(b) * norm(ma));
    EXPECT_GT(dot(a, ma), 0);
    EXPECT_EQ(ma.at(0), Eigen::Vector3d::Zero().eval());
  }
}

TEST(LatticeMultigrid, NeedsHardlyMoreStepsOnFinerMeshes) {
  SCOPED_TRACE("seed 2");
  for (const int n : {16, 33, 64, 129}) {
    Uniform uniform(2);
    System system(square_mesh(n), {0, n - 1});
    // Without it the number doubles with every refinement: some 1000 on the last one.
    EXPECT_LT(system.steps_to_a_millionth(uniform), 40) << n;
  }
}

TEST(LatticeMultigrid, CopesWithHeldVerticesThatCoarseMeshesDoNotHave) {
  SCOPED_TRACE("seed 3");
  Uniform uniform(3);
  const Mesh mesh = square_mesh(65);
  System system(mesh, {mesh.vertex(1, 1), mesh.vertex(1, 63), mesh.vertex(33, 17)});
  EXPECT_LT(system.steps_to_a_millionth(uniform), 60);
}

TEST(LatticeMultigrid, WorksOnAStrip) {
  SCOPED_TRACE("seed 4");
  Uniform uniform(4);
  System system({.columns = 2, .rows = 70, .width_m = 0.01, .height_m = 0.7}, {0, 1});
  EXPECT_LT(system.steps_to_a_millionth(uniform), 60);
}

}  // namespace
}  // namespace clothfit
