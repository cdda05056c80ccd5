#include "model/cloth/wording.h"
#include "model/effects/contact_law.h"
#include "model/effects/vertex_law.h"

/// Keeps the cloth on one side of a plane: floor, table, wall. A vertex at x is depth = offset - n
/// . x below it and feels the force of contact_law.h.
///
/// Parameters: stiffness (Pa/m), damping (Pa s/m), friction (ratio), neutral at 0; n_x, n_y, n_z,
/// whose direction is the plane's normal n, towards the free side; offset (m), the plane's distance
/// from the origin along n. Where the plane lies matters only where stiffness or damping do.
namespace clothfit::contact_plane {
namespace {
struct Law {
  static constexpr int kParameters = Contact::kParameters + 4;
  static constexpr LooksAt kLooksAt{.position = true, .velocity = true, .mass = true};

  template <class Real>
  static Vector3<Real> force(const VertexSight<Real>& at, const std::array<Real, kParameters>& p) {
    const Vector3<Real> n = direction(Vector3<Real>{p[3], p[4], p[5]});
    return Contact::force(p[6] - dot(n, at.position_m), n, at.velocity_m_per_s, at.flat_area_m2,
                          at.mass_kg, p[0], p[1], p[2]);
  }

  static bool acts(const VertexSight<double>& at, const std::array<double, kParameters>& p) {
    const Vector3<double> n = direction(Vector3<double>{p[3], p[4], p[5]});
    return dot(n, at.position_m) < p[6];
  }

  static EffectRates rates(const Cloth& cloth, const SpringParameters&,
                           const std::vector<double>& parameters) {
    return Contact::rates(cloth, parameters);
  }
};

/// Tells the plane's point nearest to the origin.
std::string in_words(const FittedEffect& found) {
  const Eigen::Vector3d n = found.vector("n").normalized();
  if (found.value("stiffness") == 0 && found.value("damping") == 0) return {};
  return "a plane through " + world_place(found.value("offset") * n) +
         " that keeps the cloth on its side towards " + unit_vector(n);
}

}  // namespace

EffectDescription describe() {
  EffectDescription effect{.name = "contact_plane",
                           .summary = "a plane that the cloth cannot pass, depth = offset - n . x",
                           .parameters = Contact::parameters(),
                           .test = EffectTest::finite,
                           .in_words = in_words};
  effect.parameters.push_back(
      {.name = "n_x", .unit = "ratio", .neutral = 0, .lower = -1, .upper = 1, .typical = 0.02});
  effect.parameters.push_back(
      {.name = "n_y", .unit = "ratio", .neutral = 0, .lower = -1, .upper = 1, .typical = 0.02});
  effect.parameters.push_back(
      {.name = "n_z", .unit = "ratio", .neutral = 1, .lower = -1, .upper = 1, .typical = 0.02});
  effect.parameters.push_back(
      {.name = "offset", .unit = "m", .neutral = 0, .lower = -10, .upper = 10, .typical = 0.01});
  effect.modes = Contact::modes({"n_x", "n_y", "n_z", "offset"});
  effect.touches = true;
  return effect;
}

std::unique_ptr<Effect> make() {
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::contact_plane
