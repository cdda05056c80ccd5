#include <cmath>

#include "model/cloth/wording.h"
#include "model/effects/vertex_law.h"

/// Lets wind press on the surface: F = A [n . (q - c v)] n at every vertex.
///
/// Source: the founding paper's fluid force C [n . (u - v)] n on vertex normals [louchet1995,
/// section 2.2]. Amplitudes are per area, so that they survive a change of mesh: C = c A, A the
/// area that belongs to the vertex, n its unit normal, and q = c u the pressure that the wind u
/// would exert on a sheet at rest that faces it. Parameters: c (Pa s/m), the drag along the normal,
/// and q_x, q_y, q_z (Pa); all neutral at 0. With c = 0 the wind does not depend on the cloth's
/// speed, with q = 0 the air is still.
namespace clothfit::wind {
namespace {

struct Law {
  static constexpr int kParameters = 4;
  static constexpr LooksAt kLooksAt{.velocity = true, .area = true};

  template <class Real>
  static Vector3<Real> force(const VertexSight<Real>& at, const std::array<Real, 4>& p) {
    const Vector3<Real> q{p[1], p[2], p[3]};
    // A vertex whose surface is folded to nothing catches no wind.
    return dot(at.area_m2, q - p[0] * at.velocity_m_per_s) * direction(at.area_m2);
  }

  static EffectRates rates(const Cloth& cloth, const SpringParameters&,
                           const std::vector<double>& parameters) {
    return {.damping_per_s = parameters[0] * largest_area_per_mass(cloth)};
  }
};

/// A pressure is told as the dynamic pressure rho u^2 / 2 of a wind u in air. A drag is told by the
/// speed sigma g / c at which it carries a cloth of sigma (kg/m2) that falls flat.
std::string in_words(const FittedEffect& found) {
  if (found.mode == "drag") {
    const double c_pa_s_per_m = found.value("c");
    if (!(c_pa_s_per_m > 0 && found.gravity() > 0)) return {};
    return "lying flat, the cloth falls at " + rounded(found.weight_pa() / c_pa_s_per_m) +
           " m/s at most";
  }
  const Eigen::Vector3d q_pa = found.vector("q");
  if (q_pa.isZero(0)) return {};
  const double speed_m_per_s = std::sqrt(2 * q_pa.norm() / kAirDensity_kg_per_m3);
  return rounded(q_pa.norm()) + " Pa towards " + unit_vector(q_pa) + ", as of a wind of " +
         rounded(speed_m_per_s) + " m/s";
}

}  // namespace

EffectDescription describe() {
  const auto pressure = [](const char* name) {
    return EffectParameter{.name = name,
                           .unit = "Pa",
                           .neutral = 0,
                           .lower = -3,
                           .upper = 3,
                           .typical = 0.05,
                           .scale = ParameterScale::linear};
  };
  return {.name = "wind",
          .summary = "wind and drag along the surface's normal, F = A [n . (q - c v)] n",
          .parameters = {{.name = "c",
                          .unit = "Pa s/m",
                          .neutral = 0,
                          .lower = 0,
                          .upper = 5,
                          .typical = 0.02,
                          .scale = ParameterScale::linear},
                         pressure("q_x"),
                         pressure("q_y"),
                         pressure("q_z")},
          .modes = {{.name = "pressure", .amplitudes = {"q_x", "q_y", "q_z"}, .shapes = {}},
                    {.name = "drag", .amplitudes = {"c"}, .shapes = {}}},
          .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::wind
