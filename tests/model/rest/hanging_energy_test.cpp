// Checks the energy of a hanging cloth with its first and second derivative, on every instruction
// set. Not checked here: held points (held_projection_test.cpp) and minima (equilibrium_test.cpp).

#include "model/rest/hanging_energy.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "tests/model/instruction_sets.h"
#include "tests/model/mechanics.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

/// The mesh has more rows than one task takes, and columns that fill no whole vector.
constexpr Mesh kMesh{.columns = 11, .rows = 53, .width_m = 0.2, .height_m = 1.0};

struct Crumpled {
  HangingCloth cloth;
  Eigen::Matrix3Xd position_m;
};

/// Returns the model's springs, not at rest in the flat cloth, and the energy of equation 8.
std::vector<Crumpled> crumpled_cloths(const Mesh& mesh, Uniform& uniform) {
  Eigen::VectorXd mass_kg(mesh.vertex_count());
  for (double& m : mass_kg) m = uniform(1e-4, 1e-3);
  HangingCloth model{.mesh = mesh,
                     .natural_length_m = flat_lengths(mesh),
                     .mass_kg = mass_kg,
                     .gravity_m_per_s2 = uniform.vectors(1, 10).col(0)};
  std::array<double, kSpringTypes> constant_j{};
  for (size_t t = 0; t < kSpringTypes; ++t) {
    model.natural_length_m[t] *= uniform(0.8, 1.2);
    model.stiffness_n_per_m[t] = uniform(1, 100);
    constant_j[t] = uniform(1e-3, 1e-1);
  }
  const Eigen::Matrix3Xd position_m = crumpled(mesh, 0.4, uniform);
  return {{model, position_m},
          {HangingCloth::of_equation8(mesh, constant_j, 1.3, mass_kg), position_m}};
}

double energy_at(HangingEnergy& energy, const Eigen::Matrix3Xd& position_m) {
  MeshField gradient(energy.layout());
  return energy.energy_and_gradient(MeshField::of(energy.layout(), position_m), gradient);
}

Eigen::Matrix3Xd gradient_at(HangingEnergy& energy, const Eigen::Matrix3Xd& position_m) {
  MeshField gradient(energy.layout());
  energy.energy_and_gradient(MeshField::of(energy.layout(), position_m), gradient);
  return gradient.vectors();
}

Eigen::Matrix3Xd product_at(HangingEnergy& energy, const Eigen::Matrix3Xd& position_m,
                            Curvature curvature, const Eigen::Matrix3Xd& direction) {
  EnergyTangent tangent;
  energy.linearise(MeshField::of(energy.layout(), position_m), curvature, tangent);
  MeshField product(energy.layout());
  energy.multiply(tangent, MeshField::of(energy.layout(), direction), product);
  return product.vectors();
}

TEST(HangingEnergy, IsTheSpringsEnergyAndTheWeightsHeight) {
  SCOPED_TRACE("seed 1");
  Uniform uniform(1);
  const Crumpled crumpled = crumpled_cloths(kMesh, uniform).front();
  const HangingCloth& cloth = crumpled.cloth;
  HangingEnergy energy(cloth);

  const SpringParameters springs{.natural_length_m = cloth.natural_length_m,
                                 .stiffness_n_per_m = cloth.stiffness_n_per_m};
  const double expected = elastic_energy_j(make_springs(kMesh), springs, crumpled.position_m) -
                          cloth.gravity_m_per_s2.dot(crumpled.position_m * cloth.mass_kg);

  EXPECT_NEAR(energy_at(energy, crumpled.position_m), expected, 1e-12 * std::abs(expected));
}

TEST(HangingEnergy, OfEquation8IsThePapersSum) {
  SCOPED_TRACE("seed 2");
  Uniform uniform(2);
  const Eigen::Matrix3Xd p = crumpled(kMesh, 0.4, uniform);
  const std::array<double, kSpringTypes> k = {0.01, 0.02, 0.003, 0.004, 0.005, 0.06};
  const Eigen::VectorXd mass_kg = masses_by_area(kMesh, 0.04);
  const double c_g = 0.7;
  HangingEnergy energy(HangingCloth::of_equation8(kMesh, k, c_g, mass_kg));

  double expected = 0;
  const SpringNet net = make_springs(kMesh);
  const auto flat = flat_lengths(kMesh);
  for (size_t t = 0; t < kSpringTypes; ++t)
    for (const Spring& spring : net[t])
      expected +=
          0.5 * k[t] * std::pow((p.col(spring.b) - p.col(spring.a)).norm() / flat[t] - 1, 2);
  expected += c_g * 9.81 * p.row(2).dot(mass_kg.transpose());

  EXPECT_NEAR(energy_at(energy, p), expected, 1e-12 * std::abs(expected));
}

