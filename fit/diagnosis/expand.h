#pragma once

#include <vector>

#include "fit/diagnosis/beam.h"

namespace clothfit {

struct SearchContext;
struct Shortlist;

/// Extends an entry by one hypothesis more: fits the model with each of the best on the list, asks
/// what there is to ask of each (trial.h), and returns an entry for each that passed or is followed
/// on credit, the cheapest first. The entry itself is finished; its model moves where the best
/// hypothesis led to a basin in which it leaves less without it.
std::vector<BeamEntry> expand(SearchContext& search, BeamEntry& entry, const Shortlist& list);

}  // namespace clothfit
