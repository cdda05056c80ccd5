#include "fit/diagnosis/expand.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "data/parallel.h"
#include "fit/diagnosis/basin.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/refit.h"
#include "fit/diagnosis/rival.h"
#include "fit/diagnosis/search_context.h"
#include "fit/diagnosis/shortlist.h"
#include "fit/diagnosis/space_mapping.h"
#include "fit/diagnosis/worth.h"
#include "fit/problem/effects_of.h"

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

/// Fits the shape of a model's last hypothesis too. The result is not usable where the hypothesis
/// has none, or where another one of the model has it fitted already.
FittedModel with_shape_fitted(const SearchContext& search, const DiagnosisSetup& setup,
                              const FittedModel& model) {
  if (!model.usable()) return {};
  std::vector<Hypothesis> hypotheses = model.hypotheses;
  const bool is_fitted = std::ranges::any_of(hypotheses, [&](const Hypothesis& hypothesis) {
    return hypothesis.fits_shape && share_shape(hypothesis, hypotheses.back());
  });
  if (hypotheses.back().shape.empty() || is_fitted) return {};
  hypotheses.back().fits_shape = true;
  FittedModel result = with_hypotheses(setup, model, hypotheses, {});
  refine_model(result, setup, {.rounds = 1}, search.progress);
  return result;
}

/// Fits shapes between those of the grid too, for models of the coarse mesh that are near the best.
void fit_shapes_of_best(const SearchContext& search, const FittedModel& without,
                        std::vector<FittedModel>& models) {
  double best = std::numeric_limits<double>::infinity();
  for (const FittedModel& model : models) best = std::min(best, search.left_by(model));
  const double reach = kCriteria.shape_fit_of_best * (search.left_by(without) - best);
  for_each_index(models.size(), [&](size_t k) {
    if (!models[k].usable() || search.left_by(models[k]) > best + reach) return;
    FittedModel with_shape = with_shape_fitted(search, search.coarse, models[k]);
    if (!with_shape.usable()) return;
    if (search.cost(with_shape) < search.cost(models[k])) models[k] = std::move(with_shape);
  });
}

/// Fits hypotheses once more that change residuals much like the best one's and leave more, from
/// where that one led. Where much is missing, a fit from far away ends where it happens to.
void start_from_best(const SearchContext& search, const DiagnosisSetup& setup,
                     const FittedModel& without, std::vector<FittedModel>& models) {
  if (models.empty() || !search.is_far_off(without)) return;
  const FittedModel best = *std::ranges::min_element(
      models, {}, [&](const FittedModel& m) { return search.left_by(m); });
  if (!best.usable() || describe_effect(best.hypotheses.back().effect).touches) return;
  const size_t last = best.hypotheses.size() - 1;
  const Change change = change_by(setup, best, last);
  if (change.of_residuals.size() == 0) return;
  for_each_index(models.size(), [&](size_t k) {
    if (models[k].hypotheses.empty() ||
        search.left_by(models[k]) < search.left_by(best) + kCriteria.told_apart)
      return;
    const Hypothesis& rival = models[k].hypotheses.back();
    if (describe_effect(rival.effect).touches || share_shape(rival, best.hypotheses.back())) return;
    FittedModel again = with_rival(setup, best, last, change, rival, kNearEnough, search.progress);
    if (search.left_by(again) < search.left_by(models[k])) models[k] = std::move(again);
  });
}

/// Returns what a model leaves above the noise, a share of the noise at least.
double above_noise(const SearchContext& search, const FittedModel& model) {
  const auto count = static_cast<double>(model.residual_count());
  return std::max(search.left_by(model) - count, kCriteria.race_of_noise * count);
}

