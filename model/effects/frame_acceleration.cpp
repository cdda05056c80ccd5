#include "model/effects/frame_acceleration.h"

#include "model/effects/harmonic.h"
#include "model/effects/vertex_law.h"

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

}  // namespace

EffectDescription describe() {
  return {
      .name = "frame_acceleration",
      .summary = "the frame shakes, F = -m a sin(2 pi (f t + phase))",
      .parameters = Harmonic::parameters(
          {.name = "a", .unit = "m/s2", .neutral = 0, .lower = -20, .upper = 20, .typical = 0.1}),
      .test = EffectTest::profiled,
      .modes = Harmonic::modes("a")};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::frame_acceleration
