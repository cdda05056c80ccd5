#include "fit/diagnosis/simplify.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "data/parallel.h"
#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/beam.h"
#include "fit/diagnosis/clearance.h"
#include "fit/diagnosis/rival.h"
#include "fit/diagnosis/search_context.h"
#include "fit/diagnosis/trial.h"
#include "fit/diagnosis/worth.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

/// Returns the trial of a simpler hypothesis. It is that of the accepted one, whose model without
/// the hypothesis is the same; what it measures of the model with it is measured once more.
Trial trial_of_simpler(const SearchContext& search, const Trial& accepted, const FittedModel& model,
                       size_t k, double rise, double least) {
  Trial trial = accepted;
  trial.hypothesis = model.hypotheses[k];
  trial.decrease -= rise;
  trial.cross_validated = left_out_of(search, model).mean;
  // The last hypothesis is the one that is asked.
  FittedModel last = model;
  std::rotate(last.hypotheses.begin() + static_cast<std::ptrdiff_t>(k),
              last.hypotheses.begin() + static_cast<std::ptrdiff_t>(k) + 1, last.hypotheses.end());
  trial.clear_of_neutral =
      clear_of_neutral(last, judge_adequacy(model, search.setup.options.loss), search.threshold);
  for (Criterion& criterion : trial.criteria) {
    if (criterion.name == "decrease" || criterion.name == "worth_naming") {
      criterion.measured = trial.decrease;
      criterion.passed = !(trial.decrease < criterion.threshold);
    } else if (criterion.name == "left_out" || criterion.name == "free_forces" ||
               criterion.name == "corrections") {
      criterion.passed = trial.cross_validated < criterion.threshold ||
                         (criterion.passed && trial.cross_validated <= criterion.measured);
      criterion.measured = trial.cross_validated;
    } else if (criterion.name == "clear_of_neutral") {
      criterion.measured = trial.clear_of_neutral;
      criterion.passed = !(trial.clear_of_neutral < criterion.threshold);
    } else if (criterion.name == "matters") {
      criterion.measured = change_of_prediction(model, trial.hypothesis);
      criterion.passed = !(criterion.measured < criterion.threshold);
    }
  }
  trial.criteria.push_back({"as_simple", rise, least, true, ""});
  return trial;
}

/// Tells whether another hypothesis of the model is of an effect.
bool has_beside(const FittedModel& model, size_t k, const std::string& effect) {
  for (size_t other = 0; other < model.hypotheses.size(); ++other)
    if (other != k && model.hypotheses[other].effect == effect) return true;
  return false;
}

/// Returns the hypotheses that were tried in place of hypothesis `k` and have fewer numbers, the
/// simplest first. One without a shape has no numbers to spare.
std::vector<Hypothesis> simpler_than(const AcceptedEffect& accepted, const FittedModel& model,
                                     size_t k) {
  std::vector<Hypothesis> simpler;
  if (accepted.trial.hypothesis.shape.empty()) return simpler;
  for (const Trial& trial : accepted.refused)
    if (trial.hypothesis.number_count() < accepted.trial.hypothesis.number_count() &&
        !describe_effect(trial.hypothesis.effect).touches &&
        !has_beside(model, k, trial.hypothesis.effect))
      simpler.push_back(trial.hypothesis);
  std::ranges::stable_sort(simpler, {}, &Hypothesis::number_count);
  return simpler;
}

/// Puts the simplest hypothesis that does as well in place of hypothesis `k` of the model.
void put_simpler(const SearchContext& search, BeamEntry& entry, size_t k,
                 AcceptedEffect& accepted) {
  const std::vector<Hypothesis> rivals = simpler_than(accepted, entry.model, k);
  if (rivals.empty() || accepted.trial.on_credit) return;
  const Change change = change_by(search.setup, entry.model, k);
  if (change.of_residuals.size() == 0) return;
  std::vector<FittedModel> models(rivals.size());
  for_each_index(rivals.size(), [&](size_t n) {
    models[n] =
        with_rival(search.setup, entry.model, k, change, rivals[n], kNearEnough, search.progress);
  });
  for (size_t n = 0; n < rivals.size(); ++n) {
    FittedModel& simple = models[n];
    const auto numbers = static_cast<Eigen::Index>(accepted.trial.hypothesis.number_count() -
                                                   rivals[n].number_count());
    const auto rise = [&] {
      return search.left_by(simple) - entry.model.chi_square(search.threshold);
    };
    // That a form is not exact is no reason to prefer another one.
    const auto least = [&] {
      return std::max(least_decrease(numbers), worth_naming(simple, search.threshold));
    };
    if (!simple.usable() || rise() >= kNearEnoughFallsBy * least()) continue;
    refine_model(simple, search.setup, {}, search.progress);
    if (!simple.usable() || rise() >= least()) continue;
    Trial trial = trial_of_simpler(search, accepted.trial, simple, k, rise(), least());
    if (!trial.passed()) continue;
    std::erase_if(accepted.refused,
                  [&](const Trial& other) { return other.hypothesis.same_mode(rivals[n]); });
    std::erase_if(accepted.alike,
                  [&](const Hypothesis& other) { return other.same_mode(rivals[n]); });
    accepted.alike.push_back(accepted.trial.hypothesis);
    accepted.trial = std::move(trial);
    entry.model = std::move(simple);
    entry.last.clear();
    return;
  }
}

}  // namespace

void simplify(const SearchContext& search, BeamEntry& entry) {
  const size_t given = entry.model.hypotheses.size() - entry.accepted.size();
  for (size_t k = 0; k < entry.accepted.size(); ++k)
    put_simpler(search, entry, given + k, entry.accepted[k]);
}

}  // namespace clothfit
