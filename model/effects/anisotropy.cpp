#include <algorithm>

#include "model/cloth/network_bound.h"
#include "model/cloth/wording.h"
#include "model/effects/spring_law.h"

/// Makes warp stiffer than weft beyond the fabric's own numbers, or softer:
///
///   tension += a (k (l - l0) + c dl/dt)  along the warp (types 0 and 4)
///   tension -= a (k (l - l0) + c dl/dt)  along the weft (types 1 and 5)
///
/// so that warp and weft are as (1 + a) to (1 - a); the dashpots follow their springs. Parameter: a
/// (a ratio), neutral at 0. A fabric with tension_warp and flexion_warp times 1 + a, tension_weft
/// and flexion_weft times 1 - a and the same damping times does exactly the same. Ours.
namespace clothfit::anisotropy {
namespace {

double sign(SpringType type) {
  switch (type) {
    case structural_t:
    case flexion_t:
      return 1;
    case structural_s:
    case flexion_s:
      return -1;
    default:
      return 0;
  }
}

struct Law {
  static constexpr int kParameters = 1, kMemory = 0;

  template <class Real>
  static Real tension(const SpringSight<Real>& at, const std::array<Real, 1>& a,
                      std::array<Real, 0>&) {
    return Real(sign(at.type)) * a[0] *
           (at.stiffness_n_per_m * (at.length_m - at.natural_length_m) +
            at.damping_ns_per_m * at.stretching_m_per_s);
  }

  static EffectRates rates(const Cloth& cloth, const SpringParameters& springs,
                           const std::vector<double>& a) {
    const auto bound = [&](const std::array<double, kSpringTypes>& constant) {
      return network_bound(cloth, [&](SpringType type, const Spring&) {
        return std::max(0.0, sign(type) * a[0]) * constant[static_cast<size_t>(type)];
      });
    };
    return {.damping_per_s = bound(springs.damping_ns_per_m),
            .frequency2_per_s2 = bound(springs.stiffness_n_per_m)};
  }
};

std::string in_words(const FittedEffect& found) {
  const double a = found.value("a");
  if (a == 0) return {};
  return "warp " + percent(a, "stiffer", "softer") + ", weft " + percent(-a, "stiffer", "softer") +
         " than the fabric's numbers";
}

}  // namespace

EffectDescription describe() {
  return {
      .name = "anisotropy",
      .summary = "warp against weft, T = +-a (k (l - l0) + c dl/dt)",
      .parameters =
          {{.name = "a", .unit = "1", .neutral = 0, .lower = -0.9, .upper = 0.9, .typical = 0.1}},
      .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SpringLawEffect<Law>>();
}

}  // namespace clothfit::anisotropy
