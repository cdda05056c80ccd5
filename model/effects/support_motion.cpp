#include "model/effects/support_motion.h"

#include "model/effects/harmonic.h"
#include "model/effects/support_law.h"

namespace clothfit::support_motion {
namespace {
struct Law {
  static constexpr int kParameters = Harmonic::kParameters, kMemory = 0;
  static constexpr bool kAtRest = false, kOfTwo = false;

  template <class Real>
  static Vector3<Real> shift(const SupportSight<Real>& at, const Harmonic::Parameters<Real>& p,
                             std::array<Real, 0>&) {
    return Harmonic::vector(p, at.end_time_s) - Harmonic::vector(p, 0);
  }

  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

}  // namespace

EffectDescription describe() {
  return {
      .name = "support_motion",
      .summary =
          "held points to and fro, shift = amplitude [sin(2 pi (f t + phase)) - sin(2 pi phase)]",
      .parameters = Harmonic::parameters({.name = "amplitude",
                                          .unit = "m",
                                          .neutral = 0,
                                          .lower = -0.1,
                                          .upper = 0.1,
                                          .typical = 0.002}),
      .test = EffectTest::profiled,
      .modes = Harmonic::modes("amplitude")};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SupportLawEffect<Law>>();
}

}  // namespace clothfit::support_motion
