#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "fit/fit.h"
#include "model/fabric.h"

namespace clothfit {

/// What synthetic recordings are made with. The cloth hangs from its two upper corners, is let go
/// flat, and swings; how it is turned before that is drawn anew for each recording.
struct SyntheticScene {
  double size_m = 0.4;    ///< of the square cloth, > 0
  double mass_kg = 0.03;  ///< > 0
  Fabric fabric{.tension_warp_n_per_m = 40,
                .tension_weft_n_per_m = 50,
                .shear_n_per_m = 18,
                .flexion_warp_n_per_m = 9,
                .flexion_weft_n_per_m = 7,
                .damping_warp_s = 2.5e-3,
                .damping_weft_s = 2e-3};
  double drag_per_s = 0;      ///< viscous damping of the air; not declared in the recording, >= 0
  int truth_mesh = 17;        ///< vertices a side of the simulation that is the truth, >= 3
  double truth_steps = 1;     ///< as many times more time steps than stability asks for, >= 1
  int markers = 17;           ///< a side, evenly spread over the cloth, >= 2
  int frames = 61;            ///< >= 10
  double frame_rate_hz = 60;  ///< > 0
  double before_s = 0;        ///< the cloth has swung so long when the recording begins, >= 0
  int cameras = 1;            ///< 1 to 4, 1 m away around the cloth's front
  double noise_m = 1e-3;      ///< of 3D tracks, per coordinate, > 0
  double noise_px = 0.3;      ///< > 0
  bool noisy = true;          ///< false: observations state that noise and have none
  double missing = 0;         ///< share of observations dropped at random, 0 to 0.9
  bool hand = false;          ///< a hand hides a quarter of the cloth for a third of the time
  double outliers = 0;        ///< share of observations off by up to 0.1 m or 60 px, 0 to 0.5

  void validate() const;  ///< throws InputError, naming options of `clothfit recover`
};

/// A recording whose every number is known.
struct SyntheticRecording {
  FitInput input;
  std::map<std::string, double> truth;  ///< of the fit's parameters, by name
};

/// The recording of `seed`. Nothing in it is held out. Throws InputError where the scene's cloth
/// cannot be simulated.
SyntheticRecording make_synthetic_recording(const SyntheticScene& scene, std::uint64_t seed);

}  // namespace clothfit
