#pragma once

#include <string>

#include "fit/fit.h"

namespace clothfit {

/// What every effect of the measurement must keep to, on the recording of a small cloth: at its
/// neutral values the residuals are those without it, and its derivatives are those of the
/// residuals, from 3D tracks and from pixels. Effects of a camera refuse 3D tracks.
void check_measurement_effect(const std::string& name, const FitInput& input);

}  // namespace clothfit
