#include "model/effects/frame_acceleration.h"

#include "model/effects/harmonic.h"
#include "model/effects/vertex_law.h"

namespace clothfit::frame_acceleration {
namespace {
struct Law {
  static constexpr int kParameters = Harmonic::kParameters;

  template <class Real>
  static Vector3<Real> force(const VertexSight<Real>& at, const Harmonic::Parameters<Real>& p) {
    return -at.mass_kg * Harmonic::sine(p, at.time_s) * Harmonic::amplitude(p);
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
      .parameters = Harmonic::parameters(
          {.name = "a", .unit = "m/s2", .neutral = 0, .lower = -20, .upper = 20, .typical = 0.1}),
      .test = EffectTest::profiled,
      .laws = Harmonic::laws("a")};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::frame_acceleration
