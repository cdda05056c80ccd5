#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "apps/study/scene/synthetic_scene.h"
#include "fit/fit.h"

namespace clothfit {

/// A recording whose every number is known.
struct SyntheticRecording {
  FitInput input;
  std::map<std::string, double> truth;  ///< the fit's parameters, by name
};

/// Makes the recording of `seed`. Throws InputError where the scene's cloth cannot be simulated.
SyntheticRecording make_synthetic_recording(const SyntheticScene& scene, std::uint64_t seed);

/// Makes one of one seed's release, seen with the noise of another.
SyntheticRecording make_synthetic_recording(const SyntheticScene& scene, std::uint64_t release_seed,
                                            std::uint64_t noise_seed);

}  // namespace clothfit
