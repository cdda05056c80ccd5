#pragma once

#include <vector>

#include "fit/diagnosis/beam.h"
#include "fit/diagnosis/search_context.h"

namespace clothfit {

/// The outcome of rounds on the coarse mesh.
struct CoarseRounds {
  std::vector<Score> first;     ///< scores of the model without hypotheses; empty: no rounds
  double first_share = 1;       ///< share of the frames that these are over
  std::vector<Trial> refused;   ///< in the last round
  std::vector<BeamEntry> found;  ///< led to the analysed mesh, the cheapest first
};

/// Searches on the coarse mesh as long as the best model misfits grossly. Any mesh shows then what
/// is missing, for a sixteenth of the work. What is found there, and what leaves about as little,
/// is led to the analysed mesh. There are no rounds where `base` does not misfit grossly, or where
/// there is no coarse mesh.
CoarseRounds search_on_coarse_mesh(const SearchContext& search, const FittedModel& base);

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
