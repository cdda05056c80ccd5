#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "apps/study/synthetic_scene.h"
#include "fit/fit.h"

namespace clothfit {

/// A recording whose every number is known.
struct SyntheticRecording {
  FitInput input;
  std::map<std::string, double> truth;  ///< of the fit's parameters, by name
};

/// The recording of `seed`. Nothing in it is held out. Throws InputError where the scene's cloth
/// cannot be simulated.
SyntheticRecording make_synthetic_recording(const SyntheticScene& scene, std::uint64_t seed);

}  // namespace clothfit
