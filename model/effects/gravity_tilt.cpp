#include "model/effects/vertex_law.h"

/// Turns gravity away from the stated direction: F = m (R g - g). R is the turn about the
/// horizontal axes x and y of the world by two small angles.
///
/// R is the rational rotation (Cayley's) of w = (about_x, about_y, 0) / 2,
///
///   R g = g + 2 / (1 + w^2) [w x g + w x (w x g)],
///
/// which turns by 2 atan |w|: by the angles themselves up to their cube over 12. Parameters:
/// about_x, about_y (rad), neutral at 0.
namespace clothfit::gravity_tilt {
namespace {
struct Law {
  static constexpr int kParameters = 2;
  static constexpr LooksAt kLooksAt{.gravity = true, .mass = true};

  template <class Real>
  static Vector3<Real> force(const VertexSight<Real>& at, const std::array<Real, 2>& angle_rad) {
    const Vector3<Real> w{Real(0.5) * angle_rad[0], Real(0.5) * angle_rad[1], Real(0.0)};
    const Vector3<Real> once = cross(w, at.gravity_m_per_s2);
    return Real(2.0) * at.mass_kg / (Real(1.0) + dot(w, w)) * (once + cross(w, once));
  }

  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

}  // namespace

EffectDescription describe() {
  return {.name = "gravity_tilt",
          .summary = "gravity turned about the axes x and y, F = m (R g - g)",
          .parameters = {{.name = "about_x",
                          .unit = "rad",
                          .neutral = 0,
                          .lower = -0.3,
                          .upper = 0.3,
                          .typical = 0.01},
                         {.name = "about_y",
                          .unit = "rad",
                          .neutral = 0,
                          .lower = -0.3,
                          .upper = 0.3,
                          .typical = 0.01}},
          .remedy = "level the camera's or the tracker's axes against gravity"};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::gravity_tilt
