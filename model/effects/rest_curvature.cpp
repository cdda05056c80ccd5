#include <algorithm>
#include <cmath>

#include "model/effects/stencil_law.h"

/// Gives the cloth a curvature at rest, as of one that was rolled up for long:
///
///   E = -integral (m_s x_ss . n + m_t x_tt . n) dA
///
/// over the flat cloth, n the unit normal (along s x t). With a bending stiffness B (effect
/// bending_energy) a free strip curls to the curvature m / B, towards n where m > 0; without one
/// nothing in the fabric balances the moment. Differences are as in bending_energy, n from the
/// differences to the neighbours. Forces are minus the derivative of the discrete energy, so they
/// sum to zero and exert no torque. Parameters: m_s, m_t (N, a moment per length), neutral at 0.
/// Ours.
namespace clothfit::rest_curvature {
namespace {

/// A vertex, and its neighbours before and behind along s, then along t; the vertex itself where
/// there is none. E = -W . n with W = m_s (x1 - 2 x0 + x2) c0 + m_t (x3 - 2 x0 + x4) c1 and n along
/// (x2 - x1) x (x4 - x3); the constants are the area per squared spacing, 0 at an edge.
struct Law {
  static constexpr int kParameters = 2, kVertices = 5;

  template <class Visit>
  static void for_stencils(const Cloth& cloth, const Visit& visit) {
    const Mesh& mesh = cloth.mesh;
    const double a_s = mesh.spacing_s_m(), a_t = mesh.spacing_t_m();
    for (int i = 0; i < mesh.rows; ++i) {
      for (int j = 0; j < mesh.columns; ++j) {
        const bool end_s = j % (mesh.columns - 1) == 0, end_t = i % (mesh.rows - 1) == 0;
        if (end_s && end_t) continue;
        const double area_m2 = a_s * a_t * (end_s || end_t ? 0.5 : 1.0);
        visit(Stencil<5>{
            {mesh.vertex(i, j), mesh.vertex(i, std::max(j - 1, 0)),
             mesh.vertex(i, std::min(j + 1, mesh.columns - 1)), mesh.vertex(std::max(i - 1, 0), j),
             mesh.vertex(std::min(i + 1, mesh.rows - 1), j)},
            {end_s ? 0 : area_m2 / (a_s * a_s), end_t ? 0 : area_m2 / (a_t * a_t), 0, 0}});
      }
    }
  }

  template <class Real>
  static std::array<Vector3<Real>, 5> forces(const std::array<Vector3<Real>, 5>& x,
                                             const std::array<double, 4>& c,
                                             const std::array<Real, 2>& m_n) {
    using std::sqrt;
    const Real along_s = Real(c[0]) * m_n[0], along_t = Real(c[1]) * m_n[1];
    const Vector3<Real> w =
        along_s * (x[1] - x[0] + (x[2] - x[0])) + along_t * (x[3] - x[0] + (x[4] - x[0]));
    const Vector3<Real> p = x[2] - x[1], q = x[4] - x[3], pq = cross(p, q);
    // A surface that is folded to nothing has no normal to curve towards.
    const Real square = dot(pq, pq);
    const auto some = square > Real(1e-30);
    const Real inverse = select(some, Real(1.0) / sqrt(select(some, square, Real(1.0))), Real(0.0));
    const Vector3<Real> n = inverse * pq;
    // d(W . n) = dW . n + g . (dp x q + p x dq),  g = (W - n n . W) / |p x q|
    const Vector3<Real> g = inverse * (w - dot(n, w) * n);
    const Vector3<Real> turn_s = cross(q, g), turn_t = cross(g, p);
    return {Real(-2.0) * (along_s + along_t) * n, along_s * n - turn_s, along_s * n + turn_s,
            along_t * n - turn_t, along_t * n + turn_t};
  }

  /// The largest part of the energy's second derivative is dW . dn. |dn| is at most |dp| / (2 a_s)
  /// + |dq| / (2 a_t) in a cell that is not folded; row sums are as for bending_energy. Folded
  /// cells turn more easily: twice that.
  static EffectRates rates(const Cloth& cloth, const SpringParameters&,
                           const std::vector<double>& m_n) {
    constexpr double kFolded = 2;
    const Mesh& mesh = cloth.mesh;
    Eigen::VectorXd row = Eigen::VectorXd::Zero(mesh.vertex_count());
    for_stencils(cloth, [&](const Stencil<5>& stencil) {
      const double w_s = std::abs(m_n[0]) * stencil.constants[0],
                   w_t = std::abs(m_n[1]) * stencil.constants[1];
      const auto span = [&](size_t a, size_t b, double flat_m) {
        return (stencil.vertex[a] == stencil.vertex[0] || stencil.vertex[b] == stencil.vertex[0]
                    ? 1
                    : 0.5) /
               flat_m;
      };
      const double n_s = span(1, 2, mesh.spacing_s_m()), n_t = span(3, 4, mesh.spacing_t_m());
      const std::array<double, 5> w{2 * (w_s + w_t), w_s, w_s, w_t, w_t}, n{0, n_s, n_s, n_t, n_t};
      double sum_w = 0, sum_n = 0;
      for (size_t v = 0; v < 5; ++v) {
        sum_w += w[v];
        sum_n += n[v];
      }
      for (size_t v = 0; v < 5; ++v) row[stencil.vertex[v]] += w[v] * sum_n + n[v] * sum_w;
    });
    return {.frequency2_per_s2 = kFolded * row.cwiseQuotient(cloth.mass_kg).maxCoeff()};
  }
};

}  // namespace

EffectDescription describe() {
  const auto moment = [](const char* name) {
    return EffectParameter{
        .name = name, .unit = "N", .neutral = 0, .lower = -1e-2, .upper = 1e-2, .typical = 1e-4};
  };
  return {.name = "rest_curvature",
          .summary = "a cloth that wants to be curved, E = -int m_s x_ss . n + m_t x_tt . n dA",
          .parameters = {moment("m_s"), moment("m_t")}};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<StencilLawEffect<Law>>();
}

}  // namespace clothfit::rest_curvature