/// Fits models of the coarse mesh on the analysed one. Those that leave hardly more than the best
/// one are led there side by side. Another one is led there if it leaves no more than the best one
/// does there, by a factor. All others fail, and so do those that gain far less on the coarse mesh
/// than is worth a name. Where a model leaves more there than the model without the hypothesis, the
/// fit begins where that model stands.
std::vector<FittedModel> on_analysed_mesh(const SearchContext& search, const FittedModel& without,
                                          const FittedModel& coarse_without,
                                          std::vector<FittedModel> models) {
  const double most =
      search.left_by(coarse_without) - kCriteria.coarse_worth * search.worth(without);
  std::vector<size_t> order;
  for (size_t k = 0; k < models.size(); ++k)
    if (search.left_by(models[k]) < most) order.push_back(k);
  std::ranges::stable_sort(order, {}, [&](size_t k) { return above_noise(search, models[k]); });
  std::vector<FittedModel> coarse = std::move(models);
  models.assign(coarse.size(), FittedModel());
  const auto lead = [&](size_t k) {
    models[k] = led_to_analysed_mesh(search, coarse[k]);
    if (search.left_by(models[k]) < search.left_by(without)) return;
    models[k] = with_hypotheses(search.setup, without, at_fitted_shapes(coarse[k]), {});
    refine_model(models[k], search.setup, {}, search.progress);
  };
  size_t led = 0;
  if (!order.empty()) {
    const double near_best =
        kCriteria.coarse_near_best * above_noise(search, coarse[order.front()]);
    while (led < order.size() && above_noise(search, coarse[order[led]]) <= near_best) ++led;
  }
  for_each_index(led, [&](size_t n) { lead(order[n]); });
  double best = std::numeric_limits<double>::infinity();
  for (size_t n = 0; n < order.size(); ++n) {
    const size_t k = order[n];
    if (n >= led) {
      if (above_noise(search, coarse[k]) > kCriteria.coarse_far_behind * best) break;
      lead(k);
    }
    if (models[k].usable()) best = std::min(best, above_noise(search, models[k]));
  }
  return models;
}

/// Tells whether the coarse mesh errs by far less than a model leaves. Where it errs by as much,
/// its fits follow its own error.
bool coarse_mesh_will_do(const FittedModel& model, const FittedModel& coarse) {
  double errs = 0;
  for (const PooledPart& part : coarse.parts) errs += part.correction.squaredNorm();
  const auto count = static_cast<double>(model.residual_count());
  return errs < kCriteria.coarse_error * count * model.misfit();
}

/// Fits hypotheses on the analysed mesh over growing horizons.
std::vector<FittedModel> fit_over_horizons(const SearchContext& search, const FittedModel& model,
                                           const Shortlist& list,
                                           const std::vector<const Score*>& scores) {
  FittedModel early = shortened(model, list.share);
  if (list.share < 1) refine_model(early, search.setup, {.rounds = 1}, search.progress);
  if (!early.usable()) return std::vector<FittedModel>(scores.size());
  return fit_with_hypotheses(search.setup, model, early, scores, list.share, search.threshold,
                             search.progress);
}

std::vector<Extended> fit_shortlist(const SearchContext& search, const FittedModel& model,
                                    const Shortlist& list) {
  const std::vector<const Score*> scores = worth_fitting(search, model, list);
  std::vector<FittedModel> fitted;
  std::vector<Extended> extended;
  const auto note_what_was_fitted = [&] {
    for (size_t k = 0; k < scores.size(); ++k)
      extended.push_back(
          {.score = scores[k], .model = {}, .was_fitted = fitted[k].state != FitState::not_run});
  };
  if (list.coarse.usable() && !coarse_mesh_will_do(model, list.coarse)) {
    fitted = fit_over_horizons(search, model, list, scores);
    note_what_was_fitted();
  } else if (list.coarse.usable()) {
    fitted = fit_with_hypotheses(search.coarse, list.coarse, list.early, scores, list.share,
                                 search.threshold, search.progress);
    note_what_was_fitted();
    start_from_best(search, search.coarse, list.coarse, fitted);
    fit_shapes_of_best(search, list.coarse, fitted);
    fitted = on_analysed_mesh(search, model, list.coarse, std::move(fitted));
  } else {
    fitted = fit_with_hypotheses(search.setup, model, list.early, scores, list.share,
                                 search.threshold, search.progress);
    if (search.only_chooses) start_from_best(search, search.setup, model, fitted);
  }
  if (extended.empty()) note_what_was_fitted();
  for (size_t k = 0; k < scores.size(); ++k) extended[k].model = std::move(fitted[k]);
  return extended;
}

