#include "fit/diagnosis/search.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/basin.h"
#include "fit/diagnosis/beam.h"
#include "fit/diagnosis/coarse_rounds.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/expand.h"
#include "fit/diagnosis/prune.h"
#include "fit/diagnosis/refit.h"
#include "fit/diagnosis/shortlist.h"
#include "fit/diagnosis/simplify.h"
#include "fit/diagnosis/worth.h"
#include "fit/jobs/stop_token.h"

namespace clothfit {
namespace {

BeamEntry first_entry(SearchContext& search, FittedModel base) {
  BeamEntry entry{.model = std::move(base), .accepted = {}, .last = {}, .refused = {}};
  begin_at(search, entry);
  return entry;
}

/// Fits the shapes of a model's hypotheses where it stands, all at once. They were chosen by the
/// coarse mesh. What that errs by in them would look like another cause.
void refine_shapes(const SearchContext& search, FittedModel& model) {
  if (!is_coarser(search.coarse, search.setup)) return;
  std::vector<Hypothesis> hypotheses = model.hypotheses;
  bool any = false;
  for (Hypothesis& own : hypotheses) {
    const bool is_fitted = std::ranges::any_of(hypotheses, [&](const Hypothesis& other) {
      return &other != &own && other.fits_shape && share_shape(other, own);
    });
    if (own.shape.empty() || own.fits_shape || is_fitted) continue;
    own.fits_shape = any = true;
  }
  if (!any) return;
  FittedModel fitted = with_hypotheses(search.setup, model, hypotheses, {});
  refine_model(fitted, search.setup, kNearEnough, search.progress);
  if (fitted.usable() && search.cost(fitted) < search.cost(model)) model = std::move(fitted);
}

/// Refines an entry's model before it is extended. Returns false where that does not work out.
bool refine(const SearchContext& search, BeamEntry& entry) {
  search.enter("refinement");
  FittedModel refined = entry.model;
  // What a model that lacks much says does not depend on errors of its mesh.
  if (refined.misfit() > kCriteria.biased)
    refine_model(refined, search.setup, kNearEnough, search.progress);
  else
    refine_with_discretisation(refined, search.setup, search.progress);
  if (!refined.usable()) {
    entry.finished = true;
    return false;
  }
  if (refined.misfit() <= kCriteria.biased) {
    refine_shapes(search, refined);
    for (AcceptedEffect& accepted : entry.accepted)
      for (const Hypothesis& own : refined.hypotheses)
        if (own.same_mode(accepted.trial.hypothesis)) accepted.trial.hypothesis = own;
  }
  entry.model = std::move(refined);
  entry.cost = search.cost(entry.model);
  return true;
}

/// Extends an entry. Where nothing was found, it is extended once more if it has changed its basin,
/// or finds a better one now: other hypotheses may show there.
std::vector<BeamEntry> extend(SearchContext& search, BeamEntry& entry, const Shortlist& list,
                              bool is_best) {
  std::vector<BeamEntry> children = expand(search, entry, list);
  if (!children.empty()) return children;
  if (is_best && !entry.accepted.empty() && entry.basin == BasinOrigin::of_parent &&
      look_for_better_basin(search, entry.model)) {
    entry.basin = BasinOrigin::from_scratch;
    stand_at(search, entry, entry.model);
  } else if (entry.basin != BasinOrigin::changed) {
    return children;
  }
  converge(search, entry);
  return expand(search, entry, make_shortlist(search, entry.model));
}

/// Lets the coarse mesh find what a base that misfits grossly lacks. The base is refined unless
/// what is found takes nearly all that it leaves; what it leaves above its optimum does not matter
/// then.
void begin_on_coarse_mesh(SearchContext& search, Beam& beam, SearchResult& result) {
  search.enter("coarse mesh");
  BeamEntry& base = beam.best();
  CoarseRounds rounds;
  const auto note = [&] {
    result.first = std::move(rounds.first);
    result.first_share = rounds.first_share;
    base.refused = std::move(rounds.refused);
  };
  try {
    search_on_coarse_mesh(search, base.model, rounds);
  } catch (const TimeIsUp&) {
    note();
    throw;
  }
  note();
  if (rounds.found.empty()) return converge(search, base);
  if (rounds.found.front().cost >= kCriteria.good_part * search.base_chi_square)
    converge(search, base);
  // The base may leave less now, and by another loss.
  std::erase_if(rounds.found, [&](const BeamEntry& entry) {
    const auto amplitudes =
        static_cast<Eigen::Index>(entry.accepted.back().trial.hypothesis.amplitudes.size());
    return search.base_chi_square - search.left_by(entry.model) <
           std::max(least_decrease(amplitudes), search.worth(base.model));
  });
  for (BeamEntry& entry : rounds.found) {
    entry.cost = search.cost(entry.model);
    if (entry.accepted.size() == 1)
      entry.accepted.front().trial.decrease = search.base_chi_square - search.left_by(entry.model);
  }
  base.finished = !rounds.found.empty();
  beam.add(std::move(rounds.found), search.base_cost);
}

/// Extends the entries of a beam, the cheapest first, until nothing leads on.
void extend_all(SearchContext& search, Beam& beam, SearchResult& result) {
  std::optional<Shortlist> of_base;
  // The base is scored for the report even where nothing may be added to it.
  if (result.first.empty()) {
    search.enter("scores");
    of_base = make_shortlist(search, beam.best().model);
    result.first = of_base->merged();
    result.first_share = of_base->share;
  }
  while (BeamEntry* next = beam.next()) {
    const bool is_best = next == &beam.best();
    if (!next->accepted.empty() && !refine(search, *next)) continue;
    search.enter("scores");
    const Shortlist list = next->accepted.empty() && of_base ? std::move(*of_base)
                                                             : make_shortlist(search, next->model);
    of_base.reset();
    std::vector<BeamEntry> children = extend(search, *next, list, is_best);
    if (next->basin == BasinOrigin::changed && next->accepted.empty()) {
      result.first = without_columns(
          score_at_best_shapes(search, search.setup, next->model, search.untested(next->model)));
      result.first_share = 1;
    }
    const bool is_end = children.empty() && is_best && next->is_sound();
    if (is_end && judge_adequacy(next->model, search.setup.options.loss).adequate) break;
    beam.add(std::move(children), search.base_cost);
  }
}

/// Makes the result of an entry as it stands.
SearchResult result_of(SearchContext& search, BeamEntry entry, SearchResult result) {
  result.base = std::move(search.base);
  result.threshold = search.threshold;
  result.model = std::move(entry.model);
  result.accepted = std::move(entry.accepted);
  result.refused = std::move(entry.refused);
  result.last = std::move(entry.last);
  return result;
}

/// Makes the result of the best entry, which is converged and pruned first.
SearchResult conclude(SearchContext& search, BeamEntry best, SearchResult result) {
  search.enter("pruning");
  const bool found = !best.accepted.empty();
  try {
    converge(search, best);
    if (best.model.is_unrefined() && found) {
      FittedModel refined = best.model;
      refine_with_discretisation(refined, search.setup, search.progress);
      if (refined.usable()) best.model = std::move(refined);
    }
    prune(search, best);
    simplify(search, best);
    if (best.last.empty())
      best.last =
          score_at_best_shapes(search, search.setup, best.model, search.untested(best.model));
  } catch (const TimeIsUp&) {
    result.complete = false;
  }
  const bool came_back = found && best.accepted.empty();
  if (came_back) search.base = best.model;
  result.changed_basin = best.basin == BasinOrigin::changed || came_back;
  return result_of(search, std::move(best), std::move(result));
}

}  // namespace

SearchResult search_hypotheses(const DiagnosisSetup& setup, FittedModel base,
                               const SearchOptions& options, const ProgressCallback& progress) {
  SearchContext search(setup, options, progress);
  Beam beam(first_entry(search, std::move(base)), static_cast<size_t>(options.beam_width),
            options.most_effects);
  SearchResult result;
  try {
    begin_on_coarse_mesh(search, beam, result);
    extend_all(search, beam, result);
  } catch (const TimeIsUp&) {
    result.complete = false;
    return result_of(search, beam.release_best_sound(), std::move(result));
  }
  return conclude(search, std::move(beam.best()), std::move(result));
}

}  // namespace clothfit
