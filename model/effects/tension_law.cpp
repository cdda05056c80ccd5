#include <algorithm>

#include "model/cloth/network_bound.h"
#include "model/effects/spring_law.h"

/// Adds an empirical tension inside the springs: beyond k (l - l0) + c dl/dt,
///
///   tension += k l0 (c e^2 + cr |e'| e')
///
/// with e = (l - l0) / l0 the elongation and e' = (dl/dt) / l0 its rate. c is one of two numbers,
/// stretched where e > 0 and compressed where e < 0. The warp (structural springs along t), the
/// weft (along s) and the shear springs have numbers of their own. Forces are along the springs, so
/// momentum and angular momentum stay. Beyond |e| = 0.05 and |e'| = 10/s each term goes straight on
/// along its tangent, because no time step follows a stiffness without bound. Within the
/// coefficients' bounds the stiffness is 0.1 to 5 times the springs'.
///
/// The effect describes a tension and names no cause. With force_law it is the dictionary from
/// which a diagnosis proposes a law (fit/diagnosis/proposed_law.h). Every coefficient is neutral at
/// 0. Ours; see docs/effects.
namespace clothfit::tension_law {
namespace {

constexpr double kElongation = 0.05, kRate_per_s = 10;  ///< where the squares end

/// Groups of springs; those against flexion have none.
enum Group : int { warp, weft, shear };
constexpr int kGroups = 3;

int group_of(SpringType type) {
  switch (type) {
    case structural_t:
      return warp;
    case structural_s:
      return weft;
    case shear_down:
    case shear_up:
      return shear;
    default:
      return kGroups;
  }
}

/// Coefficients of each group.
enum Coefficient : int { stretched, compressed, rate_squared };
constexpr int kTerms = 3;

struct Law {
  static constexpr int kParameters = kTerms * kGroups, kMemory = 0;

  template <class Real>
  static Real tension(const SpringSight<Real>& at, const std::array<Real, kParameters>& c,
                      std::array<Real, 0>&) {
    const int group = group_of(at.type);
    if (group == kGroups) return Real(0.0);
    const auto of = [&](int term) { return c[static_cast<size_t>(term * kGroups + group)]; };
    const Real e = (at.length_m - at.natural_length_m) / at.natural_length_m;
    const auto longer = e > Real(0.0);
    const Real size = select(longer, e, -e);
    const Real square = select(size < Real(kElongation), e * e,
                               Real(kElongation) * (Real(2.0) * size - Real(kElongation)));
    const Real rate = at.stretching_m_per_s / at.natural_length_m;
    const Real speed = select(rate > Real(0.0), rate, -rate);
    const auto slow = speed < Real(kRate_per_s);
    const Real rate_square = select(slow, speed,
                                    Real(2 * kRate_per_s) - Real(kRate_per_s * kRate_per_s) /
                                                                select(slow, Real(1.0), speed)) *
                             rate;
    return at.stiffness_n_per_m * at.natural_length_m *
           (select(longer, of(stretched), of(compressed)) * square +
            of(rate_squared) * rate_square);
  }

  static EffectRates rates(const Cloth& cloth, const SpringParameters& springs,
                           const std::vector<double>& c) {
    const auto bound = [&](const auto& factor) {
      return network_bound(cloth, [&](SpringType type, const Spring&) {
        const int group = group_of(type);
        if (group == kGroups) return 0.0;
        const auto of = [&](int term) { return c[static_cast<size_t>(term * kGroups + group)]; };
        return springs.stiffness_n_per_m[static_cast<size_t>(type)] * factor(of);
      });
    };
    return {
        .damping_per_s = bound([](const auto& of) { return 2 * kRate_per_s * of(rate_squared); }),
        .frequency2_per_s2 = bound([](const auto& of) {
          return 2 * kElongation * std::max({0.0, of(stretched), -of(compressed)});
        })};
  }
};

constexpr const char* kGroupNames[] = {"warp", "weft", "shear"};

struct Entry {
  const char* name;
  const char* unit;
  double lower, upper, typical;
  const char *before, *after;  ///< the group's name, in a formula
};
constexpr Entry kEntries[] = {{"stretched", "1", -9, 40, 1, "e_", "^2 (e > 0)"},
                              {"compressed", "1", -40, 9, 1, "e_", "^2 (e < 0)"},
                              {"rate_squared", "s2", 0, 1e-3, 1e-5, "|e'| e'_", ""}};

}  // namespace

EffectDescription describe() {
  EffectDescription effect{
      .name = "tension_law",
      .summary = "an empirical tension, T = k l0 (c e^2 + cr |e'| e') by groups of springs",
      .parameters = {},
      .empirical = true};
  for (const Entry& entry : kEntries) {
    for (const char* group : kGroupNames) {
      const std::string name = std::string(group) + "_" + entry.name;
      effect.parameters.push_back({.name = name,
                                   .unit = entry.unit,
                                   .lower = entry.lower,
                                   .upper = entry.upper,
                                   .typical = entry.typical,
                                   .law_side = "T / (k l0)",
                                   .law_factor = entry.before + std::string(group) + entry.after});
      effect.modes.push_back({.name = name, .amplitudes = {name}, .shapes = {}});
    }
  }
  return effect;
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SpringLawEffect<Law>>();
}

}  // namespace clothfit::tension_law