TEST(HangingEnergy, FallsAlongTheModelsForces) {
  SCOPED_TRACE("seed 3");
  Uniform uniform(3);
  const Crumpled crumpled = crumpled_cloths(kMesh, uniform).front();
  const HangingCloth& cloth = crumpled.cloth;
  HangingEnergy energy(cloth);
  const SpringParameters springs{.natural_length_m = cloth.natural_length_m,
                                 .stiffness_n_per_m = cloth.stiffness_n_per_m};

  const Eigen::Matrix3Xd force_n =
      spring_forces_n(kMesh, springs, crumpled.position_m,
                      Eigen::Matrix3Xd::Zero(3, kMesh.vertex_count())) +
      cloth.gravity_m_per_s2 * cloth.mass_kg.transpose();

  const Eigen::Matrix3Xd gradient = gradient_at(energy, crumpled.position_m);
  EXPECT_LT((gradient + force_n).norm(), 1e-13 * force_n.norm());
}

TEST(HangingEnergy, HasTheGradientThatDifferencesOfTheEnergyHave) {
  SCOPED_TRACE("seed 4");
  Uniform uniform(4);
  for (const Crumpled& crumpled : crumpled_cloths(kMesh, uniform)) {
    HangingEnergy energy(crumpled.cloth);
    const Eigen::Matrix3Xd direction = uniform.vectors(kMesh.vertex_count(), 1);
    const double h = 1e-6;  // m; central differences: h^2 and rounding / h, both far below 1e-7

    const double slope = gradient_at(energy, crumpled.position_m).cwiseProduct(direction).sum();
    const double difference = (energy_at(energy, crumpled.position_m + h * direction) -
                               energy_at(energy, crumpled.position_m - h * direction)) /
                              (2 * h);

    EXPECT_NEAR(slope, difference, 1e-7 * gradient_at(energy, crumpled.position_m).norm());
    EXPECT_GT(std::abs(slope), 0);
  }
}

TEST(HangingEnergy, HasTheSecondDerivativeThatDifferencesOfTheGradientHave) {
  SCOPED_TRACE("seed 5");
  Uniform uniform(5);
  for (const Crumpled& crumpled : crumpled_cloths(kMesh, uniform)) {
    HangingEnergy energy(crumpled.cloth);
    const Eigen::Matrix3Xd direction = uniform.vectors(kMesh.vertex_count(), 1);
    const double h = 1e-6;

    const Eigen::Matrix3Xd product =
        product_at(energy, crumpled.position_m, Curvature::exact, direction);
    const Eigen::Matrix3Xd difference = (gradient_at(energy, crumpled.position_m + h * direction) -
                                         gradient_at(energy, crumpled.position_m - h * direction)) /
                                        (2 * h);

    EXPECT_LT((product - difference).norm(), 1e-6 * product.norm());
  }
}

TEST(HangingEnergy, ClampedHasNoNegativeCurvatureAndIsExactWhereAllIsStretched) {
  SCOPED_TRACE("seed 6");
  Uniform uniform(6);
  Crumpled crumpled = crumpled_cloths(kMesh, uniform).front();
  bool exact_is_negative_somewhere = false;
  for (int trial = 0; trial < 20; ++trial) {
    HangingEnergy energy(crumpled.cloth);
    // Nothing holds a nearly flat, compressed sheet along its normal.
    const Eigen::Matrix3Xd squeezed = 0.5 * crumpled.position_m;
    Eigen::Matrix3Xd direction = uniform.vectors(kMesh.vertex_count(), 1);
    direction.topRows<2>() *= 0.01;
    const auto curvature = [&](Curvature which) {
      return product_at(energy, squeezed, which, direction).cwiseProduct(direction).sum();
    };
    EXPECT_GE(curvature(Curvature::clamped), 0);
    exact_is_negative_somewhere |= curvature(Curvature::exact) < 0;

    const Eigen::Matrix3Xd stretched = 20 * crumpled.position_m;
    EXPECT_EQ(product_at(energy, stretched, Curvature::clamped, direction),
              product_at(energy, stretched, Curvature::exact, direction));
  }
  EXPECT_TRUE(exact_is_negative_somewhere);
}

