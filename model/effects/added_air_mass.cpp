#include "model/cloth/wording.h"
#include "model/effects/vertex_law.h"

/// Adds the inertia of air that moves along with the surface. It is a mass mu A beside the vertex's
/// own, in the direction of the normal only. The sum F of all forces but the weight m g becomes
///
///   F' = F - (mu A / (m + mu A)) n [n . (F + m g)]
///
/// so that the acceleration g + F'/m is (F + m g) / (m + mu A) along n and (F + m g) / m across it:
/// air has inertia and, floating in air, no weight. Ours; the force by which air resists the
/// turning of its own momentum with the surface is left out, which is of second order in the
/// velocity. A is the area that belongs to the vertex, n its unit normal. Parameter: mu (kg/m2),
/// neutral at 0. For a rigid disc of radius a in air of density rho it is 8 rho a / (3 pi) on
/// average.
namespace clothfit::added_air_mass {
namespace {
struct Law {
  static constexpr int kParameters = 1;
  static constexpr LooksAt kLooksAt{.area = true, .gravity = true, .mass = true};

  template <class Real>
  static Vector3<Real> change(const VertexSight<Real>& at, const Vector3<Real>& force_n,
                              const std::array<Real, 1>& mu_kg_per_m2) {
    const Vector3<Real> n = direction(at.area_m2);
    const Real& mass = at.mass_kg;
    const Real air = mu_kg_per_m2[0] * dot(at.area_m2, n);
    const Real along = dot(n, force_n + mass * at.gravity_m_per_s2);
    return force_n - air / (mass + air) * along * n;
  }

  /// More inertia only slows accelerations.
  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

/// mu over the density of air is the thickness of a layer of as much air.
std::string in_words(const FittedEffect& found) {
  const double mu_kg_per_m2 = found.value("mu");
  if (!(mu_kg_per_m2 > 0)) return {};
  return "air of " + rounded(mu_kg_per_m2 / found.areal_density_kg_per_m2()) +
         " times the cloth's mass moves along with it, as a layer of " +
         millimetres(mu_kg_per_m2 / kAirDensity_kg_per_m3);
}

}  // namespace

EffectDescription describe() {
  return {
      .name = "added_air_mass",
      .summary =
          "inertia of air along the surface's normal, F' = F - mu A / (m + mu A) n [n . (F + m g)]",
      .parameters =
          {{.name = "mu", .unit = "kg/m2", .neutral = 0, .lower = 0, .upper = 2, .typical = 0.02}},
      .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<InertiaLawEffect<Law>>();
}

}  // namespace clothfit::added_air_mass
