#pragma once

namespace clothfit {

struct BeamEntry;
struct SearchContext;

/// Puts simpler hypotheses in place of accepted ones. A gust whose period is long is a wind, and a
/// search can come to it by a fit of the wind that went astray. Each hypothesis that was tried in
/// an accepted one's place, has fewer numbers, and changes residuals much like it, is fitted where
/// the final model stands. The simplest one counts without which chi-square rises by less than is
/// worth a name. It must pass what the accepted one has passed. That one is alike then.
void simplify(const SearchContext& search, BeamEntry& entry);

}  // namespace clothfit
