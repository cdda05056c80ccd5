#include <cmath>

#include "model/cloth/wording.h"
#include "model/effects/vertex_law.h"

/// Adds drag that grows with the square of the speed, normal to the surface and along it. At every
/// vertex
///
///   F = -A/2 (c_n |v_n| v_n + c_t |v_t| v_t),  v_n = (n . v) n,  v_t = v - v_n
///
/// Source: the drag equation F = rho c A v^2 / 2 of every text on fluids, once for each direction.
/// The coefficients c_n, c_t here are rho c (kg/m3), the air's density included; both are neutral
/// at 0. A is the area that belongs to the vertex, n its unit normal. The force is smooth: |v| v
/// has a derivative at rest.
namespace clothfit::quadratic_drag {
namespace {
struct Law {
  static constexpr int kParameters = 2;
  static constexpr LooksAt kLooksAt{.velocity = true, .area = true};

  template <class Real>
  static Vector3<Real> force(const VertexSight<Real>& at, const std::array<Real, 2>& c) {
    using std::sqrt;
    const Vector3<Real> n = direction(at.area_m2);
    const Vector3<Real>& v = at.velocity_m_per_s;
    const Real normal = dot(n, v);
    const Real normal_speed = select(normal > Real(0.0), normal, -normal);
    const Vector3<Real> tangential = v - normal * n;
    // Where the root's derivative is infinite it must not be taken.
    const Real square = dot(tangential, tangential);
    const auto some = square > Real(1e-30);
    const Real tangential_speed = select(some, sqrt(select(some, square, Real(1.0))), Real(0.0));
    const Real half_area = Real(-0.5) * dot(at.area_m2, n);
    return half_area * (c[0] * normal_speed * normal * n + c[1] * tangential_speed * tangential);
  }

  static EffectRates rates(const Cloth& cloth, const SpringParameters&,
                           const std::vector<double>& parameters) {
    constexpr double kFastest_m_per_s = 20;  // of the tip of a cracking cloth
    return {.damping_per_s = std::max(parameters[0], parameters[1]) * kFastest_m_per_s *
                             largest_area_per_mass(cloth)};
  }
};

/// A cloth of sigma (kg/m2) falls at sqrt(2 sigma g / c): flat with c_n, edge-on with c_t. Over the
/// density of air the coefficients are those of drag.
std::string in_words(const FittedEffect& found) {
  const bool flat = found.mode != "tangential";
  const double c_kg_per_m3 = found.value(flat ? "c_n" : "c_t");
  if (!(c_kg_per_m3 > 0 && found.gravity() > 0)) return {};
  return "drag coefficient " + rounded(c_kg_per_m3 / kAirDensity_kg_per_m3) +
         " in air: " + (flat ? "lying flat" : "edge-on") + ", the cloth falls at " +
         rounded(std::sqrt(2 * found.weight_pa() / c_kg_per_m3)) + " m/s at most";
}

}  // namespace

EffectDescription describe() {
  return {
      .name = "quadratic_drag",
      .summary = "drag with the square of the speed, F = -A/2 (c_n |v_n| v_n + c_t |v_t| v_t)",
      .parameters =
          {{.name = "c_n", .unit = "kg/m3", .neutral = 0, .lower = 0, .upper = 10, .typical = 0.1},
           {.name = "c_t", .unit = "kg/m3", .neutral = 0, .lower = 0, .upper = 2, .typical = 0.02}},
      .modes = {{.name = "normal", .amplitudes = {"c_n"}, .shapes = {}},
                {.name = "tangential", .amplitudes = {"c_t"}, .shapes = {}}},
      .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::quadratic_drag
