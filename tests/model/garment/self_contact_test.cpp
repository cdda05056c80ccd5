// Checks the pressure of cloth on itself: derivatives, conservation, no kink where edges are
// parallel.

#include "model/garment/self_contact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "model/garment/drape_garment.h"
#include "model/garment/surface_nets.h"
#include "tests/model/garment/patterns.h"
#include "tests/model/measured_cloth.h"

namespace clothfit {
namespace {

constexpr double kBeta_m = 0.1;

/// Two triangles one above the other, each turned by an angle of its own.
SelfContact two_triangles() {
  Eigen::Matrix3Xi triangle(3, 2);
  triangle << 0, 3, 1, 4, 2, 5;
  const Eigen::Matrix3Xd centre = Eigen::Matrix3Xd::Random(3, 2);
  std::vector<int> apart(6);
  std::iota(apart.begin(), apart.end(), 0);
  return {SurfaceParts(triangle, centre, apart), Eigen::VectorXd::LinSpaced(6, 1, 2),
          Eigen::VectorXd::Constant(6, kBeta_m)};
}

Eigen::Matrix3Xd placed(double turn_rad, double apart_m) {
  Eigen::Matrix3Xd position(3, 6);
  for (int k = 0; k < 3; ++k) {
    const double angle = 2.1 * k;
    position.col(k) << std::cos(angle), std::sin(angle), 0.02 * k;
    position.col(k + 3) << std::cos(angle + turn_rad), std::sin(angle + turn_rad),
        apart_m + 0.01 * k;
  }
  return position;
}

TEST(SelfContact, HasTheDerivativeOfDifferences) {
  SelfContact contact = two_triangles();
  for (const double turn_rad : {0.03, 0.3, 1.0}) {
    const Eigen::Matrix3Xd position = placed(turn_rad, 0.06);
    contact.open_way(position, 0 * position);
    Eigen::Matrix3Xd gradient = 0 * position, ignored = gradient;
    EXPECT_GT(contact.add_energy_and_gradient(position, gradient), 0);
    for (Eigen::Index n = 0; n < position.size(); ++n) {
      constexpr double kStep_m = 1e-7;
      Eigen::Matrix3Xd up = position, down = position;
      up.reshaped()[n] += kStep_m;
      down.reshaped()[n] -= kStep_m;
      const double slope = (contact.add_energy_and_gradient(up, ignored) -
                            contact.add_energy_and_gradient(down, ignored)) /
                           (2 * kStep_m);
      EXPECT_NEAR(gradient.reshaped()[n], slope, 1e-6 * gradient.norm());
    }
    EXPECT_LT(gradient.rowwise().sum().norm(), 1e-12 * gradient.norm());
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    for (Eigen::Index v = 0; v < 6; ++v) {
      const Eigen::Vector3d at = position.col(v), force = gradient.col(v);
      moment += at.cross(force);
    }
    EXPECT_LT(moment.norm(), 1e-12 * gradient.norm());
  }
}

TEST(SelfContact, HasTheSecondDerivativeAlongItsConnections) {
  // The distance grows evenly: no connection turns, and differences see the whole of it.
  SelfContact contact = two_triangles();
  const Eigen::Matrix3Xd position = placed(0.3, 0.06);
  contact.open_way(position, 0 * position);
  Eigen::Matrix3Xd apart = 0 * position, above = apart, below = apart, product = apart;
  apart.row(2).tail<3>().setOnes();
  contact.add_second_derivative(position, [&](int a, int b, const Eigen::Matrix3d& block) {
    product.col(a) += block * apart.col(b);
    if (a != b) product.col(b) += block.transpose() * apart.col(a);
  });
  constexpr double kStep_m = 1e-6;
  contact.add_energy_and_gradient(position + kStep_m * apart, above);
  contact.add_energy_and_gradient(position - kStep_m * apart, below);
  const Eigen::Matrix3Xd difference = (above - below) / (2 * kStep_m);
  EXPECT_LT((product - difference).norm(), 0.1 * difference.norm());
}

TEST(SelfContact, IsSmoothWhereEdgesAreParallel) {
  // Through the angle at which all edges are parallel, the force changes as little as beside it.
  SelfContact contact = two_triangles();
  const auto force_at = [&](double turn_rad) {
    const Eigen::Matrix3Xd position = placed(turn_rad, 0.06);
    contact.open_way(position, 0 * position);
    Eigen::Matrix3Xd gradient = 0 * position;
    contact.add_energy_and_gradient(position, gradient);
    return gradient;
  };
  const double size = force_at(0).norm();
  EXPECT_LT((force_at(1e-6) - force_at(-1e-6)).norm(), 1e-3 * size);
}

TEST(SelfContact, StopsBeforeItPassesThroughItself) {
  SelfContact contact = two_triangles();
  const Eigen::Matrix3Xd position = placed(0.3, 0.06);
  Eigen::Matrix3Xd move = 0 * position;
  move.row(2).tail<3>().array() = -1;
  const double share = contact.open_way(position, move);
  EXPECT_GT(share, 0.01);
  EXPECT_LT(share, 0.06);
  EXPECT_EQ(contact.crossings(position + share * move), 0);
  EXPECT_GT(contact.crossings(position + move * 0.05), 0);
}

TEST(SelfContact, CarriesAClothUponAnother) {
  // A small sheet comes to rest on a large one on a table. Without friction one of equal size would
  // slide off.
  const Obstacle table(zero_surface(
      [](const Eigen::Vector3d& x) {
        const Eigen::Vector3d beyond =
            (x.cwiseAbs() - Eigen::Vector3d(0.15, 0.15, 0.03)).cwiseMax(0.0);
        return beyond.norm() - 0.02;
      },
      {-0.25, -0.25, -0.1}, {0.25, 0.25, 0.1}, 0.01));
  Panel lower = rectangle(0.24, 0.24, 0), upper = rectangle(0.06, 0.06, 0);
  lower.placement = Eigen::Translation3d(0, -0.12, 0.06);
  upper.placement = Eigen::Translation3d(0, -0.03, 0.07);
  upper.placement.rotate(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ()));
  GarmentOptions options;
  options.spacing_m = options.coarsest_m = 0.02;
  const GarmentDrape drape =
      drape_garment(pattern_of({lower, upper}), {kMeasuredCloth}, &table, options);
  ASSERT_EQ(drape.state, GarmentState::at_rest);
  EXPECT_EQ(drape.crossings, 0);
  constexpr int kOfUpper = 16;
  const double lowest_m = drape.position_m.row(2).minCoeff(),
               upper_m = drape.position_m.row(2).tail<kOfUpper>().mean();
  // The table carries both where they lie above one another: the pressure of two weights.
  const double load_pa = 2 * 9.81 * kMeasuredCloth.areal_density_kg_per_m2;
  double u = 1;
  for (int n = 0; n < 50; ++n) u = std::log(1 + u + load_pa);
  EXPECT_NEAR(lowest_m - 0.05, options.hold_off_m * (1 - u / 12), 1.5e-4);
  EXPECT_GT(upper_m - lowest_m, 0.6 * options.self_distance_m);
  EXPECT_LT(upper_m - lowest_m, 1.2 * options.self_distance_m);
}

}  // namespace
}  // namespace clothfit
