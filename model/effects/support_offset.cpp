#include "model/effects/support_offset.h"

#include "model/effects/support_law.h"
#include "model/effects/vector_parameter.h"

namespace clothfit::support_offset {
namespace {
struct Law {
  static constexpr int kParameters = 3, kMemory = 0;
  static constexpr bool kAtRest = true, kOfTwo = false;

  template <class Real>
  static Vector3<Real> shift(const SupportSight<Real>& at, const std::array<Real, 3>& p,
                             std::array<Real, 0>&) {
    if (!at.driven) return {Real(0.0), Real(0.0), Real(0.0)};
    return {p[0], p[1], p[2]};
  }

  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

}  // namespace

EffectDescription describe() {
  return {.name = "support_offset",
          .summary = "driven held points beside where they are said to be, shift = offset",
          .parameters = vector_parameter({.name = "offset",
                                          .unit = "m",
                                          .neutral = 0,
                                          .lower = -0.05,
                                          .upper = 0.05,
                                          .typical = 0.002})};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SupportLawEffect<Law>>();
}

}  // namespace clothfit::support_offset
