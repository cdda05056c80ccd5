#pragma once

#include <vector>

#include "fit/diagnosis/beam.h"

namespace clothfit {

struct SearchContext;
struct Shortlist;

/// Extends an entry by one hypothesis more. The model is fitted with each of the best on the list,
/// and each is tried (trial.h). Returns an entry for each that passed or is followed on credit, the
/// cheapest first. The entry itself is finished. Its model moves where the best hypothesis led to a
/// basin in which the model leaves less without it.
std::vector<BeamEntry> expand(SearchContext& search, BeamEntry& entry, const Shortlist& list);

/// Returns the hypotheses that this recording cannot tell from the one that an entry accepted last.
/// Fitted in its place they leave hardly more.
std::vector<Hypothesis> alike(const std::vector<BeamEntry>& children, const BeamEntry& best);

}  // namespace clothfit
