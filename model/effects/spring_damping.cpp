#include "model/cloth/network_bound.h"
#include "model/effects/spring_law.h"

/// Damps inside the fabric beyond its common damping, for each group of springs by itself:
///
///   tension += time k dl/dt
///
/// time is a retardation time beside that of the fabric. A dashpot time k stands beside a spring of
/// stiffness k (a Kelvin-Voigt solid), so it is the fabric's and not the mesh's. It acts along the
/// springs only: cloth that turns rigidly loses no energy. Parameters: structural (types 0 and 1),
/// shear (2 and 3), flexion (4 and 5), in s, neutral at 0. Ours; see docs/effects.
namespace clothfit::spring_damping {
namespace {

size_t group(SpringType type) {
  return static_cast<size_t>(type) / 2;
}

struct Law {
  static constexpr int kParameters = 3, kMemory = 0;

  template <class Real>
  static Real tension(const SpringSight<Real>& at, const std::array<Real, 3>& time_s,
                      std::array<Real, 0>&) {
    return time_s[group(at.type)] * at.stiffness_n_per_m * at.stretching_m_per_s;
  }

  static EffectRates rates(const Cloth& cloth, const SpringParameters& springs,
                           const std::vector<double>& time_s) {
    return {.damping_per_s = network_bound(cloth, [&](SpringType type, const Spring&) {
              return time_s[group(type)] * springs.stiffness_n_per_m[static_cast<size_t>(type)];
            })};
  }
};

}  // namespace

EffectDescription describe() {
  const auto time = [](const char* name) {
    return EffectParameter{
        .name = name, .unit = "s", .neutral = 0, .lower = 0, .upper = 0.02, .typical = 1e-3};
  };
  return {.name = "spring_damping",
          .summary = "damping along the springs beyond the common one, T = time k dl/dt",
          .parameters = {time("structural"), time("shear"), time("flexion")}};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SpringLawEffect<Law>>();
}

}  // namespace clothfit::spring_damping
