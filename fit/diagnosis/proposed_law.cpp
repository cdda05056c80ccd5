#include "fit/diagnosis/proposed_law.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "data/parallel.h"
#include "fit/diagnosis/catalogue.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/refit.h"
#include "fit/diagnosis/worth.h"
#include "fit/jobs/stop_token.h"
#include "fit/problem/effects_of.h"
#include "fit/uncertainty/uncertainty.h"
#include "model/effects/registry.h"

namespace clothfit {
namespace {

/// Horizons at which terms are scored, as shares of the model's frames. Scores begin with the
/// shortest one at which something is missing, for over all frames that biases the model.
constexpr double kShares[] = {0.3, 0.5, 0.75, 1.0};
constexpr size_t kHorizons = 2;

/// Tells whether frames left out are predicted better, on the whole and in most of the blocks of
/// time.
bool predicts_better(const CrossValidation& one, const CrossValidation& other) {
  if (!one.usable || other.mean - one.mean <= std::max(kCriteria.term_gain_of_noise,
                                                       kCriteria.term_gain * (other.mean - 1)))
    return false;
  size_t blocks = 0;
  for (size_t b = 0; b < one.block.size(); ++b) blocks += one.block[b] < other.block[b] ? 1 : 0;
  return 2 * blocks > one.block.size();
}

/// Writes a value to the second digit of its sigma.
std::string number_text(double value, double sigma) {
  const double size = sigma > 0 ? sigma : std::abs(value);
  const int place = size > 0 ? static_cast<int>(std::floor(std::log10(size))) - 1 : 0;
  if (place >= 0) {
    const double unit = std::pow(10.0, place);
    return fmt::format("{:.0f}", std::round(value / unit) * unit);
  }
  return fmt::format("{:.{}f}", value, -place);
}

/// Returns the left sides of all empirical effects, in the registry's order.
std::vector<std::string> law_sides() {
  std::vector<std::string> sides;
  for (const EffectEntry& entry : effect_registry())
    for (const EffectParameter& parameter : entry.describe().parameters)
      if (!parameter.law_side.empty() &&
          std::ranges::find(sides, parameter.law_side) == sides.end())
        sides.push_back(parameter.law_side);
  return sides;
}

std::string formula_of(const std::vector<LawCoefficient>& coefficients) {
  std::string text;
  for (const std::string& side : law_sides()) {
    std::string sum;
    for (const LawCoefficient& one : coefficients) {
      if (one.side != side) continue;
      // A term may bring a sign of its own.
      const bool opposed = one.term.starts_with('-');
      const bool minus = (one.value < 0) != opposed;
      sum += sum.empty() ? (minus ? "-" : "") : (minus ? " - " : " + ");
      sum += number_text(std::abs(one.value), one.sigma);
      sum += (one.unit == "1" ? "" : " " + one.unit) + " " + one.term.substr(opposed ? 1 : 0);
    }
    if (sum.empty()) continue;
    text += (text.empty() ? "" : "\n") + fmt::format("{} = {}", side, sum);
  }
  return text;
}

class Pursuit {
 public:
  Pursuit(const DiagnosisSetup& setup, const FittedModel& model, const ProposalOptions& options,
          const ProgressCallback& progress)
      : setup_(setup),
        options_(options),
        own_terms_(model.hypotheses.size()),
        progress_(stop_token(progress)) {
    law_.model = model;
    law_.before = law_.after = validation_of(model);
  }

  ProposedLaw run() {
    while (terms_of_law() < options_.most_terms && add_term()) {
    }
    for (size_t k = own_terms_; terms_of_law() > 1;) {
      if (k == law_.model.hypotheses.size()) break;
      if (!drop_term(k)) ++k;
    }
    state_coefficients();
    return std::move(law_);
  }

 private:
  CrossValidation validation_of(const FittedModel& model) const {
    return cross_validate(setup_, model, options_.blocks, options_.threshold);
  }
  int terms_of_law() const { return static_cast<int>(law_.model.hypotheses.size() - own_terms_); }

