#pragma once

namespace clothfit {

struct BeamEntry;
struct SearchContext;

/// Drops hypotheses that those accepted after them make needless: the model without one fits as
/// well, by what counts as a gain. Nothing is dropped that made up for a hypothesis on credit. The
/// last one has just been found to be needed, unless the entry has changed its basin since.
void prune(const SearchContext& search, BeamEntry& entry);

}  // namespace clothfit
