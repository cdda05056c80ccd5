#pragma once

#include <array>
#include <vector>

#include "model/effects/effect.h"
#include "model/effects/number.h"
#include "model/effects/vector_parameter.h"

namespace clothfit {

/// A vector that comes and goes with time t (s, the recording's): amplitude sin(2 pi (f t +
/// phase)).
///
/// Parameters of an effect of it, in this order: the amplitude's x, y, z, neutral at 0; frequency f
/// (Hz) and phase (turns), which matter only where the amplitude does.
struct Harmonic {
  static constexpr int kParameters = 5;
  template <class Real>
  using Parameters = std::array<Real, kParameters>;

  template <class Real>
  static Vector3<Real> amplitude(const Parameters<Real>& p) {
    return {p[0], p[1], p[2]};
  }

  template <class Real>
  static Real sine(const Parameters<Real>& p, double time_s) {
    return sine_of_turns(p[3] * Real(time_s) + p[4]);
  }

  static std::vector<EffectParameter> parameters(const EffectParameter& amplitude) {
    std::vector<EffectParameter> all = vector_parameter(amplitude);
    all.push_back({.name = "frequency",
                   .unit = "Hz",
                   .neutral = 1,
                   .lower = 0.05,
                   .upper = 20,
                   .typical = 0.1});
    all.push_back({.name = "phase",
                   .unit = "turns",
                   .neutral = 0,
                   .lower = -0.5,
                   .upper = 0.5,
                   .typical = 0.05});
    return all;
  }
};

}  // namespace clothfit
