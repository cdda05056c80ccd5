#include <numbers>

#include "model/cloth/wording.h"
#include "model/effects/vertex_law.h"

/// Damps viscously by the surrounding air: F = -rate m v at every vertex.
///
/// Source: the founding paper's F = -C v [louchet1995, section 2.2] with C = rate m, an amplitude
/// per mass, so that it survives a change of mesh. Parameter: rate (1/s), neutral at 0.
namespace clothfit::viscous_damping {
namespace {

struct Law {
  static constexpr int kParameters = 1;
  static constexpr LooksAt kLooksAt{.velocity = true, .mass = true};

  template <class Real>
  static Vector3<Real> force(const VertexSight<Real>& at, const std::array<Real, 1>& rate_per_s) {
    return -at.mass_kg * rate_per_s[0] * at.velocity_m_per_s;
  }

  static EffectRates rates(const Cloth&, const SpringParameters&,
                           const std::vector<double>& parameters) {
    return {.damping_per_s = parameters[0]};
  }
};

/// A speed falls as exp(-rate t).
std::string in_words(const FittedEffect& found) {
  const double rate_per_s = found.value("rate");
  if (!(rate_per_s > 0)) return {};
  return "half of a speed is gone after " + rounded(std::numbers::ln2 / rate_per_s) + " s";
}

}  // namespace

EffectDescription describe() {
  return {.name = "viscous_damping",
          .summary = "drag of still air on every vertex, F = -rate m v",
          .parameters = {{.name = "rate",
                          .unit = "1/s",
                          .neutral = 0,
                          .lower = 0,
                          .upper = 30,
                          .typical = 0.1,
                          .scale = ParameterScale::linear}},
          .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::viscous_damping
