// Checks second differences over flat cloth of any outline, and the energy made of them. Not
// checked here: sheets that bend under their weight (laboratory/cantilever_test.cpp).

#include "model/sheet/plate_bending.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/model/measured_cloth.h"

namespace clothfit {
namespace {

ClothMesh ring(double spacing_m) {
  return mesh_cloth(
      {.border_m = {circle_m(0.1, spacing_m), circle_m(0.04, spacing_m)}, .line_m = {}}, spacing_m);
}

double energy_j(const BendingMatrix& bending, const Eigen::VectorXd& field_m) {
  return 0.5 * (bending * field_m).squaredNorm();
}

template <class Field>
Eigen::VectorXd sample(const ClothMesh& mesh, const Field& field) {
  Eigen::VectorXd values(mesh.vertex_count());
  for (int v = 0; v < mesh.vertex_count(); ++v)
    values[v] = field(mesh.material_m(0, v), mesh.material_m(1, v));
  return values;
}

TEST(PlateBending, OfAQuadraticFieldIsExactWhateverTheOutline) {
  const ClothMesh mesh = ring(0.01);
  const double ss = 3, st = -2, tt = 0.7;

  const double found =
      energy_j(bending_matrix(mesh, kMeasuredCloth), sample(mesh, [&](double s, double t) {
                 return 0.4 + s - 2 * t + 0.5 * ss * s * s + st * s * t + 0.5 * tt * t * t;
               }));

  const double mean = std::sqrt(kMeasuredCloth.bending_warp_n_m * kMeasuredCloth.bending_weft_n_m);
  const double expected = 0.5 * mesh.total_area_m2() *
                          (kMeasuredCloth.bending_weft_n_m * ss * ss +
                           kMeasuredCloth.bending_warp_n_m * tt * tt + 2 * mean * st * st);
  EXPECT_NEAR(found / expected, 1, 1e-9);
}

TEST(PlateBending, DoesNotFeelRigidMotions) {
  const ClothMesh mesh = ring(0.01);

  const Eigen::VectorXd bent = bending_matrix(mesh, kMeasuredCloth) *
                               sample(mesh, [](double s, double t) { return 1 + s - 3 * t; });

  EXPECT_LT(bent.norm(), 1e-11);
}

TEST(PlateBending, OfASmoothFieldErrsByLessOnFinerMeshes) {
  // The integral of B_s x_ss^2 + B_t x_tt^2 + 2 B_st x_st^2 for x = sin(a s) sin(b t), summed on a
  // fine lattice of points.
  const double a = 30, b = 20;
  const auto error = [&](double spacing_m) {
    const ClothMesh mesh = ring(spacing_m);
    const double found = energy_j(
        bending_matrix(mesh, kMeasuredCloth),
        sample(mesh, [&](double s, double t) { return std::sin(a * s) * std::sin(b * t); }));
    double sum = 0;
    constexpr int kPoints = 1000;
    const double step_m = 0.2 / kPoints;
    for (int i = 0; i < kPoints; ++i)
      for (int j = 0; j < kPoints; ++j) {
        const double s = (j + 0.5) * step_m - 0.1, t = (i + 0.5) * step_m - 0.1;
        if (std::hypot(s, t) > 0.1 || std::hypot(s, t) < 0.04) continue;
        const double x = std::sin(a * s) * std::sin(b * t), y = std::cos(a * s) * std::cos(b * t);
        sum += kMeasuredCloth.bending_weft_n_m * std::pow(a * a * x, 2) +
               kMeasuredCloth.bending_warp_n_m * std::pow(b * b * x, 2) +
               2 * std::sqrt(kMeasuredCloth.bending_weft_n_m * kMeasuredCloth.bending_warp_n_m) *
                   std::pow(a * b * y, 2);
      }
    return std::abs(found / (0.5 * sum * step_m * step_m) - 1);
  };

  const double coarse = error(0.01), fine = error(0.005);

  EXPECT_LT(coarse, 0.1);
  EXPECT_LT(fine, 0.5 * coarse);
}

TEST(PlateBending, OfAClampedEdgeKnowsTheSlopeThere) {
  const ClothMesh mesh = ring(0.01);
  std::vector<bool> clamped;
  for (const auto& vertex : mesh.material_m.colwise()) clamped.push_back(vertex.norm() < 0.0401);
  // Beyond a straight clamp at s = 0.04 cos(..) no field is quadratic; about the whole inner circle
  // one that starts level there is not, either. A point of the circle is enough.
  const Eigen::Vector2d at = mesh.material_m.col(mesh.border[1].front());
  const double ss = 5, st = 1, tt = -2;
  const Eigen::VectorXd field = sample(mesh, [&](double s, double t) {
    const double ds = s - at.x(), dt = t - at.y();
    return 0.5 * ss * ds * ds + st * ds * dt + 0.5 * tt * dt * dt;
  });

  int found = 0;
  for (const SecondDifference& difference : second_differences(mesh, clamped)) {
    if (difference.vertex.back() != mesh.border[1].front()) continue;
    double value = 0;
    for (size_t k = 0; k < difference.vertex.size(); ++k)
      value += difference.per_m2[k] * field[difference.vertex[k]];
    const double expected = difference.of == SecondDifference::weft   ? ss
                            : difference.of == SecondDifference::warp ? tt
                                                                      : st;
    EXPECT_NEAR(value, expected, 1e-9);
    ++found;
  }
  EXPECT_EQ(found, 3);
}

}  // namespace
}  // namespace clothfit
