#include "model/cloth/wording.h"
#include "model/effects/vertex_law.h"

/// Makes gravity stronger or weaker than stated: F = excess m g at every vertex. Parameter: excess
/// (ratio), neutral at 0. Ours.
///
/// A clock that runs wrong looks the same: with still supports and free stiffness and damping,
/// t -> a t maps g to a^2 g.
namespace clothfit::gravity_scale {
namespace {
struct Law {
  static constexpr int kParameters = 1;
  static constexpr LooksAt kLooksAt{.gravity = true, .mass = true};

  template <class Real>
  static Vector3<Real> force(const VertexSight<Real>& at, const std::array<Real, 1>& excess) {
    return at.mass_kg * excess[0] * at.gravity_m_per_s2;
  }

  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

std::string in_words(const FittedEffect& found) {
  const double excess = found.value("excess");
  if (excess == 0) return {};
  return "gravity of " + rounded((1 + excess) * found.gravity()) + " m/s2, stated " +
         rounded(found.gravity());
}

}  // namespace

EffectDescription describe() {
  return {.name = "gravity_scale",
          .summary = "gravity stronger or weaker than stated, F = excess m g",
          .parameters = {{.name = "excess",
                          .unit = "ratio",
                          .neutral = 0,
                          .lower = -0.5,
                          .upper = 0.5,
                          .typical = 0.01}},
          .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::gravity_scale
