#include "model/cloth/network_bound.h"
#include "model/cloth/wording.h"
#include "model/effects/spring_law.h"

/// Adds dry friction inside the fabric: an elastoplastic element beside every spring (Prandtl's),
///
///   tension += ratio k l0 (e - p),  |e - p| <= yield,  e = (l - l0) / l0
///
/// where the plastic elongation p, which is remembered, follows e so far that the bound is kept. An
/// oscillation of amplitude E > yield loses 4 ratio k l0^2 yield (E - yield) per spring and cycle,
/// whatever its frequency. Parameters: ratio, of the element's stiffness to the spring's, neutral
/// at 0; yield, the elongation at which it slips, a shape and no amplitude. Both are ratios, so
/// they are the fabric's and not the mesh's. Ours.
namespace clothfit::hysteresis {
namespace {

struct Law {
  static constexpr int kParameters = 2, kMemory = 1;

  template <class Real>
  static Real tension(const SpringSight<Real>& at, const std::array<Real, 2>& p,
                      std::array<Real, 1>& memory) {
    const auto& [ratio, yield] = p;
    Real& plastic = memory[0];
    const Real e = (at.length_m - at.natural_length_m) / at.natural_length_m;
    plastic = select(e - plastic > yield, e - yield, plastic);
    plastic = select(e - plastic < -yield, e + yield, plastic);
    return ratio * at.stiffness_n_per_m * at.natural_length_m * (e - plastic);
  }

  static EffectRates rates(const Cloth& cloth, const SpringParameters& springs,
                           const std::vector<double>& p) {
    return {.frequency2_per_s2 = network_bound(cloth, [&](SpringType type, const Spring&) {
              return p[0] * springs.stiffness_n_per_m[static_cast<size_t>(type)];
            })};
  }
};

/// Between slips the element's stiffness stands beside the spring's.
std::string in_words(const FittedEffect& found) {
  const double ratio = found.value("ratio");
  if (!(ratio > 0)) return {};
  return rounded(1 + ratio) + " times as stiff up to a stretch of " +
         rounded(100 * found.value("yield")) + " %, where it slips";
}

}  // namespace

EffectDescription describe() {
  return {.name = "hysteresis",
          .summary = "dry friction inside the fabric, T = ratio k l0 (e - p), |e - p| <= yield",
          .parameters =
              {{.name = "ratio", .unit = "1", .neutral = 0, .lower = 0, .upper = 5, .typical = 0.1},
               {.name = "yield",
                .unit = "1",
                .neutral = 0.005,
                .lower = 1e-4,
                .upper = 0.1,
                .typical = 0.002,
                .scale = ParameterScale::logarithmic}},
          .test = EffectTest::profiled,
          .modes = {{.name = "",
                     .amplitudes = {"ratio"},
                     .shapes = {{.parameter = "yield", .values = {5e-4, 2e-3, 8e-3, 3e-2}}}}},
          .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SpringLawEffect<Law>>();
}

}  // namespace clothfit::hysteresis
