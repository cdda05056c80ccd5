#pragma once

#include <vector>

#include "fit/diagnosis/fitted_model.h"

namespace clothfit {

struct SearchContext;

/// Returns a model's hypotheses with their fitted shapes taken for known. Blocks left out are
/// predicted along derivatives, which lead astray where a shape is free.
std::vector<Hypothesis> at_fitted_shapes(const FittedModel& model);

/// Moves a model of the coarse mesh to where the analysed mesh leaves least over a share of the
/// frames. Each time the coarse mesh is fitted with the difference of the meshes where it stood
/// before (space mapping [bandler1994]). That costs one run of the analysed mesh.
FittedModel mapped_to_analysed_mesh(const SearchContext& search, const FittedModel& coarse,
                                    double share);

/// Leads a model of the coarse mesh to the analysed one, by the coarse mesh's derivatives. It ends
/// near the optimum there, for a few runs. Where the whole run leaves more than on the coarse mesh,
/// growing horizons are tried. The model is unrefined.
FittedModel led_to_analysed_mesh(const SearchContext& search, const FittedModel& coarse);

}  // namespace clothfit