  /// Returns the scores of all terms, the most telling first. `first_share` becomes the shortest
  /// horizon where something is missing, and `early` the model fitted over it.
  std::vector<Score> shortlist(double& first_share, FittedModel& early) {
    const std::vector<ShapeCandidates> terms = terms_to_test();
    std::vector<Score> list;
    size_t horizons = 0;
    for (const double share : kShares) {
      FittedModel at = law_.model;
      if (share < 1) {
        at = shortened(law_.model, share);
        refine_model(at, setup_, {.rounds = 1}, progress_);
      }
      if (!at.usable()) continue;
      const bool visible = at.residual().squaredNorm() >
                           kCriteria.visible * static_cast<double>(at.residual_count());
      if (!visible && list.empty() && share < 1) continue;
      const ModelProjection projection(at, setup_.options.loss);
      std::vector<Score> scores = score_hypotheses(at, projection, terms, progress_);
      if (list.empty()) {
        first_share = share;
        early = std::move(at);
        list = std::move(scores);
      } else {
        for (Score& score : scores)
          for (Score& known : list)
            if (known.hypothesis.same_mode(score.hypothesis)) {
              known.share = 0.5 * (known.share + score.share);
              known.decrease = std::max(known.decrease, score.decrease);
            }
      }
      if (++horizons == kHorizons) break;
    }
    std::ranges::stable_sort(list, std::greater<>(), &Score::share);
    return list;
  }

  /// Returns the scores of a shortlist that are worth a fit. They have the columns over all frames
  /// that a fit starts with.
  std::vector<Score> worth_a_fit(const std::vector<Score>& list, double first_share) const {
    std::vector<Score> worth;
    std::vector<ShapeCandidates> terms;
    for (const Score& score : list) {
      if (std::ssize(worth) == options_.fits ||
          score.share < kCriteria.term_worth_a_fit * list.front().share)
        break;
      if (score.decrease < least_decrease(score.amplitude.size())) continue;
      worth.push_back(score);
      terms.push_back({score.hypothesis});
    }
    if (first_share == 1) return worth;
    for (Score& score : worth) score.columns.clear();
    const ModelProjection projection(law_.model, setup_.options.loss);
    for (Score& whole : score_hypotheses(law_.model, projection, terms, progress_))
      for (Score& score : worth)
        if (score.hypothesis.same_mode(whole.hypothesis)) score.columns = std::move(whole.columns);
    std::erase_if(worth, [](const Score& score) { return score.columns.empty(); });
    return worth;
  }

  std::vector<ShapeCandidates> terms_to_test() const {
    std::vector<ShapeCandidates> terms;
    for (const Hypothesis& term : empirical_hypotheses(setup_.inputs.front(), setup_.options)) {
      const auto is_term = [&](const Hypothesis& own) { return own.same_mode(term); };
      if (std::ranges::find(options_.without, term.effect) == options_.without.end() &&
          std::ranges::none_of(law_.model.hypotheses, is_term))
        terms.push_back({term});
    }
    return terms;
  }