TEST(HangingEnergy, DoesNotChangeWithWhereTheClothIsOrFaces) {
  SCOPED_TRACE("seed 7");
  Uniform uniform(7);
  Crumpled crumpled = crumpled_cloths(kMesh, uniform).front();
  const Eigen::Matrix3d turn = uniform.rotation();
  const Eigen::Vector3d shift = uniform.vectors(1, 3).col(0);
  HangingEnergy energy(crumpled.cloth);
  HangingCloth turned_cloth = crumpled.cloth;
  turned_cloth.gravity_m_per_s2 = turn * crumpled.cloth.gravity_m_per_s2;
  HangingEnergy turned(turned_cloth);
  const Eigen::Matrix3Xd moved = (turn * crumpled.position_m).colwise() + shift;

  // Springs alone do not notice; the weight counts its own way down.
  const double lifted = -turned_cloth.gravity_m_per_s2.dot(shift) * crumpled.cloth.mass_kg.sum();
  const double expected = energy_at(energy, crumpled.position_m) + lifted;
  EXPECT_NEAR(energy_at(turned, moved), expected, 1e-11 * std::abs(expected));
  const Eigen::Matrix3Xd gradient = gradient_at(energy, crumpled.position_m);
  EXPECT_LT((gradient_at(turned, moved) - turn * gradient).norm(), 1e-11 * gradient.norm());
}

TEST(HangingEnergy, SpringsExertNoForceAndNoTorqueOnTheWhole) {
  SCOPED_TRACE("seed 8");
  Uniform uniform(8);
  Crumpled crumpled = crumpled_cloths(kMesh, uniform).front();
  crumpled.cloth.gravity_m_per_s2.setZero();
  HangingEnergy energy(crumpled.cloth);

  const Eigen::Matrix3Xd gradient = gradient_at(energy, crumpled.position_m);

  EXPECT_LT(gradient.rowwise().sum().norm(), 1e-12 * gradient.norm());
  EXPECT_LT(torque(crumpled.position_m, gradient).norm(), 1e-12 * gradient.norm());
  EXPECT_GT(gradient.norm(), 1e-3);
}

TEST(HangingEnergy, IsFiniteWhereASpringHasNoLength) {
  const HangingCloth cloth{.mesh = kMesh,
                           .natural_length_m = flat_lengths(kMesh),
                           .stiffness_n_per_m = {50, 50, 20, 20, 10, 10},
                           .mass_kg = masses_by_area(kMesh, 0.04)};
  HangingEnergy energy(cloth);
  const Eigen::Matrix3Xd heap = Eigen::Matrix3Xd::Zero(3, kMesh.vertex_count());

  EXPECT_TRUE(std::isfinite(energy_at(energy, heap)));
  EXPECT_TRUE(gradient_at(energy, heap).allFinite());
}

TEST(HangingEnergy, HasTheSameBitsOnEveryInstructionSetAndNumberOfThreads) {
  SCOPED_TRACE("seed 9");
  Uniform uniform(9);
  const Crumpled crumpled = crumpled_cloths(kMesh, uniform).front();
  const Eigen::Matrix3Xd direction = uniform.vectors(kMesh.vertex_count(), 1);
  HangingEnergy energy(crumpled.cloth);
  const double expected_energy = energy_at(energy, crumpled.position_m);
  const Eigen::Matrix3Xd expected_gradient = gradient_at(energy, crumpled.position_m);
  const Eigen::Matrix3Xd expected_product =
      product_at(energy, crumpled.position_m, Curvature::clamped, direction);

  for (const InstructionSet& set : instruction_sets()) {
    for (const size_t threads : {1, 3}) {
      SCOPED_TRACE(testing::Message() << set << ", " << threads << " threads");
      const OnInstructionSet on(set);
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      EXPECT_EQ(energy_at(energy, crumpled.position_m), expected_energy);
      EXPECT_EQ(gradient_at(energy, crumpled.position_m), expected_gradient);
      EXPECT_EQ(product_at(energy, crumpled.position_m, Curvature::clamped, direction),
                expected_product);
    }
  }
}

}  // namespace
}  // namespace clothfit
