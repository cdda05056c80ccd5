// Checks wind and drag along the surface's normal.

#include <gtest/gtest.h>

#include "model/effects/registry.h"
#include "tests/model/effect_contract.h"

namespace clothfit {
namespace {

constexpr double kMass_kg = 0.025;  // square_cloth's mass, on 0.4 m x 0.4 m
constexpr double kArea_m2 = 0.16;

/// A flat cloth, turned, that is let go in the wind.
struct Flight {
  Cloth cloth;
  ParameterSet set;

  Flight(int vertices_per_side, double c, const Eigen::Vector3d& q, const Eigen::Matrix3d& attitude)
      : cloth(square_cloth(vertices_per_side)) {
    add_effect(cloth, "wind", "test");
    set.springs = spring_parameters(cotton(), cloth.mesh);
    set.effects = {{c, q.x(), q.y(), q.z()}};
    set.start_position_m = attitude * flat_positions(cloth.mesh);
  }
  Eigen::Matrix3Xd velocity_m_per_s(double time_step_s, int steps) const {
    SteppedCloth<> run(cloth, set, at_rest(set.start_position_m));
    for (int n = 0; n < steps; ++n) run.step(time_step_s);
    return run.velocity_m_per_s();
  }
};

Eigen::Matrix3Xd forces_n(const Flight& flight, const Eigen::Matrix3Xd& position_m,
                          const Eigen::Matrix3Xd& velocity_m_per_s) {
  Uniform unused(0);
  effect_contract::State state(unused);
  state.cloth = flight.cloth;
  state.position_m = position_m;
  state.velocity_m_per_s = velocity_m_per_s;
  return effect_contract::force_n(*flight.cloth.effects.front(), state, flight.set.effects.front(),
                                  at_rest(position_m));
}

TEST(Wind, KeepsTheContractOfEffects) {
  expect_effect_contract("wind", {});
}

TEST(Wind, PressesOnAFlatSheetAlongItsNormal) {
  // In all F = A (n . q) n, whatever the mesh; each vertex gets the share of its area.
  const Eigen::Vector3d q(0.3, -0.2, 0.5);
  for (const unsigned seed : {1u, 2u}) {
    Uniform uniform(seed);
    const Eigen::Matrix3d attitude = uniform.rotation();
    const Eigen::Vector3d n = attitude.col(2);
    for (const int vertices : {2, 3, 9}) {
      SCOPED_TRACE(vertices);
      const Flight flight(vertices, 0, q, attitude);

      const Eigen::Matrix3Xd force =
          forces_n(flight, flight.set.start_position_m, at_rest(flight.set.start_position_m));

      EXPECT_LT((force.rowwise().sum() - kArea_m2 * n.dot(q) * n).norm(), 1e-15);
      const Eigen::VectorXd area_m2 = masses_by_area(flight.cloth.mesh, kArea_m2);
      EXPECT_LT((force - n.dot(q) * n * area_m2.transpose()).cwiseAbs().maxCoeff(), 1e-16);
    }
  }
}

TEST(Wind, AHorizontalSheetFallsAtWeightPerAreaOverDrag) {
  const double c = 1.2;

  const Eigen::Matrix3Xd v =
      Flight(5, c, {0, 0, 0}, Eigen::Matrix3d::Identity()).velocity_m_per_s(1e-3, 6000);

  // At the end c v = g m / A; after 46 time constants nothing of the start remains.
  EXPECT_LT(
      (v.colwise() - Eigen::Vector3d(0, 0, -9.81 * kMass_kg / kArea_m2 / c)).cwiseAbs().maxCoeff(),
      1e-12);
}

TEST(Wind, ASheetEdgeOnFallsFreely) {
  Eigen::Matrix3d upright;
  upright << 1, 0, 0, 0, 0, -1, 0, 1, 0;

  const Eigen::Matrix3Xd v = Flight(5, 1.2, {0, 0, 0}, upright).velocity_m_per_s(1e-3, 500);

  EXPECT_LT((v.colwise() - Eigen::Vector3d(0, 0, -9.81 * 0.5)).cwiseAbs().maxCoeff(), 1e-11);
}

TEST(Wind, CarriesAFacingSheetAlongWithTheAir) {
  // Without gravity a sheet that faces the wind u = q / c comes to move with it.
  Flight flight(5, 0.8, {0, 0, 0.8 * 2.5}, Eigen::Matrix3d::Identity());
  flight.set.gravity_m_per_s2.setZero();

  EXPECT_LT((flight.velocity_m_per_s(1e-3, 8000).colwise() - Eigen::Vector3d(0, 0, 2.5))
                .cwiseAbs()
                .maxCoeff(),
            1e-12);
}

TEST(Wind, TurnsWithTheSceneWhenTheWindTurnsToo) {
  Uniform uniform(3);
  const Eigen::Vector3d q(0.3, -0.2, 0.5);
  const Eigen::Matrix3d turn = uniform.rotation();
  const Flight here(6, 0.7, q, Eigen::Matrix3d::Identity()),
      there(6, 0.7, turn * q, Eigen::Matrix3d::Identity());
  const Eigen::Matrix3Xd p = crumpled(here.cloth.mesh, 0.5, uniform);
  const Eigen::Matrix3Xd v = uniform.vectors(36, 2);

  const Eigen::Matrix3Xd force = forces_n(here, p, v);

  EXPECT_LT((forces_n(there, turn * p, turn * v) - turn * force).norm(), 1e-13 * force.norm());
}

TEST(Wind, StillAirOnlyTakesEnergyAway) {
  Uniform uniform(4);
  const Flight flight(6, 0.7, {0, 0, 0}, Eigen::Matrix3d::Identity());
  const Eigen::Matrix3Xd p = crumpled(flight.cloth.mesh, 0.2, uniform);
  const Eigen::Matrix3Xd v = uniform.vectors(36, 2);

  const double power_w = forces_n(flight, p, v).cwiseProduct(v).sum();

  EXPECT_LT(power_w, -1e-4);
  // It damps no faster than it tells those who choose the time step: -F.v <= rate m v^2.
  const double rate_per_s =
      flight.cloth.effects.front()
          ->rates(flight.cloth, flight.set.springs, flight.set.effects.front())
          .damping_per_s;
  EXPECT_LE(-power_w, rate_per_s * 2 * kinetic_energy_j(flight.cloth.mass_kg, v));
}

TEST(Wind, IsNothingWhereTheSurfaceIsFoldedToNothing) {
  const Flight flight(3, 0.7, {0.3, 0.2, 0.1}, Eigen::Matrix3d::Identity());
  const Eigen::Matrix3Xd nowhere = Eigen::Matrix3Xd::Zero(3, 9);

  EXPECT_EQ(forces_n(flight, nowhere, nowhere).cwiseAbs().maxCoeff(), 0);
}

}  // namespace
}  // namespace clothfit
