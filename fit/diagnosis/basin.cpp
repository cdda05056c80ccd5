#include "fit/diagnosis/basin.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/cost/huber.h"
#include "fit/diagnosis/beam.h"
#include "fit/diagnosis/clearance.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/refit.h"
#include "fit/diagnosis/search_context.h"
#include "fit/diagnosis/space_mapping.h"
#include "fit/diagnosis/worth.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

/// Identifies the model with these hypotheses from scratch, and refines it with its mesh's errors.
/// A basin is that of the coarse mesh too. So that mesh looks for it, and the analysed mesh is
/// asked only where it leaves less than `than` there. Otherwise the result is not usable.
FittedModel from_scratch(const SearchContext& search, const std::vector<Hypothesis>& hypotheses,
                         const FittedModel& than) {
  FittedModel model;
  if (is_coarser(search.coarse, search.setup)) {
    const FittedModel coarse = identified_from_scratch(search.coarse, hypotheses, search.progress);
    if (!coarse.usable()) return {};
    const FittedModel here = fit_on_mesh(search.coarse, than, search.progress);
    const double above = search.left_by(here) - static_cast<double>(here.residual_count());
    if (!here.usable()) return {};
    if (search.left_by(coarse) >= search.left_by(here) - kCriteria.other_basin * above) return {};
    model = led_to_analysed_mesh(search, coarse);
  } else {
    model = identified_from_scratch(search.setup, hypotheses, search.progress);
  }
  if (search.left_by(model) >= search.left_by(than)) return {};
  refine_with_discretisation(model, search.setup, search.progress);
  if (search.left_by(model) >= search.left_by(than)) return {};
  return model;
}

}  // namespace

const Extended& best_of(const SearchContext& search, const std::vector<Extended>& extended) {
  return *std::ranges::min_element(
      extended, {}, [&](const Extended& child) { return search.left_by(child.model); });
}

bool leaves_good_part(const SearchContext& search, const Extended& extended,
                      const FittedModel& without) {
  return search.left_by(extended.model) >= kCriteria.good_part * search.left_by(without);
}

void begin_at(SearchContext& search, BeamEntry& entry) {
  search.base_chi_square = entry.model.chi_square(search.threshold);
  search.base_cost = entry.cost = search.cost(entry.model);
}

void stand_at(SearchContext& search, BeamEntry& entry, FittedModel there) {
  entry.model = std::move(there);
  entry.last.clear();
  if (entry.accepted.empty()) {
    search.base = entry.model;
    if (std::isfinite(search.threshold))
      search.threshold = kHuberScales * robust_scale(entry.model.residual());
    begin_at(search, entry);
  }
  entry.cost = search.cost(entry.model);
}

void converge(SearchContext& search, BeamEntry& entry) {
  if (!entry.model.is_unrefined() || !entry.accepted.empty()) return;
  FittedModel converged = entry.model;
  refine_with_discretisation(converged, search.setup, search.progress);
  entry.model.state = FitState::complete;
  if (converged.usable()) stand_at(search, entry, std::move(converged));
}

bool look_for_better_basin(const SearchContext& search, FittedModel& model) {
  if (search.only_chooses || !model.usable() || !search.is_far_off(model)) return false;
  FittedModel other = from_scratch(search, model.hypotheses, model);
  if (!other.usable()) return false;
  model = std::move(other);
  return true;
}

void look_in_other_basins(const SearchContext& search, std::vector<Extended>& extended,
                          const FittedModel& without) {
  if (search.only_chooses || extended.empty()) return;
  const Extended& best = best_of(search, extended);
  if (!best.model.usable() || !search.is_far_off(best.model) ||
      !leaves_good_part(search, best, without))
    return;
  double predicted = 0;
  for (const Extended& child : extended) predicted = std::max(predicted, child.score->decrease);
  // On a fine mesh each one takes long.
  const bool best_alone = is_coarser(search.coarse, search.setup);
  for (Extended& child : extended) {
    if (!child.model.usable() || (best_alone && &child != &best)) continue;
    if (child.score->decrease < kCriteria.from_scratch_of_best * predicted) continue;
    FittedModel other = from_scratch(search, child.model.hypotheses, child.model);
    if (!other.usable()) continue;
    child.model = std::move(other);
    child.from_scratch = true;
  }
}

FittedModel in_basin_of(const SearchContext& search, const Extended& best,
                        const FittedModel& without) {
  if (search.only_chooses || !best.model.usable() || !search.is_far_off(without)) return {};
  // A model that was not refined leaves more than its optimum in its own basin.
  if (without.is_unrefined()) return {};
  const double taken = search.left_by(without) - search.left_by(best.model);
  if (taken <= 0 || describe_effect(best.model.hypotheses.back().effect).touches) return {};
  if (!best.from_scratch && rise_without_last(best.model, search.threshold) > taken) return {};
  FittedModel there = with_hypotheses(search.setup, best.model, without.hypotheses, {});
  refine_model(there, search.setup, {}, search.progress);
  if (there.usable()) refine_with_discretisation(there, search.setup, search.progress);
  // A fit that begins from scratch gains a little even in the same basin. The hypothesis has no
  // part in that gain.
  const double enough = search.left_by(without) - kCriteria.other_basin * taken;
  if (best.from_scratch || (search.left_by(there) < enough && search.is_far_off(there))) {
    FittedModel other = from_scratch(search, without.hypotheses, there);
    if (other.usable()) there = std::move(other);
  }
  if (search.left_by(there) >= enough) return {};
  return there;
}

}  // namespace clothfit
