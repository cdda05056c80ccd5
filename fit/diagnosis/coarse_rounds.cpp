#include "fit/diagnosis/coarse_rounds.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "data/parallel.h"
#include "fit/diagnosis/basin.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/expand.h"
#include "fit/diagnosis/shortlist.h"
#include "fit/diagnosis/space_mapping.h"

namespace clothfit {
namespace {

/// Returns what a model leaves above the noise, per residual: a share of the noise at least.
double excess_of(const FittedModel& model) {
  return std::max(model.misfit() - 1, kCriteria.race_of_noise);
}

/// Refines the entries that leave hardly more than the best one. Where they stand before that says
/// nothing of whether a recording can tell them apart.
void refine_near_best(const SearchContext& search, std::vector<BeamEntry>& entries) {
  if (entries.size() < 2) return;
  double least = std::numeric_limits<double>::infinity();
  for (const BeamEntry& entry : entries) least = std::min(least, excess_of(entry.model));
  for_each_index(entries.size(), [&](size_t k) {
    if (excess_of(entries[k].model) > kCriteria.coarse_near_best * least) return;
    FittedModel refined = entries[k].model;
    refine_model(refined, search.setup, kNearEnough, search.progress);
    if (refined.usable()) entries[k].model = std::move(refined);
  });
}

/// Leads entries to the analysed mesh. Those stay that leave less there than the base does.
std::vector<BeamEntry> led(const SearchContext& search, std::vector<BeamEntry> entries) {
  for_each_index(entries.size(), [&](size_t k) {
    entries[k].model = led_to_analysed_mesh(search, entries[k].model);
  });
  std::erase_if(entries, [&](const BeamEntry& entry) {
    return !(search.left_by(entry.model) < search.base_chi_square);
  });
  refine_near_best(search, entries);
  for (BeamEntry& entry : entries) {
    entry.cost = search.cost(entry.model);
    entry.finished = false;
    entry.last.clear();
    entry.accepted.back().trial.hypothesis = entry.model.hypotheses.back();
  }
  std::ranges::stable_sort(entries, {}, &BeamEntry::cost);
  for (BeamEntry& entry : entries) entry.accepted.back().alike = alike(entries, entry);
  return entries;
}

}  // namespace

void search_on_coarse_mesh(const SearchContext& search, const FittedModel& base,
                           CoarseRounds& result) {
  if (!base.misfits_grossly() || !is_coarser(search.coarse, search.setup)) return;
  FittedModel model = fit_on_mesh(search.coarse, base, search.progress);
  if (!model.usable() || !model.misfits_grossly()) return;

  SearchContext coarse(search.coarse, search.options, search.progress);
  coarse.only_chooses = true;
  coarse.threshold = search.threshold;
  BeamEntry first{.model = std::move(model), .accepted = {}, .last = {}, .refused = {}};
  begin_at(coarse, first);
  Beam beam(std::move(first), static_cast<size_t>(search.options.beam_width),
            search.options.most_effects);
  while (BeamEntry* next = beam.next()) {
    if (!beam.best().model.misfits_grossly()) break;
    const Shortlist list = make_shortlist(coarse, next->model);
    if (result.first.empty()) {
      result.first = list.merged();
      result.first_share = list.share;
    }
    std::vector<BeamEntry> children = expand(coarse, *next, list);
    if (next->accepted.empty()) result.refused = next->refused;
    beam.add(std::move(children), coarse.base_cost);
  }
  std::vector<BeamEntry> entries = beam.release();
  const double enough = kCriteria.coarse_far_behind * excess_of(entries.front().model);
  std::erase_if(entries, [&](const BeamEntry& entry) {
    return entry.accepted.empty() || excess_of(entry.model) > enough;
  });
  result.found = led(search, std::move(entries));
}

}  // namespace clothfit
