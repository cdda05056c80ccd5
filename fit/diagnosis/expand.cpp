#include "fit/diagnosis/expand.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "fit/diagnosis/basin.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/refit.h"
#include "fit/diagnosis/search_context.h"
#include "fit/diagnosis/shortlist.h"
#include "fit/diagnosis/worth.h"
#include "fit/jobs/parallel.h"

namespace clothfit {
namespace {

/// Returns the best scores of a list that may pass.
std::vector<const Score*> worth_fitting(const SearchContext& search, const FittedModel& model,
                                        const Shortlist& list) {
  std::vector<const Score*> scores;
  const double least_gain = search.worth(model);
  for (const Score& score : list.best) {
    if (score.decrease < least_decrease(score.amplitude.size())) continue;
    // A fit gains about what was predicted where little is left over all frames.
    if (list.is_of_whole_run() && kCriteria.more_than_predicted * score.decrease < least_gain)
      continue;
    if (scores.size() == static_cast<size_t>(search.options.refits)) break;
    scores.push_back(&score);
  }
  return scores;
}

/// Fits models of the coarse mesh on the analysed one, side by side. Those that leave least are
/// fitted from where they stand. Where that leaves more than the model without the hypothesis does,
/// or none works out, the fit begins where that model stands. All others fail, and so do those that
/// fall out.
std::vector<FittedModel> on_analysed_mesh(const SearchContext& search, const FittedModel& without,
                                          std::vector<FittedModel> models) {
  const auto above = [&](const FittedModel& model) {
    return search.left_by(model) - static_cast<double>(model.residual_count());
  };
  double least = std::numeric_limits<double>::infinity();
  for (const FittedModel& model : models)
    if (model.usable())
      least =
          std::min(least, std::max(above(model), kCriteria.race_of_noise *
                                                     static_cast<double>(model.residual_count())));
  std::vector<size_t> best;
  std::vector<FittedModel> coarse;
  for (size_t k = 0; k < models.size(); ++k) {
    FittedModel& model = models[k];
    if (model.usable() && above(model) <= kCriteria.coarse_far_behind * least) {
      best.push_back(k);
      coarse.push_back(std::move(model));
    }
    model.state = FitState::failed;
  }
  std::vector<FittedModel> fitted =
      race_on_mesh(search.setup, coarse, search.threshold, search.progress);
  const bool none = std::ranges::none_of(fitted, &FittedModel::usable);
  for_each_index(best.size(), [&](size_t k) {
    FittedModel& model = models[best[k]] = std::move(fitted[k]);
    if ((!model.usable() && !none) || search.left_by(model) < search.left_by(without)) return;
    model = with_hypotheses(search.setup, without, coarse[k].hypotheses, {});
    refine_model(model, search.setup, {}, search.progress);
  });
  return models;
}

std::vector<Extended> fit_shortlist(const SearchContext& search, const FittedModel& model,
                                    const Shortlist& list) {
  const std::vector<const Score*> scores = worth_fitting(search, model, list);
  std::vector<FittedModel> fitted;
  if (list.coarse.usable())
    fitted = on_analysed_mesh(search, model,
                              fit_with_hypotheses(search.coarse, list.coarse, list.early, scores,
                                                  list.share, search.threshold, search.progress));
  else
    fitted = fit_with_hypotheses(search.setup, model, list.early, scores, list.share,
                                 search.threshold, search.progress);
  std::vector<Extended> extended;
  for (size_t k = 0; k < scores.size(); ++k)
    extended.push_back({.score = scores[k], .model = std::move(fitted[k])});
  return extended;
}

/// Gives error directions of their own to the models that leave least. Those are meant that stand
/// far from where the entry's directions were taken.
void let_best_err(const SearchContext& search, std::vector<Extended>& extended,
                  const FittedModel& without) {
  const double from = without.chi_square(search.threshold);
  double best = 0;
  for (const Extended& child : extended)
    if (child.model.usable())
      best = std::max(best, from - child.model.chi_square(search.threshold));
  for_each_index(extended.size(), [&](size_t k) {
    FittedModel& model = extended[k].model;
    if (model.usable() && model.parts.front().directions.cols() == 0 &&
        from - model.chi_square(search.threshold) >= kCriteria.own_errors_of_best * best)
      refine_with_discretisation(model, search.setup, search.progress);
  });
}

/// Tries each hypothesis. A model that was fitted with updated derivatives and is not refused is
/// refined, and asked again.
std::vector<Trial> try_all(const SearchContext& search, std::vector<Extended>& extended,
                           const FittedModel& without, const CrossValidation& without_left_out,
                           bool scored_elsewhere) {
  std::vector<Trial> trials(extended.size());
  for_each_index(extended.size(), [&](size_t k) {
    FittedModel& with = extended[k].model;
    const Compared models{.without = without,
                          .without_left_out = without_left_out,
                          .score = *extended[k].score,
                          .with = with,
                          .scored_elsewhere = scored_elsewhere};
    trials[k] = try_hypothesis(search, models);
    if (!(trials[k].passed() || trials[k].on_credit) || !with.is_unrefined()) return;
    refine_model(with, search.setup, {}, search.progress);
    trials[k] = try_hypothesis(search, models);
  });
  return trials;
}

/// Makes the entry that a hypothesis leads to.
BeamEntry child_of(const SearchContext& search, const BeamEntry& entry, Extended& extended,
                   const Trial& trial, const CrossValidation& without_left_out) {
  BeamEntry child{
      .model = std::move(extended.model),
      .accepted = entry.accepted,
      .basin = extended.from_scratch ? BasinOrigin::from_scratch : BasinOrigin::of_parent,
      .last = {},
      .refused = {}};
  child.cost = search.cost(child.model);
  if (trial.on_credit)
    child.must_still_beat = std::min(entry.must_still_beat, without_physics(without_left_out));
  else if (trial.cross_validated >= entry.must_still_beat)
    child.must_still_beat = entry.must_still_beat;
  child.accepted.push_back({.trial = trial, .alike = {}, .refused = {}});
  return child;
}

/// Fits shapes between those of the grid too, for hypotheses that are near the best.
void fit_shapes(const SearchContext& search, std::vector<BeamEntry>& children) {
  if (children.empty()) return;
  const double reach =
      kCriteria.shape_fit_of_best * children.front().accepted.back().trial.decrease;
  const double best = children.front().cost;
  for (BeamEntry& child : children) {
    std::vector<Hypothesis> hypotheses = child.model.hypotheses;
    const bool is_fitted = std::ranges::any_of(hypotheses, [&](const Hypothesis& hypothesis) {
      return hypothesis.fits_shape && share_shape(hypothesis, hypotheses.back());
    });
    if (hypotheses.back().shape.empty() || is_fitted || child.cost > best + reach) continue;
    hypotheses.back().fits_shape = true;
    FittedModel with_shape = with_hypotheses(search.setup, child.model, hypotheses, {});
    refine_model(with_shape, search.setup, {.rounds = 1}, search.progress);
    if (!with_shape.usable() || search.cost(with_shape) >= child.cost) continue;
    Trial& trial = child.accepted.back().trial;
    trial.decrease +=
        child.model.chi_square(search.threshold) - with_shape.chi_square(search.threshold);
    trial.hypothesis = with_shape.hypotheses.back();
    child.model = std::move(with_shape);
    child.cost = search.cost(child.model);
  }
  std::ranges::stable_sort(children, {}, &BeamEntry::cost);
}

/// Returns the hypotheses that this recording cannot tell from the one accepted last. Fitted in its
/// place they leave hardly more.
std::vector<Hypothesis> alike(const std::vector<BeamEntry>& children, const BeamEntry& best) {
  std::vector<Hypothesis> result;
  for (const BeamEntry& child : children)
    if (&child != &best && child.cost - best.cost < kCriteria.told_apart)
      result.push_back(child.accepted.back().trial.hypothesis);
  return result;
}

}  // namespace

std::vector<BeamEntry> expand(SearchContext& search, BeamEntry& entry, const Shortlist& list) {
  entry.finished = true;
  entry.refused.clear();
  entry.last.clear();
  if (list.is_of_whole_run()) entry.last = list.scores;
  std::vector<Extended> extended = fit_shortlist(search, entry.model, list);

  // The base is refined unless a hypothesis takes nearly all that it leaves. What it leaves above
  // its optimum does not matter then.
  if (extended.empty() || leaves_good_part(search, best_of(search, extended), entry.model))
    converge(search, entry);
  if (extended.empty()) return {};
  look_in_other_basins(search, extended, entry.model);
  let_best_err(search, extended, entry.model);
  FittedModel there = in_basin_of(search, best_of(search, extended), entry.model);
  const bool moves = there.usable();
  if (moves) {
    stand_at(search, entry, std::move(there));
    entry.basin = BasinOrigin::changed;
  }

  const CrossValidation left_out = left_out_of(search, entry.model, &search.coarse);
  if (moves && !entry.is_sound()) entry.must_still_beat = without_physics(left_out);
  std::vector<Trial> trials =
      try_all(search, extended, entry.model, left_out, moves || list.coarse.usable());
  std::vector<BeamEntry> children;
  for (size_t k = 0; k < extended.size(); ++k) {
    if (trials[k].passed() || trials[k].on_credit)
      children.push_back(child_of(search, entry, extended[k], trials[k], left_out));
    // A hypothesis on credit stands among the refused of all others.
    trials[k].on_credit = false;
    if (!trials[k].passed()) entry.refused.push_back(trials[k]);
  }
  std::ranges::stable_sort(children, {}, &BeamEntry::cost);
  fit_shapes(search, children);
  for (BeamEntry& child : children) {
    const Hypothesis& own = child.accepted.back().trial.hypothesis;
    for (const Trial& trial : trials)
      if (!trial.hypothesis.same_mode(own)) child.accepted.back().refused.push_back(trial);
  }
  for (BeamEntry& child : children) child.accepted.back().alike = alike(children, child);
  return children;
}

}  // namespace clothfit
