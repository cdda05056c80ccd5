#include "model/effects/nonuniform_mass.h"

#include "model/effects/vertex_law.h"

namespace clothfit::nonuniform_mass {
namespace {
enum Parameter { hem, hem_width, gradient_s, gradient_t, patch, patch_s, patch_t, patch_radius };

/// The share of the cell around place `x_m` of a side with vertices every `spacing_m` that lies
/// within `band_m` of the side's ends.
template <class Real>
Real band_share(double x_m, double side_m, double spacing_m, const Real& band_m) {
  const double from = std::max(0.0, x_m - 0.5 * spacing_m);
  const double to = std::min(side_m, x_m + 0.5 * spacing_m);
  const Real length(to - from);
  const auto within_cell = [&](const Real& covered) {
    const Real some = select(covered > Real(0.0), covered, Real(0.0));
    return select(some < length, some, length);
  };
  const Real covered = within_cell(band_m - Real(from)) + within_cell(band_m - Real(side_m - to));
  return select(covered < length, covered, length) / length;
}

struct Law {
  static constexpr int kParameters = 8;

  /// The mass at a vertex over its stated mass.
  template <class Real>
  static Real relative_mass(const Mesh& mesh, double s, double t, const std::array<Real, 8>& p) {
    const Real one(1.0);
    const Real at_sides =
        band_share(s * mesh.width_m, mesh.width_m, mesh.spacing_s_m(), p[hem_width]);
    const Real at_ends =
        band_share(t * mesh.height_m, mesh.height_m, mesh.spacing_t_m(), p[hem_width]);
    const Real in_hem = one - (one - at_sides) * (one - at_ends);

    const Real right_m = Real(mesh.width_m) * (Real(s) - p[patch_s]);
    const Real down_m = Real(mesh.height_m) * (Real(t) - p[patch_t]);
    const Real radius_m = p[patch_radius];
    const Real inside = one - (right_m * right_m + down_m * down_m) / (radius_m * radius_m);
    const Real bump = select(inside > Real(0.0), inside * inside * inside, Real(0.0));

    return (one + p[hem] * in_hem) * (one + p[gradient_s] * Real(s - 0.5)) *
           (one + p[gradient_t] * Real(t - 0.5)) * (one + p[patch] * bump);
  }

  template <class Real>
  static Vector3<Real> change(const VertexSight<Real>& at, const Vector3<Real>& force_n,
                              const std::array<Real, 8>& p) {
    return Real(1.0) / relative_mass(*at.mesh, at.s, at.t, p) * force_n;
  }

  static EffectRates rates(const Cloth& cloth, const SpringParameters&,
                           const std::vector<double>& parameters) {
    std::array<double, kParameters> p;
    std::ranges::copy(parameters, p.begin());
    double lightest = 1;
    for (int i = 0; i < cloth.mesh.rows; ++i)
      for (int j = 0; j < cloth.mesh.columns; ++j)
        lightest = std::min(lightest, relative_mass(cloth.mesh, j / (cloth.mesh.columns - 1.0),
                                                    i / (cloth.mesh.rows - 1.0), p));
    return {.acceleration_ratio = 1 / lightest};
  }
};

}  // namespace

EffectDescription describe() {
  return {.name = "nonuniform_mass",
          .summary = "mass that is not spread as stated, F' = F / r(s, t)",
          .parameters = {{.name = "hem",
                          .unit = "ratio",
                          .neutral = 0,
                          .lower = -0.5,
                          .upper = 4,
                          .typical = 0.1},
                         {.name = "hem_width",
                          .unit = "m",
                          .neutral = 0.01,
                          .lower = 0.001,
                          .upper = 0.1,
                          .typical = 0.001},
                         {.name = "gradient_s",
                          .unit = "ratio",
                          .neutral = 0,
                          .lower = -1,
                          .upper = 1,
                          .typical = 0.05},
                         {.name = "gradient_t",
                          .unit = "ratio",
                          .neutral = 0,
                          .lower = -1,
                          .upper = 1,
                          .typical = 0.05},
                         {.name = "patch",
                          .unit = "ratio",
                          .neutral = 0,
                          .lower = -0.5,
                          .upper = 4,
                          .typical = 0.1},
                         {.name = "patch_s",
                          .unit = "ratio",
                          .neutral = 0.5,
                          .lower = 0,
                          .upper = 1,
                          .typical = 0.02},
                         {.name = "patch_t",
                          .unit = "ratio",
                          .neutral = 0.5,
                          .lower = 0,
                          .upper = 1,
                          .typical = 0.02},
                         {.name = "patch_radius",
                          .unit = "m",
                          .neutral = 0.1,
                          .lower = 0.02,
                          .upper = 1,
                          .typical = 0.01}},
          .test = EffectTest::profiled,
          .laws = {{.name = "hem",
                    .amplitudes = {"hem"},
                    .shapes = {{.parameter = "hem_width", .values = {0.005, 0.01, 0.02, 0.04}}}},
                   {.name = "gradient", .amplitudes = {"gradient_s", "gradient_t"}, .shapes = {}},
                   {.name = "patch",
                    .amplitudes = {"patch"},
                    .shapes = {{.parameter = "patch_s", .values = {0.2, 0.5, 0.8}},
                               {.parameter = "patch_t", .values = {0.2, 0.5, 0.8}},
                               {.parameter = "patch_radius", .values = {0.05, 0.12}}}}}};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<InertiaLawEffect<Law>>();
}

}  // namespace clothfit::nonuniform_mass
