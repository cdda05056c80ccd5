#pragma once

#include "fit/fit.h"

namespace clothfit {

/// Changes a recording's 3D tracks as if an effect had acted that the recording does not mention.
/// The recording is a synthetic cloth's (tests/fit/synthetic_cloth.h), with its own fabric, noise
/// and seed. The mesh is 9 x 9, at a time step of its own.
FitInput moved_by(const DeclaredEffect& hidden, FitInput input);

}  // namespace clothfit
