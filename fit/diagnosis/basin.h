#pragma once

#include <vector>

#include "fit/diagnosis/fitted_model.h"
#include "fit/diagnosis/score.h"

namespace clothfit {

struct BeamEntry;
struct SearchContext;

/// A model that was fitted with one hypothesis more.
struct Extended {
  const Score* score = nullptr;
  FittedModel model;
  bool from_scratch = false;  ///< identified as if nothing were known
};

/// The one that leaves least. There is one.
const Extended& best_of(const SearchContext& search, const std::vector<Extended>& extended);

/// Whether a model with a hypothesis leaves much of what the model without it leaves.
bool leaves_good_part(const SearchContext& search, const Extended& extended,
                      const FittedModel& without);

/// Refines a base model that was left unrefined. Where that does not work out it stands as it is.
void converge(SearchContext& search, BeamEntry& entry);

/// Identifies a model that leaves more than noise from scratch, and takes that where it leaves
/// less: its optimum may lie in another basin than the one that it was led into. Of several
/// recordings, which costs more, only a model that is far off.
void look_for_better_basin(const SearchContext& search, FittedModel& model);

/// Identifies hypotheses from scratch that are predicted to take half as much as the best, where
/// even the best leaves a good part and is far off: they may be right in another basin than the one
/// in which `without` stands.
void look_in_other_basins(const SearchContext& search, std::vector<Extended>& extended,
                          const FittedModel& without);

/// The model without the best hypothesis in the basin that this one led to, so that the basin is
/// not credited to it. Not usable where it leaves no clearly less there, nor where the hypothesis
/// is predicted to be worth all that it took.
FittedModel in_basin_of(const SearchContext& search, const Extended& best,
                        const FittedModel& without);

}  // namespace clothfit
