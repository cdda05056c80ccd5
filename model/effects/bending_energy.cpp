#include <algorithm>
#include <cmath>

#include "model/cloth/wording.h"
#include "model/effects/stencil_law.h"

/// Resists bending as a plate without lateral contraction does (Poisson's ratio 0):
///
///   E = B / 2 integral (x_ss^2 + x_tt^2 + 2 x_st^2) dA
///
/// over the flat cloth, x the place of the point (s, t). For cloth that keeps its lengths this is B
/// / 2 times the sum of the squared curvatures. Second differences are taken along rows and columns
/// at every vertex that has both neighbours, mixed differences in every cell; free edges carry no
/// moment. The energy is a quadratic form of differences, so the forces are linear in the positions
/// and the energy does not change when the cloth is moved or turned. Unlike the flexion springs it
/// does not vanish on refinement. Parameter: B (N m), neutral at 0. The discretisation is ours.
namespace clothfit::bending_energy {
namespace {

/// The energy is E = B / 2 sum |q|^2 over places. q, a sum of constants times positions, is a
/// second difference times the root of the area that it stands for.
struct Law {
  static constexpr int kParameters = 1, kVertices = 4;

  template <class Visit>
  static void for_stencils(const Cloth& cloth, const Visit& visit) {
    const Mesh& mesh = cloth.mesh;
    const double a_s = mesh.spacing_s_m(), a_t = mesh.spacing_t_m(), cell_m2 = a_s * a_t;
    // An edge vertex stands for half a cell across the edge.
    const auto second_difference = [&](int before, int here, int after, double spacing_m,
                                       bool at_edge) {
      const double c = std::sqrt(at_edge ? 0.5 * cell_m2 : cell_m2) / (spacing_m * spacing_m);
      visit(Stencil<4>{{before, here, after, here}, {c, -2 * c, c, 0}});
    };
    for (int i = 0; i < mesh.rows; ++i)
      for (int j = 1; j < mesh.columns - 1; ++j)
        second_difference(mesh.vertex(i, j - 1), mesh.vertex(i, j), mesh.vertex(i, j + 1), a_s,
                          i % (mesh.rows - 1) == 0);
    for (int i = 1; i < mesh.rows - 1; ++i)
      for (int j = 0; j < mesh.columns; ++j)
        second_difference(mesh.vertex(i - 1, j), mesh.vertex(i, j), mesh.vertex(i + 1, j), a_t,
                          j % (mesh.columns - 1) == 0);
    const double c = std::sqrt(2 * cell_m2) / cell_m2;
    for (int i = 0; i < mesh.rows - 1; ++i)
      for (int j = 0; j < mesh.columns - 1; ++j)
        visit(Stencil<4>{{mesh.vertex(i, j), mesh.vertex(i, j + 1), mesh.vertex(i + 1, j),
                          mesh.vertex(i + 1, j + 1)},
                         {c, -c, -c, c}});
  }

  template <class Real>
  static std::array<Vector3<Real>, 4> forces(const std::array<Vector3<Real>, 4>& x,
                                             const std::array<double, 4>& c,
                                             const std::array<Real, 1>& b_nm) {
    const Vector3<Real> moment =
        b_nm[0] * (Real(c[0]) * x[0] + Real(c[1]) * x[1] + Real(c[2]) * x[2] + Real(c[3]) * x[3]);
    return {Real(-c[0]) * moment, Real(-c[1]) * moment, Real(-c[2]) * moment, Real(-c[3]) * moment};
  }

  /// The frequency is bounded by the largest row sum of M^-1 K (Gershgorin); K is the same in every
  /// shape of the cloth.
  static EffectRates rates(const Cloth& cloth, const SpringParameters&,
                           const std::vector<double>& b_nm) {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(cloth.mesh.vertex_count());
    for_stencils(cloth, [&](const Stencil<4>& stencil) {
      double sum = 0;
      for (const double c : stencil.constants) sum += std::abs(c);
      for (size_t v = 0; v < 4; ++v) row[stencil.vertex[v]] += std::abs(stencil.constants[v]) * sum;
    });
    return {.frequency2_per_s2 = b_nm[0] * row.cwiseQuotient(cloth.mass_kg).maxCoeff()};
  }
};

/// A strip that is clamped at one end sags by w L^4 / (8 B), w its weight per area, while its slope
/// is small. Tells at which length L that is a tenth of L.
std::string in_words(const FittedEffect& found) {
  constexpr double kSag = 0.1;
  const double b_nm = found.value("B");
  if (!(b_nm > 0 && found.weight_pa() > 0)) return {};
  return "by this alone, a strip of " +
         millimetres(std::cbrt(8 * b_nm * kSag / found.weight_pa())) +
         " that is clamped at one end sags by a tenth of that";
}

}  // namespace

EffectDescription describe() {
  return {
      .name = "bending_energy",
      .summary = "bending stiffness of a plate, E = B/2 int x_ss^2 + x_tt^2 + 2 x_st^2 dA",
      .parameters =
          {{.name = "B", .unit = "N m", .neutral = 0, .lower = 0, .upper = 1e-3, .typical = 1e-5}},
      .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<StencilLawEffect<Law>>();
}

}  // namespace clothfit::bending_energy
