#include <numbers>

#include "model/cloth/network_bound.h"
#include "model/cloth/wording.h"
#include "model/effects/spring_law.h"

/// Relaxes stress by a Maxwell arm, a spring and a dashpot in series, beside every spring:
///
///   tension += ratio k l0 (e - s),  ds/dt = (e - s) / time,  e = (l - l0) / l0
///
/// where s is the dashpot's elongation, which is remembered. The step takes s implicitly, s_n =
/// (s_(n-1) + h / time e_n) / (1 + h / time): stable for every time, first order like the rest of
/// the scheme. Parameters: ratio, of the arm's stiffness to the spring's, neutral at 0; time (s), a
/// shape and no amplitude. Ours.
namespace clothfit::relaxation {
namespace {

struct Law {
  static constexpr int kParameters = 2, kMemory = 1;

  template <class Real>
  static Real tension(const SpringSight<Real>& at, const std::array<Real, 2>& p,
                      std::array<Real, 1>& memory) {
    const auto& [ratio, time_s] = p;
    Real& viscous = memory[0];
    const Real e = (at.length_m - at.natural_length_m) / at.natural_length_m;
    const Real share = Real(at.time_step_s) / time_s;
    viscous = (viscous + share * e) / (Real(1.0) + share);
    return ratio * at.stiffness_n_per_m * at.natural_length_m * (e - viscous);
  }

  static EffectRates rates(const Cloth& cloth, const SpringParameters& springs,
                           const std::vector<double>& p) {
    return {.frequency2_per_s2 = network_bound(cloth, [&](SpringType type, const Spring&) {
              return p[0] * springs.stiffness_n_per_m[static_cast<size_t>(type)];
            })};
  }
};

/// A sudden stretch's extra stress falls as exp(-t / time).
std::string in_words(const FittedEffect& found) {
  const double ratio = found.value("ratio");
  if (!(ratio > 0)) return {};
  return rounded(1 + ratio) + " times as stiff at once; half of the excess is gone after " +
         rounded(std::numbers::ln2 * found.value("time")) + " s";
}

}  // namespace

EffectDescription describe() {
  return {.name = "relaxation",
          .summary = "stress that relaxes, T = ratio k l0 (e - s), ds/dt = (e - s) / time",
          .parameters =
              {{.name = "ratio", .unit = "1", .neutral = 0, .lower = 0, .upper = 5, .typical = 0.1},
               {.name = "time",
                .unit = "s",
                .neutral = 0.1,
                .lower = 5e-3,
                .upper = 10,
                .typical = 0.05,
                .scale = ParameterScale::logarithmic}},
          .test = EffectTest::profiled,
          .modes = {{.name = "",
                     .amplitudes = {"ratio"},
                     .shapes = {{.parameter = "time", .values = {0.02, 0.07, 0.25, 1}}}}},
          .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SpringLawEffect<Law>>();
}

}  // namespace clothfit::relaxation
