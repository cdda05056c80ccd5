#include "fit/diagnosis/search.h"

#include <utility>

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/basin.h"
#include "fit/diagnosis/beam.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/expand.h"
#include "fit/diagnosis/prune.h"
#include "fit/diagnosis/shortlist.h"

namespace clothfit {
namespace {

BeamEntry first_entry(SearchContext& search, FittedModel base) {
  BeamEntry entry{.model = std::move(base), .accepted = {}, .last = {}, .refused = {}};
  begin_at(search, entry);
  return entry;
}

/// Makes the shortlist of the base model, which is refined first unless the coarse mesh does.
Shortlist first_shortlist(SearchContext& search, BeamEntry& entry) {
  Shortlist list = make_shortlist(search, entry.model);
  if (!entry.model.is_unrefined() || list.coarse.usable()) return list;
  converge(search, entry);
  return make_shortlist(search, entry.model);
}

/// Refines an entry's model before it is extended. Returns false where that does not work out.
bool refine(const SearchContext& search, bool is_best, BeamEntry& entry) {
  FittedModel refined = entry.model;
  refine_with_discretisation(refined, search.setup, search.progress);
  if (is_best && entry.basin != BasinOrigin::from_scratch) look_for_better_basin(search, refined);
  if (!refined.usable()) {
    entry.finished = true;
    return false;
  }
  entry.model = std::move(refined);
  entry.cost = search.cost(entry.model);
  return true;
}

/// Extends an entry. Where nothing was found, it is extended once more if it has changed its basin
/// or was scored on the coarse mesh: other hypotheses may show in its own basin, on its own mesh.
std::vector<BeamEntry> extend(SearchContext& search, BeamEntry& entry, const Shortlist& list) {
  std::vector<BeamEntry> children = expand(search, entry, list);
  const bool changed = entry.basin == BasinOrigin::changed;
  if (!children.empty() || (!changed && !list.coarse.usable())) return children;
  converge(search, entry);
  return expand(search, entry, make_shortlist(search, entry.model, changed));
}

/// Makes the result of the best entry, which is converged and pruned first.
SearchResult conclude(SearchContext& search, BeamEntry best, SearchResult result) {
  converge(search, best);
  const bool found = !best.accepted.empty();
  prune(search, best);
  const bool came_back = found && best.accepted.empty();
  if (came_back) search.base = best.model;
  if (best.last.empty())
    best.last = score_at_best_shapes(search, search.setup, best.model, search.untested(best.model));
  result.base = std::move(search.base);
  result.changed_basin = best.basin == BasinOrigin::changed || came_back;
  result.threshold = search.threshold;
  result.model = std::move(best.model);
  result.accepted = std::move(best.accepted);
  result.refused = std::move(best.refused);
  result.last = std::move(best.last);
  return result;
}

}  // namespace

SearchResult search_hypotheses(const DiagnosisSetup& setup, FittedModel base,
                               const SearchOptions& options, const ProgressCallback& progress) {
  SearchContext search(setup, options, progress);
  Beam beam(first_entry(search, std::move(base)), static_cast<size_t>(options.beam_width),
            options.most_effects);
  Shortlist list = first_shortlist(search, beam.best());
  SearchResult result;
  result.first = list.merged();
  result.first_share = list.share;
  while (BeamEntry* next = beam.next()) {
    const bool is_best = next == &beam.best();
    if (!next->accepted.empty()) {
      if (!refine(search, is_best, *next)) continue;
      list = make_shortlist(search, next->model);
    }
    std::vector<BeamEntry> children = extend(search, *next, list);
    if (next->basin == BasinOrigin::changed && next->accepted.empty()) {
      result.first = without_columns(
          score_at_best_shapes(search, setup, next->model, search.untested(next->model)));
      result.first_share = 1;
    }
    const bool is_end = children.empty() && is_best && next->is_sound();
    if (is_end && judge_adequacy(next->model, setup.options.loss).adequate) break;
    beam.add(std::move(children), search.base_cost);
  }
  return conclude(search, std::move(beam.best()), std::move(result));
}

}  // namespace clothfit
