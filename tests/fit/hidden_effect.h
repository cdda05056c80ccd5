#pragma once

#include "fit/fit.h"

namespace clothfit {

/// The 3D tracks of a synthetic cloth's recording (tests/fit/synthetic_cloth.h, its own fabric,
/// noise and seed) as if an effect had acted that the recording does not mention. On a mesh of 9 x
/// 9, at a time step of its own.
FitInput moved_by(const DeclaredEffect& hidden, FitInput input);

}  // namespace clothfit
