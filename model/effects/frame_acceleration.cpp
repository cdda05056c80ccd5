#include "model/effects/frame_acceleration.h"

#include "model/effects/vertex_law.h"

namespace clothfit::frame_acceleration {
namespace {
struct Law {
  static constexpr int kParameters = 5;

  template <class Real>
  static Vector3<Real> force(const VertexSight<Real>& at, const std::array<Real, 5>& p) {
    const Real now = sine_of_turns(p[3] * Real(at.time_s) + p[4]);
    return Real(-at.mass_kg) * now * Vector3<Real>{p[0], p[1], p[2]};
  }

  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

}  // namespace

EffectDescription describe() {
  return {
      .name = "frame_acceleration",
      .summary = "the frame shakes, F = -m a sin(2 pi (f t + phase))",
      .parameters =
          {{.name = "a_x", .unit = "m/s2", .neutral = 0, .lower = -20, .upper = 20, .typical = 0.1},
           {.name = "a_y", .unit = "m/s2", .neutral = 0, .lower = -20, .upper = 20, .typical = 0.1},
           {.name = "a_z", .unit = "m/s2", .neutral = 0, .lower = -20, .upper = 20, .typical = 0.1},
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
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::frame_acceleration
