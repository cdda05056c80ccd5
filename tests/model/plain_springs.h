#pragma once

#include "model/effects/spring_law.h"

namespace clothfit {

/// The springs themselves as a law, k (l - l0) + c dl/dt. It is a second route to the kernel's
/// result, with derivatives.
struct PlainSprings {
  static constexpr int kParameters = 0, kMemory = 0;

  template <class Real>
  static Real tension(const SpringSight<Real>& at, const std::array<Real, 0>&,
                      std::array<Real, 0>&) {
    return at.stiffness_n_per_m * (at.length_m - at.natural_length_m) +
           at.damping_ns_per_m * at.stretching_m_per_s;
  }
  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};  // the stable step counts the springs by itself
  }
};

}  // namespace clothfit
