#include <cmath>

#include "model/cloth/wording.h"
#include "model/effects/harmonic.h"
#include "model/effects/vertex_law.h"

/// Adds a gust, wind that comes and goes: F = A [n . q sin(2 pi (f t + phase))] n at every vertex.
///
/// Ours: the founding paper's fluid force on a sheet at rest, A (n . q) n [louchet1995, section
/// 2.2], with one harmonic in time t (s, the recording's); the drag that goes with it is wind's. A
/// is the area that belongs to the vertex, n its unit normal. Parameters: q_x, q_y, q_z (Pa), the
/// pressure at the harmonic's height, neutral at 0; frequency f (Hz) and phase (turns), which
/// matter only where q does.
namespace clothfit::gust {
namespace {
struct Law {
  static constexpr int kParameters = Harmonic::kParameters;
  static constexpr LooksAt kLooksAt{.area = true};

  template <class Real>
  static Vector3<Real> at_moment(const Harmonic::Parameters<Real>& p, double time_s) {
    return Harmonic::vector(p, time_s);
  }

  template <class Real>
  static Vector3<Real> force(const VertexSight<Real>& at, const Vector3<Real>& pressure_pa) {
    // A vertex whose surface is folded to nothing catches no wind.
    return dot(at.area_m2, pressure_pa) * direction(at.area_m2);
  }

  /// The force follows the surface's attitude alone. It adds stiffness of the order of q times a
  /// spacing, nothing beside the springs'.
  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

/// The pressure at the harmonic's height is told as wind's is.
std::string in_words(const FittedEffect& found) {
  const Eigen::Vector3d q_pa = found.vector("q");
  if (q_pa.isZero(0)) return {};
  const double speed_m_per_s = std::sqrt(2 * q_pa.norm() / kAirDensity_kg_per_m3);
  return "up to " + rounded(q_pa.norm()) + " Pa along " + unit_vector(q_pa) + ", to and fro " +
         rounded(found.value("frequency")) + " times a second, as of a wind of " +
         rounded(speed_m_per_s) + " m/s";
}

}  // namespace

EffectDescription describe() {
  return {.name = "gust",
          .summary = "wind with one harmonic, F = A [n . q sin(2 pi (f t + phase))] n",
          .parameters = Harmonic::parameters(
              {.name = "q", .unit = "Pa", .neutral = 0, .lower = -3, .upper = 3, .typical = 0.05}),
          .test = EffectTest::profiled,
          .modes = Harmonic::modes("q"),
          .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::gust
