#include "model/effects/gust.h"

#include "model/effects/vertex_law.h"

namespace clothfit::gust {
namespace {
struct Law {
  static constexpr int kParameters = 5;

  template <class Real>
  static Vector3<Real> force(const VertexSight<Real>& at, const std::array<Real, 5>& p) {
    const Vector3<Real> q{p[0], p[1], p[2]};
    const Real now = sine_of_turns(p[3] * Real(at.time_s) + p[4]);
    // A vertex whose surface is folded to nothing catches no wind.
    return now * dot(at.area_m2, q) * direction(at.area_m2);
  }

  /// A force that follows the surface's attitude alone adds stiffness of the order of q times a
  /// spacing, nothing beside the springs'.
  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

}  // namespace

EffectDescription describe() {
  return {
      .name = "gust",
      .summary = "wind with one harmonic, F = A [n . q sin(2 pi (f t + phase))] n",
      .parameters =
          {{.name = "q_x", .unit = "Pa", .neutral = 0, .lower = -3, .upper = 3, .typical = 0.05},
           {.name = "q_y", .unit = "Pa", .neutral = 0, .lower = -3, .upper = 3, .typical = 0.05},
           {.name = "q_z", .unit = "Pa", .neutral = 0, .lower = -3, .upper = 3, .typical = 0.05},
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

}  // namespace clothfit::gust