/// Gives error directions of their own to the models that leave least. Those are meant that stand
/// far from where the entry's directions were taken.
void let_best_err(const SearchContext& search, std::vector<Extended>& extended,
                  const FittedModel& without) {
  if (search.only_chooses) return;
  const double from = without.chi_square(search.threshold);
  double best = 0;
  for (const Extended& child : extended)
    if (child.model.usable())
      best = std::max(best, from - child.model.chi_square(search.threshold));
  for_each_index(extended.size(), [&](size_t k) {
    FittedModel& model = extended[k].model;
    if (model.usable() && model.misfit() <= kCriteria.biased &&
        model.parts.front().directions.cols() == 0 &&
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

/// Moves the shape of a model's last hypothesis as the coarse mesh has it, corrected by what the
/// meshes differ by. Derivatives by a shape cost too much on the analysed mesh.
FittedModel with_shape_by_coarse_mesh(const SearchContext& search, const FittedModel& model) {
  const FittedModel coarse =
      with_shape_fitted(search, search.coarse, corrected_on_mesh(search.coarse, model));
  if (!coarse.usable()) return {};
  FittedModel moved = led_to_analysed_mesh(search, coarse);
  if (!moved.usable()) return moved;
  for (size_t n = 0; n < moved.parts.size(); ++n) {
    moved.parts[n].correction = model.parts[n].correction;
    moved.parts[n].directions = model.parts[n].directions;
  }
  refine_model(moved, search.setup, {}, search.progress);
  return moved;
}

/// Fits shapes between those of the grid too, for hypotheses that are near the best.
void fit_shapes(const SearchContext& search, std::vector<BeamEntry>& children) {
  if (children.empty()) return;
  const double reach =
      kCriteria.shape_fit_of_best * children.front().accepted.back().trial.decrease;
  const double best = children.front().cost;
  for (BeamEntry& child : children) {
    if (child.cost > best + reach) continue;
    FittedModel with_shape = is_coarser(search.coarse, search.setup)
                                 ? with_shape_by_coarse_mesh(search, child.model)
                                 : with_shape_fitted(search, search.setup, child.model);
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

}  // namespace

std::vector<Hypothesis> alike(const std::vector<BeamEntry>& children, const BeamEntry& best) {
  std::vector<Hypothesis> result;
  for (const BeamEntry& child : children)
    if (&child != &best && child.cost - best.cost < kCriteria.told_apart)
      result.push_back(child.accepted.back().trial.hypothesis);
  return result;
}

namespace {

/// Extends an entry by what contact, which was refused, has kept from the race.
std::vector<BeamEntry> expand_without_contact(SearchContext& search, BeamEntry& entry,
                                              Shortlist list) {
  std::erase_if(list.best, [](const Score& score) { return !score.fitted.empty(); });
  std::vector<Trial> refused = std::move(entry.refused);
  std::vector<BeamEntry> children = expand(search, entry, list);
  for (Trial& trial : refused)
    if (describe_effect(trial.hypothesis.effect).touches) entry.refused.push_back(std::move(trial));
  return children;
}

}  // namespace

std::vector<BeamEntry> expand(SearchContext& search, BeamEntry& entry, const Shortlist& list) {
  entry.finished = true;
  entry.refused.clear();
  entry.last.clear();
  if (list.is_of_whole_run()) entry.last = list.scores;
  if (!search.only_chooses) search.enter("fits");
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

  if (!search.only_chooses) search.enter("trials");
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
  const bool contact_alone = !std::ranges::all_of(extended, &Extended::was_fitted);
  return children.empty() && contact_alone ? expand_without_contact(search, entry, list)
                                           : std::move(children);
}

}  // namespace clothfit
