#include "model/cloth/wording.h"
#include "model/effects/contact_law.h"
#include "model/effects/vertex_law.h"

/// Keeps the cloth out of a ball. A vertex at x is depth = radius - |x - centre| inside it and
/// feels the force of contact_law.h along n = (x - centre) / |x - centre|.
///
/// Parameters: stiffness (Pa/m), damping (Pa s/m), friction (ratio), neutral at 0; centre_x,
/// centre_y, centre_z, radius (m), which matter only where stiffness or damping do.
namespace clothfit::contact_sphere {
namespace {
struct Law {
  static constexpr int kParameters = Contact::kParameters + 4;
  static constexpr LooksAt kLooksAt{.position = true, .velocity = true, .mass = true};

  template <class Real>
  static Vector3<Real> force(const VertexSight<Real>& at, const std::array<Real, kParameters>& p) {
    const Vector3<Real> from_centre = at.position_m - Vector3<Real>{p[3], p[4], p[5]};
    const Vector3<Real> n = direction(from_centre);
    return Contact::force(p[6] - dot(n, from_centre), n, at.velocity_m_per_s, at.flat_area_m2,
                          at.mass_kg, p[0], p[1], p[2]);
  }

  static bool acts(const VertexSight<double>& at, const std::array<double, kParameters>& p) {
    const Vector3<double> from_centre = at.position_m - Vector3<double>{p[3], p[4], p[5]};
    return dot(from_centre, from_centre) < p[6] * p[6];
  }

  static EffectRates rates(const Cloth& cloth, const SpringParameters&,
                           const std::vector<double>& parameters) {
    return Contact::rates(cloth, parameters);
  }
};

std::string in_words(const FittedEffect& found) {
  if (found.value("stiffness") == 0 && found.value("damping") == 0) return {};
  return "a ball of " + millimetres(found.value("radius")) + " radius about " +
         world_place(found.vector("centre"));
}

}  // namespace

EffectDescription describe() {
  EffectDescription effect{
      .name = "contact_sphere",
      .summary = "a ball that the cloth cannot pass, depth = radius - |x - centre|",
      .parameters = Contact::parameters(),
      .test = EffectTest::finite,
      .in_words = in_words};
  effect.parameters.push_back(
      {.name = "centre_x", .unit = "m", .neutral = 0, .lower = -10, .upper = 10, .typical = 0.01});
  effect.parameters.push_back(
      {.name = "centre_y", .unit = "m", .neutral = 0, .lower = -10, .upper = 10, .typical = 0.01});
  effect.parameters.push_back(
      {.name = "centre_z", .unit = "m", .neutral = 0, .lower = -10, .upper = 10, .typical = 0.01});
  effect.parameters.push_back({.name = "radius",
                               .unit = "m",
                               .neutral = 0.15,
                               .lower = 0.005,
                               .upper = 5,
                               .typical = 0.005});
  effect.modes = Contact::modes({"centre_x", "centre_y", "centre_z", "radius"});
  effect.touches = true;
  return effect;
}

std::unique_ptr<Effect> make() {
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::contact_sphere
