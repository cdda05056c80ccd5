#pragma once

namespace clothfit {

struct BeamEntry;
struct SearchContext;

/// Drops hypotheses that those accepted after them make needless. A hypothesis is needless where
/// the model without it fits as well, by what counts as a gain. One that made up for a hypothesis
/// on credit stays. The last one has just been found to be needed, and stays unless the entry has
/// changed its basin since.
void prune(const SearchContext& search, BeamEntry& entry);

}  // namespace clothfit
