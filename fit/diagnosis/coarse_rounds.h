#pragma once

#include <vector>

#include "fit/diagnosis/beam.h"
#include "fit/diagnosis/search_context.h"

namespace clothfit {

/// The outcome of rounds on the coarse mesh.
struct CoarseRounds {
  std::vector<Score> first;      ///< scores of the model without hypotheses; empty: no rounds
  double first_share = 1;        ///< share of the frames that these are over
  std::vector<Trial> refused;    ///< beside the model without hypotheses
  std::vector<BeamEntry> found;  ///< led to the analysed mesh, the cheapest first
};

/// Searches on the coarse mesh as long as the best model misfits grossly. Any mesh shows then what
/// is missing, for a sixteenth of the work. What is found there, and what leaves about as little,
/// is led to the analysed mesh. `result` holds what there is if time is up. There are no rounds
/// where `base` does not misfit grossly, or where there is no coarse mesh.
void search_on_coarse_mesh(const SearchContext& search, const FittedModel& base,
                           CoarseRounds& result);

}  // namespace clothfit
