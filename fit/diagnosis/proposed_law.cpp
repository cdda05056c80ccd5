#include "fit/diagnosis/proposed_law.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/diagnosis/discretisation.h"
#include "fit/uncertainty.h"
#include "model/effects/force_law.h"
#include "model/effects/tension_law.h"

namespace clothfit {
namespace {

/// Horizons at which terms are scored, as shares of the model's frames: from the shortest on at
/// which something is missing, for over all frames what is missing biases the model.
constexpr double kShares[] = {0.3, 0.5, 0.75, 1.0};
constexpr double kVisible = 1.2;  ///< chi-square per residual there
constexpr size_t kHorizons = 2;
constexpr int kFewestFrames = 8;

/// Terms that are foreseen to explain less than this share of what the best one does are not
/// fitted.
constexpr double kWorthAFit = 0.8;

/// The square of a standard normal number, and of more of them, that is as unlikely as five sigmas.
double least_square(Eigen::Index amplitudes) {
  return 25 + 3.6 * static_cast<double>(amplitudes - 1);
}

std::vector<int> horizons_from(int first, int frames) {
  std::vector<int> horizons;
  for (double at = first; at < 0.85 * frames; at *= 1.6)
    horizons.push_back(static_cast<int>(std::lround(at)));
  horizons.push_back(frames);
  return horizons;
}

/// Whether frames left out are foretold better: by a tenth of what is above the noise and by two
/// per cent of the noise itself, below which nothing counts as structure
/// (fit/diagnosis/adequacy.h), and in most of the blocks of time.
bool predicts_better(const CrossValidation& one, const CrossValidation& other) {
  constexpr double kLeastGain = 0.1, kLeastOfNoise = 0.02;
  if (!one.usable ||
      other.mean - one.mean <= std::max(kLeastOfNoise, kLeastGain * (other.mean - 1)))
    return false;
  size_t blocks = 0;
  for (size_t b = 0; b < one.block.size(); ++b) blocks += one.block[b] < other.block[b] ? 1 : 0;
  return 2 * blocks > one.block.size();
}

/// A value to the second digit of its sigma.
std::string number_text(double value, double sigma) {
  const double size = sigma > 0 ? sigma : std::abs(value);
  const int place = size > 0 ? static_cast<int>(std::floor(std::log10(size))) - 1 : 0;
  if (place >= 0) {
    const double unit = std::pow(10.0, place);
    return fmt::format("{:.0f}", std::round(value / unit) * unit);
  }
  return fmt::format("{:.{}f}", value, -place);
}

/// The left side of the formula that a coefficient stands in.
std::string side_of(const LawCoefficient& one) {
  if (one.effect == "tension_law") return "T / (k l0)";
  return force_law::acts_on_area(one.parameter) ? "p" : "a";
}

std::string formula_of(const std::vector<LawCoefficient>& coefficients) {
  std::string text;
  for (const char* side : {"a", "p", "T / (k l0)"}) {
    std::string sum;
    for (const LawCoefficient& one : coefficients) {
      if (side_of(one) != side) continue;
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
  Pursuit(const DiagnosisSetup& setup, const ModelFit& model, const ProposalOptions& options,
          const ProgressCallback& progress)
      : setup_(setup), options_(options), own_terms_(model.terms.size()), progress_(progress) {
    law_.model = model;
    law_.before = law_.after = cross_validate(setup, model, options.blocks, options.threshold);
  }

  ProposedLaw run() {
    while (!law_.cancelled && terms_of_law() < options_.most_terms && add_term()) {
    }
    for (size_t k = own_terms_; !law_.cancelled && terms_of_law() > 1;) {
      if (k == law_.model.terms.size()) break;
      if (!drop_term(k)) ++k;
    }
    if (!law_.cancelled) state_coefficients();
    return std::move(law_);
  }

 private:
  int terms_of_law() const { return static_cast<int>(law_.model.terms.size() - own_terms_); }

  ModelFit fit(const std::vector<Term>& terms, const std::map<std::string, double>& start,
               const std::vector<int>& horizons) {
    ModelFit fitted = fit_model(setup_, terms, start, horizons, progress_);
    law_.cancelled = law_.cancelled || fitted.cancelled;
    return fitted;
  }

  /// What is foreseen of each term, the most telling first, and the shortest horizon where
  /// something is missing.
  std::vector<LawScore> shortlist(int& first_frames) {
    std::vector<Term> terms = empirical_laws(setup_.input, setup_.options);
    std::erase_if(terms, [&](const Term& term) {
      return std::ranges::find(options_.without, term.effect) != options_.without.end();
    });
    std::vector<LawScore> list;
    size_t horizons = 0;
    int last = 0;
    for (const double share : kShares) {
      const int all = law_.model.frames;
      const int frames =
          std::clamp(static_cast<int>(std::lround(share * all)), std::min(kFewestFrames, all), all);
      if (frames == last) continue;
      last = frames;
      const ModelFit at =
          frames == all ? law_.model
                        : fit(law_.model.terms,
                              values_by_name(*law_.model.problem, law_.model.values), {frames});
      if (law_.cancelled) return {};
      if (!at.usable) continue;
      const bool visible = at.linear.residual.squaredNorm() >
                           kVisible * static_cast<double>(at.linear.residual.size());
      if (!visible && list.empty() && frames != all) continue;
      const Projection projection = project(setup_, at, discretisation_directions(setup_, at));
      std::vector<LawScore> scores = score_terms(setup_, at, projection, terms);
      if (list.empty()) {
        first_frames = frames;
        list = std::move(scores);
      } else {
        for (const LawScore& score : scores)
          for (LawScore& known : list)
            if (known.term.same_law(score.term)) {
              known.share = 0.5 * (known.share + score.share);
              known.fall = std::max(known.fall, score.fall);
            }
      }
      if (++horizons == kHorizons) break;
    }
    std::ranges::stable_sort(list, std::greater<>(), &LawScore::share);
    return list;
  }

  ModelFit with(const LawScore& score, int first_frames) {
    std::vector<Term> terms = law_.model.terms;
    terms.push_back(score.term);
    std::map<std::string, double> start = values_by_name(*law_.model.problem, law_.model.values);
    const std::vector<std::string> names = score.term.parameters();
    // Half of what a linear model foresees: a start on the right side, not too far.
    for (size_t k = 0; k < names.size(); ++k)
      start[names[k]] = 0.5 * score.amount[static_cast<Eigen::Index>(k)];
    return fit(terms, start, horizons_from(first_frames, law_.model.frames));
  }

  bool add_term() {
    int first_frames = 0;
    const std::vector<LawScore> list = shortlist(first_frames);
    if (law_.trials.empty()) law_.scores = list;
    ModelFit best;
    CrossValidation best_validated = law_.after;
    size_t best_trial = 0;
    int fits = 0;
    for (const LawScore& score : list) {
      if (fits == options_.fits || score.share < kWorthAFit * list.front().share) break;
      if (score.fall < least_square(score.amount.size())) continue;
      ++fits;
      ModelFit fitted = with(score, first_frames);
      if (law_.cancelled) return false;
      TermTrial trial{.term = score.term,
                      .foreseen_fall = score.fall,
                      .without_it = law_.after.mean,
                      .refused = {}};
      CrossValidation validated;
      if (!fitted.usable) {
        trial.refused = "no fit with it worked out";
      } else {
        validated = cross_validate(setup_, fitted, options_.blocks, options_.threshold);
        trial.cross_validated = validated.mean;
        if (!predicts_better(validated, law_.after))
          trial.refused = "frames that were left out are predicted no better";
        else if (validated.mean >= best_validated.mean)
          trial.refused = "another term predicts them better";
      }
      law_.trials.push_back(trial);
      if (!trial.refused.empty()) continue;
      if (best.usable) law_.trials[best_trial].refused = "another term predicts them better";
      best = std::move(fitted);
      best_validated = std::move(validated);
      best_trial = law_.trials.size() - 1;
    }
    if (!best.usable) return false;
    law_.model = std::move(best);
    law_.after = std::move(best_validated);
    return true;
  }

  bool drop_term(size_t k) {
    std::vector<Term> terms = law_.model.terms;
    const Term dropped = terms[k];
    terms.erase(terms.begin() + static_cast<std::ptrdiff_t>(k));
    ModelFit fitted =
        fit(terms, values_by_name(*law_.model.problem, law_.model.values), {law_.model.frames});
    if (law_.cancelled || !fitted.usable) return false;
    CrossValidation validated = cross_validate(setup_, fitted, options_.blocks, options_.threshold);
    if (predicts_better(law_.after, validated)) return false;
    law_.model = std::move(fitted);
    law_.after = std::move(validated);
    for (TermTrial& trial : law_.trials)
      if (trial.term.same_law(dropped) && trial.refused.empty())
        trial.refused = "the terms after it make it needless";
    return true;
  }

  void state_coefficients() {
    if (terms_of_law() == 0) return;
    const ModelFit& model = law_.model;
    const Uncertainty uncertainty =
        estimate_uncertainty(model.objective(), model.values, {.loss = setup_.options.loss},
                             model.linear.residual_by_coordinate);
    for (size_t k = own_terms_; k < model.terms.size(); ++k) {
      const Term& term = model.terms[k];
      for (const std::string& parameter : term.amplitudes) {
        const int p = model.problem->space.index(term.effect + "." + parameter);
        const FitParameter& range = model.problem->space.parameters[static_cast<size_t>(p)];
        const double least = 1e-6 * (range.upper - range.lower);
        law_.coefficients.push_back({.effect = term.effect,
                                     .parameter = parameter,
                                     .unit = range.unit,
                                     .term = term.effect == "force_law"
                                                 ? force_law::term_text(parameter)
                                                 : tension_law::term_text(parameter),
                                     .value = model.values[p],
                                     .sigma = uncertainty.usable ? uncertainty.sigma[p] : 0,
                                     .at_bound = model.values[p] < range.lower + least ||
                                                 model.values[p] > range.upper - least});
      }
    }
    law_.formula = formula_of(law_.coefficients);
  }

  const DiagnosisSetup& setup_;
  const ProposalOptions& options_;
  size_t own_terms_;
  const ProgressCallback& progress_;
  ProposedLaw law_;
};

}  // namespace

std::vector<LawScore> score_terms(const DiagnosisSetup& setup, const ModelFit& model,
                                  const Projection& projection, const std::vector<Term>& terms) {
  std::vector<Term> all = model.terms, more;
  for (const Term& term : terms)
    if (std::ranges::none_of(model.terms, [&](const Term& own) { return own.same_law(term); }))
      more.push_back(term);
  all.insert(all.end(), more.begin(), more.end());
  // All of them at their neutral values: the run stays as it is, only its derivatives are more.
  const auto problem = problem_of(setup, all);
  const ParameterSpace& space = problem->space;
  const Eigen::VectorXd values = values_of(*problem, values_by_name(*model.problem, model.values));
  std::vector<int> coordinates;
  Eigen::VectorXd lower = values, upper = values;
  for (const Term& term : more)
    for (const std::string& name : term.parameters()) {
      const int p = space.index(name);
      coordinates.push_back(p);
      lower[p] = space.parameters[static_cast<size_t>(p)].lower;
      upper[p] = space.parameters[static_cast<size_t>(p)].upper;
    }
  const TrajectoryObjective objective(*problem, model.frames, model.steps);
  const Linearisation linear = objective.linearise_by(values, coordinates);
  if (!linear.usable) return {};
  const Eigen::MatrixXd columns = projection.columns(linear.residual_by_coordinate);
  const Eigen::VectorXd here = space.coordinates(values);
  const Eigen::VectorXd down = space.coordinates(lower) - here;
  const Eigen::VectorXd up = space.coordinates(upper) - here;
  const Eigen::VectorXd slope = space.value_by_coordinate(values);
  const double above =
      projection.residual().squaredNorm() - (projection.weights() - projection.taken());

  std::vector<LawScore> scores;
  Eigen::Index first = 0;
  for (const Term& term : more) {
    const auto count = static_cast<Eigen::Index>(term.amplitudes.size());
    const std::vector<int> own(coordinates.begin() + first, coordinates.begin() + first + count);
    const Explained explained =
        explain(projection.residual(), columns.middleCols(first, count), down(own), up(own));
    first += count;
    LawScore score{.term = term,
                   .amount = explained.amount.cwiseProduct(slope(own)),
                   .sigma = Eigen::VectorXd::Constant(count, INFINITY),
                   .fall = explained.fall,
                   .share = above > 0 ? explained.fall / above : 0};
    const Eigen::LDLT<Eigen::MatrixXd> information(explained.information);
    if (information.isPositive() && information.vectorD().minCoeff() > 0)
      score.sigma = information.solve(Eigen::MatrixXd::Identity(count, count))
                        .diagonal()
                        .cwiseSqrt()
                        .cwiseProduct(slope(own));
    scores.push_back(std::move(score));
  }
  return scores;
}

ProposedLaw propose_law(const DiagnosisSetup& setup, const ModelFit& model,
                        const ProposalOptions& options, const ProgressCallback& progress) {
  return Pursuit(setup, model, options, progress).run();
}

}  // namespace clothfit
