// Checks the grid of masses, its springs and the distribution of a cloth's mass on it. Not checked
// here: the springs' pull (cloth_sweep_test.cpp) and the surface between the vertices
// (surface_test.cpp).

#include "model/topology/mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <utility>

namespace clothfit {
namespace {

using Ends = std::set<std::pair<int, int>>;

Ends ends(const std::vector<Spring>& springs) {
  Ends result;
  for (const Spring& spring : springs) result.insert(std::minmax(spring.a, spring.b));
  return result;
}

/// Finds pairs of vertices whose rows and columns differ as `linked` says, by trying all pairs.
Ends pairs(const Mesh& mesh, const std::function<bool(int di, int dj)>& linked) {
  Ends result;
  for (int p = 0; p < mesh.vertex_count(); ++p) {
    for (int q = p + 1; q < mesh.vertex_count(); ++q) {
      const int di = q / mesh.columns - p / mesh.columns;
      const int dj = q % mesh.columns - p % mesh.columns;
      if (linked(di, dj)) result.insert({p, q});
    }
  }
  return result;
}

double moment(const Mesh& mesh, const Eigen::VectorXd& masses,
              const std::function<double(double s, double t)>& f) {
  const Eigen::Matrix3Xd flat = flat_positions(mesh);
  double sum = 0;
  for (Eigen::Index k = 0; k < masses.size(); ++k) sum += masses[k] * f(flat(0, k), flat(1, k));
  return sum;
}

TEST(Mesh, HasTheSixSpringTypesOfTheFoundingPaper) {
  for (const auto& [columns, rows] : {std::pair{2, 2}, {2, 5}, {3, 2}, {3, 3}, {6, 4}, {17, 17}}) {
    SCOPED_TRACE(testing::Message() << columns << " x " << rows);
    const Mesh mesh{.columns = columns, .rows = rows, .width_m = 0.3, .height_m = 0.2};

    const SpringNet net = make_springs(mesh);

    EXPECT_EQ(ends(net[structural_t]), pairs(mesh, [](int i, int j) { return i == 1 && j == 0; }));
    EXPECT_EQ(ends(net[structural_s]), pairs(mesh, [](int i, int j) { return i == 0 && j == 1; }));
    EXPECT_EQ(ends(net[shear_down]), pairs(mesh, [](int i, int j) { return i == 1 && j == 1; }));
    EXPECT_EQ(ends(net[shear_up]), pairs(mesh, [](int i, int j) { return i == 1 && j == -1; }));
    EXPECT_EQ(ends(net[flexion_t]), pairs(mesh, [](int i, int j) { return i == 2 && j == 0; }));
    EXPECT_EQ(ends(net[flexion_s]), pairs(mesh, [](int i, int j) { return i == 0 && j == 2; }));
    const auto count = [&](SpringType type) { return static_cast<int>(net[type].size()); };
    EXPECT_EQ(count(structural_t), (rows - 1) * columns);  // and no spring twice
    EXPECT_EQ(count(structural_s), rows * (columns - 1));
    EXPECT_EQ(count(shear_down), (rows - 1) * (columns - 1));
    EXPECT_EQ(count(shear_up), (rows - 1) * (columns - 1));
    EXPECT_EQ(count(flexion_t), (rows - 2) * columns);
    EXPECT_EQ(count(flexion_s), rows * (columns - 2));
  }
}

TEST(Mesh, ListsTheSpringsOfATypeInTheOrderOfTheirFirstVertex) {
  const SpringNet net = make_springs({.columns = 5, .rows = 7, .width_m = 1, .height_m = 1});

  for (const std::vector<Spring>& springs : net)
    EXPECT_TRUE(std::ranges::is_sorted(springs, {}, &Spring::a));
}

TEST(Mesh, SpringsOfTheFlatClothHaveTheFlatLengths) {
  const Mesh mesh{.columns = 7, .rows = 5, .width_m = 0.3, .height_m = 0.5};

  const SpringNet net = make_springs(mesh);
  const auto length = flat_lengths(mesh);
  const Eigen::Matrix3Xd flat = flat_positions(mesh);

  for (size_t type = 0; type < kSpringTypes; ++type)
    for (const Spring& spring : net[type])
      EXPECT_NEAR((flat.col(spring.b) - flat.col(spring.a)).norm(), length[type], 1e-15);
  EXPECT_DOUBLE_EQ(length[structural_t], 0.5 / 4);
  EXPECT_DOUBLE_EQ(length[structural_s], 0.3 / 6);
}

TEST(Mesh, FlatClothSpansItsSizeInItsOwnPlane) {
  const Mesh mesh{.columns = 7, .rows = 5, .width_m = 0.3, .height_m = 0.5};

  const Eigen::Matrix3Xd flat = flat_positions(mesh);

  EXPECT_EQ(Eigen::Vector3d(flat.col(mesh.vertex(0, 0))), Eigen::Vector3d(0, 0, 0));
  EXPECT_LT((flat.col(mesh.vertex(0, 6)) - Eigen::Vector3d(0.3, 0, 0)).norm(), 1e-15);
  EXPECT_LT((flat.col(mesh.vertex(4, 0)) - Eigen::Vector3d(0, 0.5, 0)).norm(), 1e-15);
  EXPECT_EQ(flat.row(2).cwiseAbs().maxCoeff(), 0);
}

TEST(MassesByArea, GiveAnEdgeHalfAndACornerAQuarterOfAnInnerVertex) {
  const Mesh mesh{.columns = 5, .rows = 4, .width_m = 0.3, .height_m = 0.5};

  const Eigen::VectorXd masses = masses_by_area(mesh, 0.12);

  EXPECT_NEAR(masses.sum(), 0.12, 1e-16);
  const double inner = 0.12 / (4 * 3);
  EXPECT_DOUBLE_EQ(masses[mesh.vertex(1, 1)], inner);
  EXPECT_DOUBLE_EQ(masses[mesh.vertex(0, 2)], inner / 2);
  EXPECT_DOUBLE_EQ(masses[mesh.vertex(2, 4)], inner / 2);
  EXPECT_DOUBLE_EQ(masses[mesh.vertex(3, 4)], inner / 4);
}

TEST(MassesByArea, HaveTheMomentsOfAUniformSheet) {
  const Mesh mesh{.columns = 9, .rows = 4, .width_m = 0.3, .height_m = 0.5};
  const double w = mesh.width_m, h = mesh.height_m;

  const Eigen::VectorXd masses = masses_by_area(mesh, 2.0);

  // Sums over these masses are the trapezoidal rule, exact for f bilinear in s and t.
  EXPECT_NEAR(moment(mesh, masses, [](double s, double) { return s; }), 2.0 * w / 2, 1e-15);
  EXPECT_NEAR(moment(mesh, masses, [](double, double t) { return t; }), 2.0 * h / 2, 1e-15);
  EXPECT_NEAR(moment(mesh, masses, [](double s, double t) { return s * t; }), 2.0 * w * h / 4,
              1e-15);
  // For s^2 over n cells the rule gives W^2 / 3 (1 + 1 / (2 n^2)).
  EXPECT_NEAR(moment(mesh, masses, [](double s, double) { return s * s; }),
              2.0 * w * w / 3 * (1 + 1 / (2.0 * 8 * 8)), 1e-15);
}

TEST(MassesEqual, AreEqualOnTheirOwnMesh) {
  for (const auto& [columns, rows] : {std::pair{2, 2}, {3, 2}, {17, 17}, {7, 30}}) {
    SCOPED_TRACE(testing::Message() << columns << " x " << rows);
    const Mesh mesh{.columns = columns, .rows = rows, .width_m = 0.3, .height_m = 0.5};

    const Eigen::VectorXd masses = masses_equal(mesh, mesh, 0.025);

    const double equal = 0.025 / mesh.vertex_count();
    // A mass is put together from an area's, two lines' and a corner's share: a few roundings.
    EXPECT_LT((masses.array() - equal).abs().maxCoeff(), 2e-15 * equal);
  }
}

TEST(MassesEqual, KeepTheirDistributionOverTheClothOnAnotherMesh) {
  // Given the reference as a plate of m0 per cell, its border as bars of m0 / 2 per spacing and its
  // corners as points of m0 / 4,
  const Mesh reference{.columns = 9, .rows = 5, .width_m = 0.3, .height_m = 0.5};
  const double w = reference.width_m, h = reference.height_m, mass = 0.025;
  const double m0 = mass / (9 * 5);
  const double plate = m0 * 8 * 4, bar_s = m0 / 2 * 8, bar_t = m0 / 2 * 4, point = m0 / 4;

  for (const auto& [columns, rows] : {std::pair{2, 2}, {3, 8}, {17, 9}, {9, 5}, {40, 40}}) {
    SCOPED_TRACE(testing::Message() << columns << " x " << rows);
    const Mesh mesh{.columns = columns, .rows = rows, .width_m = w, .height_m = h};

    // when it is carried to another mesh of the same cloth,
    const Eigen::VectorXd masses = masses_equal(mesh, reference, mass);

    // then total and first moments are the cloth's, and so is the product moment, up to the
    // rounding of a sum over all vertices;
    EXPECT_NEAR(masses.sum(), mass, 1e-14 * mass);
    EXPECT_NEAR(moment(mesh, masses, [](double s, double) { return s; }), mass * w / 2,
                1e-14 * mass);
    EXPECT_NEAR(moment(mesh, masses, [](double, double t) { return t; }), mass * h / 2,
                1e-14 * mass);
    EXPECT_NEAR(moment(mesh, masses, [](double s, double t) { return s * t; }), mass * w * h / 4,
                1e-14 * mass);
    // the second moments differ by the trapezoidal rule's excess for a square.
    const double excess_s = 1 + 1 / (2.0 * (columns - 1) * (columns - 1));
    const double excess_t = 1 + 1 / (2.0 * (rows - 1) * (rows - 1));
    EXPECT_NEAR(moment(mesh, masses, [](double s, double) { return s * s; }),
                w * w * ((plate + 2 * bar_s) / 3 * excess_s + bar_t + 2 * point), 1e-14 * mass);
    EXPECT_NEAR(moment(mesh, masses, [](double, double t) { return t * t; }),
                h * h * ((plate + 2 * bar_t) / 3 * excess_t + bar_s + 2 * point), 1e-14 * mass);
  }
}

TEST(MassesEqual, BorderWeighsMoreThanByArea) {
  const Mesh mesh{.columns = 9, .rows = 9, .width_m = 0.4, .height_m = 0.4};

  const Eigen::VectorXd equal = masses_equal(mesh, mesh, 0.025);
  const Eigen::VectorXd by_area = masses_by_area(mesh, 0.025);

  EXPECT_GT(equal[mesh.vertex(0, 0)], 3 * by_area[mesh.vertex(0, 0)]);
  EXPECT_LT(equal[mesh.vertex(4, 4)], by_area[mesh.vertex(4, 4)]);
}

}  // namespace
}  // namespace clothfit
