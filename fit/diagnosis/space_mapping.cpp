#include "fit/diagnosis/space_mapping.h"

#include <utility>

#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/horizons.h"
#include "fit/diagnosis/search_context.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

/// Runs a model of the coarse mesh on the analysed one, over a share of the frames.
FittedModel run_at(const SearchContext& search, const FittedModel& coarse, double share) {
  FittedModel model = model_at(search.setup, coarse.hypotheses, coarse.values());
  model.state = FitState::unrefined;
  for (size_t n = 0; n < model.parts.size(); ++n) {
    PooledPart& part = model.parts[n];
    part.frames = frames_of_share(*model.problems[n], share);
    const TrajectoryObjective objective = model.objective(n);
    part.linear.residual = objective.residuals({part.values}).front();
    if (part.linear.residual.size() != objective.residual_count()) model.state = FitState::failed;
  }
  return model;
}

}  // namespace

std::vector<Hypothesis> at_fitted_shapes(const FittedModel& model) {
  std::vector<Hypothesis> hypotheses = model.hypotheses;
  const NamedValues values = model.values().front();
  for (Hypothesis& hypothesis : hypotheses) {
    // Where an obstacle is follows from how fine the cloth is that meets it.
    if (!hypothesis.fits_shape || describe_effect(hypothesis.effect).touches) continue;
    for (auto& [name, value] : hypothesis.shape) value = values.at(hypothesis.effect + "." + name);
    hypothesis.fits_shape = false;
  }
  return hypotheses;
}

FittedModel mapped_to_analysed_mesh(const SearchContext& search, const FittedModel& coarse,
                                    double share) {
  constexpr int kMostMaps = 6;
  constexpr double kHardly = 0.01;
  FittedModel here = run_at(search, coarse, share);
  for (int map = 0; map < kMostMaps && here.usable(); ++map) {
    FittedModel next = corrected_on_mesh(search.coarse, here);
    if (next.usable()) refine_model(next, search.coarse, {.rounds = 1}, search.progress);
    if (!next.usable()) break;
    FittedModel there = run_at(search, next, share);
    const double gain = search.left_by(here) - search.left_by(there);
    if (!(gain > 0)) break;
    here = std::move(there);
    if (map == 1 && search.left_by(here) > kCriteria.mapping_lost * search.left_by(coarse)) break;
    if (gain < kHardly * search.left_by(here)) break;
  }
  return here;
}

FittedModel led_to_analysed_mesh(const SearchContext& search, const FittedModel& coarse) {
  FittedModel best = mapped_to_analysed_mesh(search, coarse, 1);
  if (!(search.left_by(best) <= search.left_by(coarse))) {
    FittedModel slowly = coarse;
    for (const double share : shares_from(kFirstOnMesh)) {
      slowly = mapped_to_analysed_mesh(search, slowly, share);
      if (!slowly.usable()) break;
    }
    if (search.left_by(slowly) < search.left_by(best)) best = std::move(slowly);
  }
  if (!best.usable()) return best;
  FittedModel result = model_at(search.setup, at_fitted_shapes(best), best.values());
  result.state = best.state;
  linearise_model(result);
  return result;
}

}  // namespace clothfit
