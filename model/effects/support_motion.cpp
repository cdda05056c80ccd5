#include "model/effects/support_motion.h"

#include "model/effects/support_law.h"

namespace clothfit::support_motion {
namespace {
struct Law {
  static constexpr int kParameters = 5, kMemory = 0;

  template <class Real>
  static Vector3<Real> shift(const SupportSight<Real>& at, const std::array<Real, 5>& p,
                             std::array<Real, 0>&) {
    const Real now = sine_of_turns(p[3] * Real(at.end_time_s) + p[4]) - sine_of_turns(p[4]);
    return now * Vector3<Real>{p[0], p[1], p[2]};
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
      .parameters = {{.name = "amplitude_x",
                      .unit = "m",
                      .neutral = 0,
                      .lower = -0.1,
                      .upper = 0.1,
                      .typical = 0.002},
                     {.name = "amplitude_y",
                      .unit = "m",
                      .neutral = 0,
                      .lower = -0.1,
                      .upper = 0.1,
                      .typical = 0.002},
                     {.name = "amplitude_z",
                      .unit = "m",
                      .neutral = 0,
                      .lower = -0.1,
                      .upper = 0.1,
                      .typical = 0.002},
                     {.name = "frequency",
                      .unit = "Hz",
                      .neutral = 1,
                      .lower = 0.05,
                      .upper = 20,
                      .typical = 0.1},
                     {.name = "phase",
                      .unit = "turns",
                      .neutral = 0,
                      .lower = -0.5,
                      .upper = 0.5,
                      .typical = 0.05}},
      .test = EffectTest::profiled};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SupportLawEffect<Law>>();
}

}  // namespace clothfit::support_motion
