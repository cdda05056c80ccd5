#pragma once

#include <string>

#include "fit/fit.h"

namespace clothfit {

/// Checks the rules of every effect of the measurement, on the recording of a small cloth. At its
/// neutral values the residuals are those without it. Its derivatives are those of the residuals,
/// from 3D tracks and from pixels. Effects of a camera refuse 3D tracks.
void check_measurement_effect(const std::string& name, const FitInput& input);

}  // namespace clothfit
