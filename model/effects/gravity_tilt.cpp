#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "model/cloth/wording.h"
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

/// Tells the angle between the stated gravity and the turned one, and where the latter leans.
std::string in_words(const FittedEffect& found) {
  const Eigen::Vector3d& stated = found.gravity_m_per_s2;
  const VertexSight<double> of_one_kg{.gravity_m_per_s2 = {stated.x(), stated.y(), stated.z()},
                                      .mass_kg = 1};
  const Vector3<double> change =
      Law::force<double>(of_one_kg, {found.value("about_x"), found.value("about_y")});
  const Eigen::Vector3d turned = stated + Eigen::Vector3d(change.x, change.y, change.z);
  const double angle_rad = std::atan2(stated.cross(turned).norm(), stated.dot(turned));
  if (!(angle_rad > 0)) return {};
  const Eigen::Vector3d aside = turned - stated * (stated.dot(turned) / stated.squaredNorm());
  return "down leans by " + rounded(angle_rad * 180 / std::numbers::pi) + " degrees towards " +
         unit_vector(aside);
}

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
          .remedy = "level the camera's or the tracker's axes against gravity",
          .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::gravity_tilt
