#include "model/cloth/wording.h"
#include "model/effects/harmonic.h"
#include "model/effects/support_law.h"

/// Moves the held points to and fro, all alike, beside their known motion:
///
///   shift(t) = amplitude [sin(2 pi (f t + phase)) - sin(2 pi phase)]
///
/// with t the recording's time (s), so that the shift is nothing at 0, where the start shape holds.
/// Parameters: amplitude_x, amplitude_y, amplitude_z (m), neutral at 0; frequency f (Hz) and phase
/// (turns), which matter only where the amplitude does; point (index), the number of the held point
/// that moves, or 0 for all. A motion at constant velocity is support_drift's. Ours.
namespace clothfit::support_motion {
namespace {
struct Law {
  static constexpr int kParameters = Harmonic::kParameters + 1, kMemory = 0;
  static constexpr bool kAtRest = false, kOfTwo = false;

  template <class Real>
  static Vector3<Real> shift(const SupportSight<Real>& at, const std::array<Real, kParameters>& p,
                             std::array<Real, 0>&) {
    const Harmonic::Parameters<Real> wave{p[0], p[1], p[2], p[3], p[4]};
    return at.is_asked(p[5]) * (Harmonic::vector(wave, at.end_time_s) - Harmonic::vector(wave, 0));
  }

  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

std::string in_words(const FittedEffect& found) {
  const Eigen::Vector3d amplitude_m = found.vector("amplitude");
  if (amplitude_m.isZero(0)) return {};
  return millimetres(amplitude_m.norm()) + " to either side along " + unit_vector(amplitude_m) +
         ", " + rounded(found.value("frequency")) + " times a second, " +
         at_held_point(found, found.value("point"));
}

}  // namespace

EffectDescription describe() {
  std::vector<EffectParameter> parameters = Harmonic::parameters({.name = "amplitude",
                                                                  .unit = "m",
                                                                  .neutral = 0,
                                                                  .lower = -0.1,
                                                                  .upper = 0.1,
                                                                  .typical = 0.002});
  parameters.push_back(point_parameter());
  return {
      .name = "support_motion",
      .summary =
          "held points to and fro, shift = amplitude [sin(2 pi (f t + phase)) - sin(2 pi phase)]",
      .parameters = std::move(parameters),
      .test = EffectTest::profiled,
      .modes = alike_and_single(Harmonic::modes("amplitude").front()),
      .remedy = kDeclareMotion,
      .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SupportLawEffect<Law>>();
}

}  // namespace clothfit::support_motion
