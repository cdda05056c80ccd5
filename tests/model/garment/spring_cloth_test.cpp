// Checks the paper's springs: derivatives, conservation, the same cloth on every mesh, resistance
// to bending of the fourth power; and that all methods find the same rest.

#include "model/garment/spring_cloth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model/garment/garment_energy.h"
#include "model/sheet/settle_otherwise.h"
#include "tests/model/garment/derivatives.h"
#include "tests/model/garment/patterns.h"

namespace clothfit {
namespace {

TEST(SpringCloth, HasTheDerivativesOfDifferencesAndNoForceOfItsOwn) {
  const GarmentMesh mesh = mesh_garment(tube(0.1, 0.1, 0.02), 0.02);
  GarmentEnergy energy(mesh, PaperSprings(), GarmentEnergy::Seams::sewn);
  energy.set_gravity(Eigen::Vector3d::Zero());
  const Eigen::Matrix3Xd position = shaken(energy.particles_m(mesh.placed_m), 2e-3);
  expect_derivatives(energy, position, 1e-5);
  Eigen::Matrix3Xd gradient;
  energy.energy_and_gradient(position, gradient);
  EXPECT_LT(gradient.rowwise().sum().norm(), 1e-11 * gradient.norm());
}

/// Returns the springs' energy of a rectangle whose points are moved.
template <class Move>
double energy_of_moved(double spacing_m, const Move& move) {
  const GarmentMesh mesh = mesh_garment(pattern_of({rectangle(0.2, 0.1, 0)}), spacing_m);
  SpringCloth cloth(mesh, mesh.particle_of, PaperSprings());
  cloth.set_gravity(Eigen::Vector3d::Zero());
  Eigen::Matrix3Xd position(3, mesh.cloth.vertex_count()), gradient;
  for (int v = 0; v < mesh.cloth.vertex_count(); ++v)
    position.col(v) = move(Eigen::Vector2d(mesh.cloth.material_m.col(v)));
  return cloth.energy_and_gradient(position, gradient);
}

TEST(SpringCloth, IsTheSameClothOnEveryMesh) {
  const auto stretched = [](const Eigen::Vector2d& flat) {
    return Eigen::Vector3d(1.01 * flat.x(), flat.y(), 0);
  };
  const PaperSprings springs;
  // Per area: threads along s, two diagonals of half the strain, bending springs along none.
  const double expected =
      0.5 * 0.02 * 1e-4 * (springs.tension_n_per_m + 2 * springs.shear_n_per_m * 0.25);
  for (const double spacing_m : {0.02, 0.01, 0.005})
    EXPECT_NEAR(energy_of_moved(spacing_m, stretched), expected, 0.04 * expected);
}

TEST(SpringCloth, ResistsBendingWithTheFourthPower) {
  const auto rolled = [](double radius_m) {
    return [=](const Eigen::Vector2d& flat) {
      const double angle = flat.x() / radius_m;
      return Eigen::Vector3d(radius_m * std::sin(angle), flat.y(),
                             radius_m * (1 - std::cos(angle)));
    };
  };
  const double wide = energy_of_moved(0.01, rolled(0.4)),
               tight = energy_of_moved(0.01, rolled(0.2));
  EXPECT_NEAR(tight / wide, 16, 1);
}

TEST(SettleOtherwise, FindsTheSameRest) {
  const GarmentMesh mesh = mesh_garment(pattern_of({rectangle(0.1, 0.1, 0)}), 0.02);
  SpringCloth cloth(mesh, mesh.particle_of, PaperSprings());
  std::vector<bool> held(static_cast<size_t>(cloth.points()), false);
  for (int v = 0; v < mesh.cloth.vertex_count(); ++v)
    held[static_cast<size_t>(v)] = mesh.cloth.material_m(1, v) > 0.1 - 1e-9;
  SettleRule rule;
  rule.load_n = cloth.weight_n();
  rule.stop = {.gradient_n = 1e-4 * rule.load_n,
               .most_iterations = 20000,
               .lowest_energy_j = -INFINITY,
               .go_on = {}};
  rule.first_shift_per_s2 = 1000;
  const Eigen::Matrix3Xd start = shaken(mesh.placed_m, 0.002);
  Eigen::Matrix3Xd by_newton = start, by_gradients = start, by_time = start;
  const MinimiseResult newton = settle(cloth, held, rule, by_newton),
                       gradients = settle_by_conjugate_gradients(cloth, held, rule, by_gradients),
                       time = settle_by_time_steps(cloth, held, rule, 0.01, 0.05, by_time);
  EXPECT_EQ(newton.reason, MinimiseReason::converged);
  EXPECT_EQ(gradients.reason, MinimiseReason::converged);
  EXPECT_EQ(time.reason, MinimiseReason::converged);
  EXPECT_NEAR(gradients.energy_j / newton.energy_j, 1, 1e-6);
  EXPECT_NEAR(time.energy_j / newton.energy_j, 1, 1e-6);
  EXPECT_LT(newton.iterations, gradients.iterations);
}

}  // namespace
}  // namespace clothfit
