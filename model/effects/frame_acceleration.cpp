#include <numbers>

#include "model/cloth/wording.h"
#include "model/effects/harmonic.h"
#include "model/effects/vertex_law.h"

/// Shakes the frame of the whole scene. The inertial force is F = -m a sin(2 pi (f t + phase)) on
/// every vertex, supports at rest in the frame, t the recording's time (s).
///
/// Newton's second law in an accelerated frame. Parameters: a_x, a_y, a_z (m/s2), the frame's
/// acceleration at the harmonic's height, neutral at 0; frequency f (Hz) and phase (turns), which
/// matter only where a does.
namespace clothfit::frame_acceleration {
namespace {
struct Law {
  static constexpr int kParameters = Harmonic::kParameters;
  static constexpr LooksAt kLooksAt{.mass = true};

  template <class Real>
  static Vector3<Real> at_moment(const Harmonic::Parameters<Real>& p, double time_s) {
    return Harmonic::vector(p, time_s);
  }

  template <class Real>
  static Vector3<Real> force(const VertexSight<Real>& at, const Vector3<Real>& frame_m_per_s2) {
    return -at.mass_kg * frame_m_per_s2;
  }

  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

/// A frame that accelerates by a sin(2 pi f t) goes a / (2 pi f)^2 to either side.
std::string in_words(const FittedEffect& found) {
  const Eigen::Vector3d a_m_per_s2 = found.vector("a");
  const double frequency_hz = found.value("frequency");
  if (a_m_per_s2.isZero(0) || !(frequency_hz > 0)) return {};
  const double rate_per_s = 2 * std::numbers::pi * frequency_hz;
  return "the frame shakes by " + millimetres(a_m_per_s2.norm() / (rate_per_s * rate_per_s)) +
         " to either side along " + unit_vector(a_m_per_s2) + ", " + rounded(frequency_hz) +
         " times a second";
}

}  // namespace

EffectDescription describe() {
  return {
      .name = "frame_acceleration",
      .summary = "the frame shakes, F = -m a sin(2 pi (f t + phase))",
      .parameters = Harmonic::parameters(
          {.name = "a", .unit = "m/s2", .neutral = 0, .lower = -20, .upper = 20, .typical = 0.1}),
      .test = EffectTest::profiled,
      .modes = Harmonic::modes("a"),
      .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::frame_acceleration
