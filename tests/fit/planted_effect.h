#pragma once

#include <map>
#include <string>
#include <vector>

#include "fit/fit.h"

namespace clothfit {

/// The demands on a fit that looks for an effect in the recording of a synthetic cloth.
struct PlantedEffect {
  std::string name;
  std::map<std::string, double> truth;  ///< its parameters; no other is looked at
  ObservationKind observations = ObservationKind::tracks3d;
  /// Priors of parameters without a derivative at the neutral value.
  std::vector<ParameterPrior> priors = {};
};

/// Fits with the effect on a mesh of 9 x 9, starting at the true fabric. Expects that it finds
/// every parameter within four of its own sigmas, and tells it from nothing by five. The residual
/// must be no more than the noise.
void expect_found(const FitInput& input, const PlantedEffect& planted);

}  // namespace clothfit
