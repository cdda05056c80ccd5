#pragma once

#include <array>
#include <vector>

#include "model/cloth/effect.h"
#include "model/effects/number.h"
#include "model/effects/vector_parameter.h"

namespace clothfit {

/// A vector that comes and goes with time t (s, the recording's): amplitude sin(2 pi (f t +
/// phase)).
///
/// An effect with a harmonic has these parameters, in this order: the amplitude's x, y, z, neutral
/// at 0; frequency f (Hz) and phase (turns), which matter only where the amplitude does.
struct Harmonic {
  static constexpr int kParameters = 5;
  template <class Real>
  using Parameters = std::array<Real, kParameters>;

  template <class Real>
  static Vector3<Real> vector(const Parameters<Real>& p, double time_s) {
    return sine_of_turns(p[3] * Real(time_s) + p[4]) * Vector3<Real>{p[0], p[1], p[2]};
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

  /// Returns the mode of an amplitude named `amplitude`. Half a turn more is the other sign. Half a
  /// turn over the duration lies between neighbouring frequencies: further apart, frequencies
  /// between them are lost.
  static std::vector<EffectMode> modes(const std::string& amplitude) {
    return {{.name = "",
             .amplitudes = {amplitude + "_x", amplitude + "_y", amplitude + "_z"},
             .shapes = {{.parameter = "frequency",
                         .values = {0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5, 5.5, 6},
                         .per_duration = true},
                        {.parameter = "phase", .values = {0, 0.125, 0.25, 0.375}}}}};
  }

  /// Says whether a mode's shapes begin with those of a harmonic. A small one at any phase is a sum
  /// of two: at phase 0 times the phase's cosine, and at a quarter turn times its sine.
  static bool is_followed_by(const EffectMode& mode) {
    return mode.shapes.size() >= 2 && mode.shapes[0].parameter == "frequency" &&
           mode.shapes[1].parameter == "phase";
  }
};

}  // namespace clothfit
