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
  bool was_fitted = true;     ///< false where contact alone ended the race before it
};

/// Returns the model that leaves least. `extended` is not empty.
const Extended& best_of(const SearchContext& search, const std::vector<Extended>& extended);

/// Tells whether a model with a hypothesis leaves much of what the model without it leaves.
bool leaves_good_part(const SearchContext& search, const Extended& extended,
                      const FittedModel& without);

/// Takes an entry that has found nothing for the base of all others.
void begin_at(SearchContext& search, BeamEntry& entry);

/// Moves an entry to another model of the same hypotheses. What was scored where it stood says
/// nothing of it there.
void stand_at(SearchContext& search, BeamEntry& entry, FittedModel there);

/// Refines a base model that was left unrefined. Where that does not work out, it stands as it is.
void converge(SearchContext& search, BeamEntry& entry);

/// Identifies a model from scratch where it is far off. The result is taken where it leaves less:
/// its optimum may lie in another basin than the one that the model was led into. Returns whether
/// the model has moved.
bool look_for_better_basin(const SearchContext& search, FittedModel& model);

/// Identifies promising hypotheses from scratch where even the best leaves a good part and is far
/// off. A hypothesis is promising that is predicted to take half as much as the best; where there
/// is a coarse mesh, only the one that leaves least is looked at. It may be right in another basin
/// than the one in which `without` stands.
void look_in_other_basins(const SearchContext& search, std::vector<Extended>& extended,
                          const FittedModel& without);

/// Returns the model without the best hypothesis, in the basin that this hypothesis led to. So the
/// basin is not credited to the hypothesis. The model is not usable where it does not leave clearly
/// less there, nor where the hypothesis is predicted to be worth all that it took.
FittedModel in_basin_of(const SearchContext& search, const Extended& best,
                        const FittedModel& without);

}  // namespace clothfit