  bool add_term() {
    double first_share = 1;
    FittedModel early;
    const std::vector<Score> list = shortlist(first_share, early);
    if (law_.trials.empty()) {
      law_.scores = list;
      for (Score& score : law_.scores) score.columns.clear();
    }
    FittedModel best;
    CrossValidation best_validated = law_.after;
    size_t best_trial = 0;
    const std::vector<Score> worth = worth_a_fit(list, first_share);
    std::vector<const Score*> to_fit;
    for (const Score& score : worth) to_fit.push_back(&score);
    std::vector<FittedModel> models = fit_with_hypotheses(
        setup_, law_.model, early, to_fit, first_share, options_.threshold, progress_);
    std::vector<CrossValidation> left_out(models.size());
    for_each_index(models.size(), [&](size_t k) {
      if (models[k].usable()) left_out[k] = validation_of(models[k]);
    });
    for (size_t k = 0; k < models.size(); ++k) {
      FittedModel& fitted = models[k];
      TermTrial trial{.hypothesis = worth[k].hypothesis,
                      .predicted_decrease = worth[k].decrease,
                      .without_it = law_.after.mean,
                      .refused = {}};
      CrossValidation& validated = left_out[k];
      if (!fitted.usable()) {
        trial.refused = "others leave far less over the first frames, or no fit worked out";
      } else {
        trial.cross_validated = validated.mean;
        if (!predicts_better(validated, law_.after))
          trial.refused = "frames that were left out are predicted no better";
        else if (validated.mean >= best_validated.mean)
          trial.refused = "another term predicts them better";
      }
      law_.trials.push_back(trial);
      if (!trial.refused.empty()) continue;
      if (best.usable()) law_.trials[best_trial].refused = "another term predicts them better";
      best = std::move(fitted);
      best_validated = std::move(validated);
      best_trial = law_.trials.size() - 1;
    }
    if (!best.usable()) return false;
    if (best.is_unrefined()) {
      refine_model(best, setup_, kNearEnough, progress_);
      if (!best.usable()) return false;
      best_validated = validation_of(best);
    }
    law_.model = std::move(best);
    law_.after = std::move(best_validated);
    return true;
  }

  bool drop_term(size_t k) {
    std::vector<Hypothesis> terms = law_.model.hypotheses;
    const Hypothesis dropped = terms[k];
    terms.erase(terms.begin() + static_cast<std::ptrdiff_t>(k));
    FittedModel fitted = with_hypotheses(setup_, law_.model, terms, {});
    refine_model(fitted, setup_, {}, progress_);
    if (!fitted.usable()) return false;
    CrossValidation validated = validation_of(fitted);
    if (predicts_better(law_.after, validated)) return false;
    law_.model = std::move(fitted);
    law_.after = std::move(validated);
    for (TermTrial& trial : law_.trials)
      if (trial.hypothesis.same_mode(dropped) && trial.refused.empty())
        trial.refused = "the terms after it make it needless";
    return true;
  }

  void state_coefficients() {
    if (terms_of_law() == 0) return;
    const FittedModel& model = law_.model;
    const Eigen::VectorXd& values = model.parts.front().values;
    const ParameterSpace& space = model.problems.front()->space;
    // A force is shared, so what one recording says of it stands for all.
    const Uncertainty uncertainty =
        estimate_uncertainty(model.objective(0), values, {.loss = setup_.options.loss});
    for (size_t k = own_terms_; k < model.hypotheses.size(); ++k) {
      const Hypothesis& term = model.hypotheses[k];
      const EffectDescription effect = describe_effect(term.effect);
      for (const std::string& parameter : term.amplitudes) {
        const EffectParameter& coefficient =
            *std::ranges::find(effect.parameters, parameter, &EffectParameter::name);
        const int p = space.index(term.effect + "." + parameter);
        const FitParameter& range = space.parameters[static_cast<size_t>(p)];
        const double least = 1e-6 * (range.upper - range.lower);
        law_.coefficients.push_back(
            {.effect = term.effect,
             .parameter = parameter,
             .unit = range.unit,
             .side = coefficient.law_side,
             .term = coefficient.law_factor,
             .value = values[p],
             .sigma = uncertainty.usable ? uncertainty.sigma[p] : 0,
             .at_bound = values[p] < range.lower + least || values[p] > range.upper - least});
      }
    }
    law_.formula = formula_of(law_.coefficients);
  }

  const DiagnosisSetup& setup_;
  const ProposalOptions& options_;
  size_t own_terms_;
  ProgressCallback progress_;
  ProposedLaw law_;
};

}  // namespace

ProposedLaw propose_law(const DiagnosisSetup& setup, const FittedModel& model,
                        const ProposalOptions& options, const ProgressCallback& progress) {
  return Pursuit(setup, model, options, progress).run();
}

}  // namespace clothfit
