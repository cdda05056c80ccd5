#include <algorithm>

#include "model/cloth/network_bound.h"
#include "model/cloth/wording.h"
#include "model/effects/spring_law.h"

/// Bends the tension curve. With e = (l - l0) / l0 the elongation,
///
///   tension += k l0 stretched e^2 / (e + strain)      where e > 0
///   tension += k l0 compressed e^2 / (|e| + strain)   where e < 0
///
/// Under large extension a spring is 1 + stretched times as stiff (threads that have been pulled
/// straight), under large compression 1 - compressed times (threads that buckle). The stiffness
/// dT/dl is continuous, k at e = 0, and bounded by these two. The first term is k l0 (stretched /
/// strain) e^2 - ..., without the growth beyond all bounds that a step could not follow.
/// Parameters: stretched and compressed (ratios), neutral at 0; strain, the elongation about which
/// the curve bends, a shape and no amplitude. Ours.
namespace clothfit::stiffening {
namespace {

struct Law {
  static constexpr int kParameters = 3, kMemory = 0;

  template <class Real>
  static Real tension(const SpringSight<Real>& at, const std::array<Real, 3>& p,
                      std::array<Real, 0>&) {
    const auto& [stretched, compressed, strain] = p;
    const Real e = (at.length_m - at.natural_length_m) / at.natural_length_m;
    const auto longer = e > Real(0.0);
    const Real size = select(longer, e, -e);
    return at.stiffness_n_per_m * at.natural_length_m * select(longer, stretched, compressed) *
           size * size / (size + strain);
  }

  static EffectRates rates(const Cloth& cloth, const SpringParameters& springs,
                           const std::vector<double>& p) {
    const double stiffer = std::max({0.0, p[0], -p[1]});
    return {.frequency2_per_s2 = network_bound(cloth, [&](SpringType type, const Spring&) {
              return stiffer * springs.stiffness_n_per_m[static_cast<size_t>(type)];
            })};
  }
};

/// At the elongation `strain` the term is half of its amplitude times k l0 strain.
std::string in_words(const FittedEffect& found) {
  const bool stretched = found.mode != "compressed";
  const double amplitude = found.value(stretched ? "stretched" : "compressed");
  if (amplitude == 0) return {};
  const double factor = 1 + (stretched ? 0.5 : -0.5) * amplitude;
  return std::string(stretched ? "stretched" : "compressed") + " by " +
         rounded(100 * found.value("strain")) + " %, it " + (stretched ? "pulls " : "pushes ") +
         rounded(factor) + " times as hard as its stiffness says";
}

}  // namespace

EffectDescription describe() {
  const ShapeGrid strains{.parameter = "strain", .values = {3e-3, 0.01, 0.03, 0.1}};
  return {.name = "stiffening",
          .summary = "a tension curve that bends, T = k l0 amplitude e^2 / (|e| + strain)",
          .parameters = {{.name = "stretched",
                          .unit = "1",
                          .neutral = 0,
                          .lower = -0.9,
                          .upper = 10,
                          .typical = 0.3},
                         {.name = "compressed",
                          .unit = "1",
                          .neutral = 0,
                          .lower = -3,
                          .upper = 0.95,
                          .typical = 0.1},
                         {.name = "strain",
                          .unit = "1",
                          .neutral = 0.02,
                          .lower = 1e-3,
                          .upper = 0.2,
                          .typical = 0.01,
                          .scale = ParameterScale::logarithmic}},
          .test = EffectTest::profiled,
          .modes = {{.name = "stretched", .amplitudes = {"stretched"}, .shapes = {strains}},
                    {.name = "compressed", .amplitudes = {"compressed"}, .shapes = {strains}}},
          .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SpringLawEffect<Law>>();
}

}  // namespace clothfit::stiffening
