#include "fit/diagnose.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "data/input_error.h"
#include "fit/cluster_covariance.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/measurement_effects/registry.h"
#include "fit/observed_blocks.h"
#include "fit/parameterised_model.h"
#include "fit/prior_cost.h"
#include "fit/uncertainty.h"

namespace clothfit {
namespace {

/// Horizons at which laws are scored, as shares of the fitted frames. Where a hidden effect is
/// large the fit over all frames is biased, and the score with it: the shortest horizon at which
/// something is missing says best what.
constexpr double kScoreShares[] = {0.28, 0.4, 0.56, 0.75, 1.0};
constexpr double kVisible = 1.2;  ///< chi-square per degree of freedom there
constexpr int kScoreHorizons = 3;
constexpr int kFewestFrames = 8;

constexpr int kLeastForForce = 14;  ///< frames that a residual force is taken from

constexpr int kTimeBlocks = 5;  ///< of the cross-validation

/// The square of a standard normal number, and of more of them, that is as unlikely as five sigmas.
double least_square(Eigen::Index amplitudes) {
  return 25 + 3.6 * static_cast<double>(amplitudes - 1);
}

/// What a model must gain for each number more (Bayesian information criterion).
double price(const ModelFit& model) {
  double amplitudes = 0;
  for (const Term& term : model.terms)
    amplitudes +=
        static_cast<double>(term.amplitudes.size() + (term.fits_shape ? term.shape.size() : 0));
  return amplitudes * std::log(static_cast<double>(model.linear.residual.size()));
}

double chi_square(const ModelFit& model, double threshold) {
  double sum = 2 * prior_cost(*model.problem, model.values).cost;
  const TrajectoryObjective objective = model.objective();
  for (const Objective::Block& block : objective.blocks()) {
    const double length = model.linear.residual.segment(block.offset, block.dimension).norm();
    sum += length <= threshold ? length * length : threshold * (2 * length - threshold);
  }
  return sum;
}

std::vector<int> horizons_from(int first, int frames) {
  std::vector<int> horizons;
  for (double at = first; at < 0.85 * frames; at *= 1.6)
    horizons.push_back(static_cast<int>(std::lround(at)));
  horizons.push_back(frames);
  return horizons;
}

/// A line of the search: a model, and what was said of the laws that led to it.
struct Line {
  ModelFit model;
  std::vector<AcceptedEffect> accepted;
  double cost = 0;
  bool finished = false;  ///< no law more leads on from here
  std::vector<LawTrial> refused;
};

/// What a line's next law may be: scores averaged over horizons.
struct Shortlist {
  std::vector<LawScore> scores;
  int frames = 0;  ///< the shortest horizon
};

class Search {
 public:
  Search(const DiagnosisSetup& setup, const DiagnoseOptions& options, std::vector<LawShapes> laws,
         double threshold, const ProgressCallback& progress, const bool& stopped)
      : setup_(setup),
        options_(options),
        laws_(std::move(laws)),
        threshold_(threshold),
        progress_(progress),
        stopped_(stopped) {}

  /// From now on laws are asked for at these shapes alone.
  void keep_shapes(const std::vector<LawScore>& scores) {
    laws_.clear();
    for (const LawScore& score : scores) laws_.push_back({score.term});
  }
  const std::vector<LawShapes>& laws() const { return laws_; }

  double cost(const ModelFit& model) const { return chi_square(model, threshold_) + price(model); }

  Shortlist shortlist(const ModelFit& model) {
    const int all = model.frames;
    std::vector<ModelFit> shorter;
    for (const double share : kScoreShares) {
      const int frames =
          std::clamp(static_cast<int>(std::lround(share * all)), std::min(kFewestFrames, all), all);
      if (!shorter.empty() && frames == shorter.back().frames) continue;
      ModelFit fitted = frames == all ? model
                                      : fit_model(setup_, model.terms,
                                                  values_by_name(*model.problem, model.values),
                                                  {frames}, progress_);
      if (stopped_) return {};
      if (!fitted.usable) continue;
      const bool visible = fitted.linear.residual.squaredNorm() >
                           kVisible * static_cast<double>(fitted.linear.residual.size());
      if (visible || !shorter.empty() || frames == all) shorter.push_back(std::move(fitted));
      if (shorter.size() == kScoreHorizons) break;
    }
    Shortlist list{.scores = {}, .frames = shorter.front().frames};
    std::vector<LawShapes> laws = untested(model);
    for (const ModelFit& at : shorter) {
      const Projection projection = project(setup_, at, discretisation_directions(setup_, at));
      std::vector<LawScore> scores = score_laws(at, projection, laws, progress_);
      if (stopped_) return {};
      if (list.scores.empty()) {
        std::ranges::stable_sort(scores, std::greater<>(), &LawScore::share);
        list.scores = std::move(scores);
        laws.clear();  // further horizons judge the best of them, at the shapes found
        for (const LawScore& score : list.scores)
          if (laws.size() < static_cast<size_t>(2 * options_.refits)) laws.push_back({score.term});
        continue;
      }
      for (const LawScore& score : scores) {
        const auto same = std::ranges::find_if(
            list.scores, [&](const LawScore& known) { return known.term.same_law(score.term); });
        if (same == list.scores.end()) continue;
        same->share += score.share;
        if (score.fall > same->fall) {
          same->fall = score.fall;
          same->amount = score.amount;
          same->sigma = score.sigma;
        }
      }
    }
    for (size_t n = 0; n < std::min(laws.size(), list.scores.size()); ++n)
      list.scores[n].share /= static_cast<double>(shorter.size());
    std::ranges::stable_sort(list.scores, std::greater<>(), &LawScore::share);
    return list;
  }

  /// Lines that a law more leads to, of those on the list.
  std::vector<Line> extend(Line& line, const Shortlist& list) {
    std::vector<Line> children;
    line.finished = true;
    const CrossValidation before = cross_validate(setup_, line.model, kTimeBlocks, threshold_);
    std::vector<LawTrial> trials;
    int tried = 0;
    for (const LawScore& score : list.scores) {
      if (score.fall < least_square(score.amount.size())) continue;
      if (tried++ == options_.refits) break;
      Line child{.model = refit(line.model, score, list.frames), .accepted = line.accepted};
      if (stopped_) return {};
      LawTrial trial = judge(line.model, before, score, child.model);
      trials.push_back(trial);
      if (!trial.refused.empty()) {
        line.refused.push_back(std::move(trial));
        continue;
      }
      child.cost = cost(child.model);
      child.accepted.push_back({.trial = std::move(trial), .alike = {}, .refused = {}});
      children.push_back(std::move(child));
    }
    std::ranges::stable_sort(children, {}, &Line::cost);
    for (Line& child : children)
      for (const LawTrial& trial : trials)
        if (!trial.term.same_law(child.accepted.back().trial.term))
          child.accepted.back().refused.push_back(trial);
    return children;
  }

 private:
  std::vector<LawShapes> untested(const ModelFit& model) const {
    std::vector<LawShapes> result;
    for (const LawShapes& law : laws_)
      if (std::ranges::none_of(model.terms,
                               [&](const Term& term) { return term.same_law(law.front()); }))
        result.push_back(law);
    return result;
  }

  ModelFit refit(const ModelFit& model, const LawScore& score, int first_frames) {
    std::vector<Term> terms = model.terms;
    terms.push_back(score.term);
    std::map<std::string, double> start = values_by_name(*model.problem, model.values);
    const EffectDescription effect = describe_effect(score.term.effect);
    for (size_t k = 0; k < score.term.amplitudes.size(); ++k) {
      const auto parameter =
          std::ranges::find(effect.parameters, score.term.amplitudes[k], &EffectParameter::name);
      // Half of what a linear model foresees: a start on the right side, not too far.
      start[score.term.effect + "." + parameter->name] =
          std::clamp(parameter->neutral + 0.5 * score.amount[static_cast<Eigen::Index>(k)],
                     parameter->lower, parameter->upper);
    }
    ModelFit fitted =
        fit_model(setup_, terms, start, horizons_from(first_frames, model.frames), progress_);
    if (stopped_ || !fitted.usable || score.term.shape.empty()) return fitted;
    terms.back().fits_shape = true;
    ModelFit with_shape = fit_model(setup_, terms, values_by_name(*fitted.problem, fitted.values),
                                    {model.frames}, progress_, 1);
    return with_shape.usable && cost(with_shape) < cost(fitted) ? with_shape : fitted;
  }

  LawTrial judge(const ModelFit& before, const CrossValidation& validated, const LawScore& score,
                 const ModelFit& after) const {
    LawTrial trial{.term = score.term, .foreseen_fall = score.fall, .refused = {}};
    if (!after.usable) {
      trial.refused = "no fit with it worked out";
      return trial;
    }
    trial.term = after.terms.back();
    trial.fall = chi_square(before, threshold_) - chi_square(after, threshold_);
    const CrossValidation own = cross_validate(setup_, after, kTimeBlocks, threshold_);
    trial.cross_validated = own.mean;
    trial.without_it = validated.mean;
    trial.best_trivial = std::min(validated.constant_offset, validated.last_residual);
    trial.clear_of_neutral = clear_of_neutral(after);
    const double least = least_square(score.amount.size());
    if (trial.fall < std::max(least, 0.5 * score.fall))
      trial.refused = "the fit gains less than half of what was foreseen";
    else if (!own.usable || own.mean >= validated.mean)
      trial.refused = "frames that were left out are predicted no better";
    else if (own.mean >= trial.best_trivial)
      trial.refused = "a correction without physics does as well";
    else if (trial.clear_of_neutral < 5)
      trial.refused = "not clear of its neutral value";
    return trial;
  }

  /// How many standard deviations the last term's amplitudes stand from neutral: the fewer of those
  /// by the noise and by residuals that depend on each other within blocks. Several together count
  /// as one that is as unlikely.
  double clear_of_neutral(const ModelFit& model) const {
    const TrajectoryObjective objective = model.objective();
    LinearisedFit fit{.residual = model.linear.residual,
                      .jacobian = model.linear.residual_by_coordinate,
                      .weight = {},
                      .prior_information = prior_cost(*model.problem, model.values).information};
    fit.weight = huber_weights(objective, fit.residual, threshold_);
    const Eigen::MatrixXd errs = discretisation_directions(setup_, model);
    const Eigen::Index fitted = fit.jacobian.cols(), all = fitted + errs.cols();
    fit.jacobian.conservativeResize(Eigen::NoChange, all);
    fit.jacobian.rightCols(errs.cols()) = errs;
    Eigen::MatrixXd priors = Eigen::MatrixXd::Identity(all, all);
    priors.topLeftCorner(fitted, fitted) = fit.prior_information;
    fit.prior_information = priors;

    const Term& term = model.terms.back();
    const EffectDescription effect = describe_effect(term.effect);
    const ParameterSpace& space = model.problem->space;
    std::vector<Eigen::Index> indices;
    Eigen::VectorXd away(static_cast<Eigen::Index>(term.amplitudes.size()));
    const Eigen::VectorXd slope = space.value_by_coordinate(model.values);
    for (size_t k = 0; k < term.amplitudes.size(); ++k) {
      const int p = space.index(term.effect + "." + term.amplitudes[k]);
      indices.push_back(p);
      const auto parameter =
          std::ranges::find(effect.parameters, term.amplitudes[k], &EffectParameter::name);
      away[static_cast<Eigen::Index>(k)] = (model.values[p] - parameter->neutral) / slope[p];
    }
    const auto squares = [&](const Eigen::MatrixXd& covariance) {
      const Eigen::MatrixXd own = covariance(indices, indices);
      const double square = away.dot(own.ldlt().solve(away));
      return std::isfinite(square) && square > 0 ? square : 0;
    };
    const Eigen::MatrixXd weighted = fit.weight.asDiagonal() * fit.jacobian;
    Eigen::MatrixXd information = weighted.transpose() * fit.jacobian;
    const double scale =
        std::max(1.0, fit.residual.cwiseAbs2().dot(fit.weight) / std::max(1.0, fit.weight.sum()));
    information = information / scale + fit.prior_information;
    double least = squares(information.ldlt().solve(Eigen::MatrixXd::Identity(all, all)));
    const ObservedBlocks cut = observed_blocks(objective, fit.residual);
    if (cut.blocks.count >= 2) {
      const ClusterCovariance clustered = cluster_covariance(fit, cut.blocks.block);
      if (clustered.usable) least = std::min(least, squares(clustered.covariance));
    }
    return 5 * std::sqrt(least / least_square(away.size()));
  }

  const DiagnosisSetup& setup_;
  const DiagnoseOptions& options_;
  std::vector<LawShapes> laws_;
  double threshold_;
  const ProgressCallback& progress_;
  const bool& stopped_;  ///< set by `progress_` once it has said so
};

Adequacy adequacy_of(const DiagnosisSetup& setup, const ModelFit& model) {
  return judge_adequacy(model, project(setup, model, discretisation_directions(setup, model)),
                        project(setup, model, Eigen::MatrixXd(model.linear.residual.size(), 0)));
}

std::vector<DetectionLimit> limits_of(const std::vector<LawScore>& scores, double inflation) {
  std::vector<DetectionLimit> limits;
  for (const LawScore& score : scores) {
    DetectionLimit limit{.term = score.term,
                         .parameter = score.term.amplitudes,
                         .unit = {},
                         .limit = 5 * inflation * score.sigma,
                         .found = score.amount,
                         .fall = score.fall};
    const EffectDescription effect = describe_effect(score.term.effect);
    for (const std::string& name : limit.parameter)
      limit.unit.push_back(
          std::ranges::find(effect.parameters, name, &EffectParameter::name)->unit);
    limits.push_back(std::move(limit));
  }
  return limits;
}

/// Laws that this recording cannot tell from the one accepted last: fitted in its place they leave
/// hardly more.
std::vector<Term> alike(const std::vector<Line>& children, const Line& best) {
  constexpr double kTold = 25;
  std::vector<Term> result;
  for (const Line& child : children)
    if (&child != &best && child.cost - best.cost < kTold)
      result.push_back(child.accepted.back().trial.term);
  return result;
}

/// The same laws in another order are the same line.
void drop_repeated(std::vector<Line>& lines) {
  const auto has = [](const ModelFit& model, const Term& term) {
    return std::ranges::any_of(model.terms, [&](const Term& own) { return own.same_law(term); });
  };
  for (size_t n = 1; n < lines.size();) {
    const bool repeated = std::any_of(
        lines.begin(), lines.begin() + static_cast<std::ptrdiff_t>(n), [&](const Line& known) {
          return known.model.terms.size() == lines[n].model.terms.size() &&
                 std::ranges::all_of(known.model.terms,
                                     [&](const Term& term) { return has(lines[n].model, term); });
        });
    if (repeated)
      lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(n));
    else
      ++n;
  }
}

}  // namespace

std::string to_string(DiagnosisVerdict verdict) {
  switch (verdict) {
    case DiagnosisVerdict::adequate:
      return "adequate";
    case DiagnosisVerdict::explained:
      return "explained";
    case DiagnosisVerdict::partly_explained:
      return "partly_explained";
    case DiagnosisVerdict::unexplained:
      return "unexplained";
  }
  return "";
}

void DiagnoseOptions::validate() const {
  fit.validate();
  const auto require = [](bool good, const std::string& name, const std::string& expected) {
    if (!good) throw InputError("--" + name, "is out of range", expected);
  };
  require(lines >= 1 && lines <= 20, "lines", "1 to 20");
  require(refits >= 1 && refits <= 50, "refits", "1 to 50");
  require(most_effects >= 0 && most_effects <= 10, "most-effects", "0 to 10");
  require(!fit.forecast && !fit.start, "start", "a diagnosis finds its own");
  for (const std::string& effect : without) require_effect(effect, "--without");
}

Diagnosis diagnose(const FitInput& input, const DiagnoseOptions& options,
                   const ProgressCallback& progress) {
  options.validate();
  const auto began = std::chrono::steady_clock::now();
  const tbb::global_control threads(
      tbb::global_control::max_allowed_parallelism,
      options.fit.threads > 0
          ? static_cast<size_t>(options.fit.threads)
          : tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  bool stopped = false;
  const ProgressCallback watched = [&](const Progress& now) {
    stopped = stopped || (progress && !progress(now));
    return !stopped;
  };
  Diagnosis result;
  result.base = fit(input, options.fit, watched);
  result.stop = result.base.stop;
  result.message = result.base.message;
  if (!result.base.usable()) return result;

  const DiagnosisSetup setup{.input = input,
                             .options = options.fit,
                             .columns = result.base.result.mesh_columns,
                             .rows = result.base.result.mesh_rows};
  const auto problem = problem_of(setup, {});
  const Eigen::VectorXd values = values_of(*problem, result.base.values);
  const TimeSteps steps = time_steps_of_run(problem->cloth, parameter_set(*problem, values),
                                            result.base.result.time_step_s);
  Line base{.model = model_at(problem, {}, values, problem->first_held_out, steps),
            .accepted = {},
            .refused = {}};
  if (!base.model.usable) {
    result.stop = FitStop::diverged;
    result.message = "the derivatives at the optimum could not be computed";
    return result;
  }
  result.before = adequacy_of(setup, base.model);

  const double duration_s =
      problem->frame_time_s[static_cast<size_t>(problem->first_held_out - 1)] -
      problem->frame_time_s.front();
  std::vector<LawShapes> laws = laws_to_test(input, options.fit, duration_s);
  std::erase_if(laws, [&](const LawShapes& law) {
    return std::ranges::find(options.without, law.front().effect) != options.without.end();
  });
  const double threshold =
      options.fit.loss == Loss::huber
          ? kHuberScales * std::max(1.0, robust_scale(base.model.linear.residual))
          : std::numeric_limits<double>::infinity();
  Search search(setup, options, std::move(laws), threshold, watched, stopped);
  const auto cancelled = [&] {
    result.stop = FitStop::cancelled;
    result.message = "cancelled";
    return result;
  };

  base.cost = search.cost(base.model);
  Shortlist list = search.shortlist(base.model);
  if (stopped) return cancelled();
  result.score_frames = list.frames;
  result.scores = list.scores;
  search.keep_shapes(result.scores);
  // Over few frames, where the cloth's answer to a missing force is still small.
  const ModelFit early =
      fit_model(setup, {}, values_by_name(*problem, values),
                {std::max(list.frames, std::min(kLeastForForce, base.model.frames))}, watched);
  if (stopped) return cancelled();
  result.residual_force = residual_force(early.usable ? early : base.model);

  // Always the best line is led on, until nothing leads on from it, or from as many as are
  // followed.
  std::vector<Line> lines;
  lines.push_back(std::move(base));
  for (;;) {
    const auto next = std::ranges::find_if(lines, [&](const Line& line) {
      return !line.finished && line.model.terms.size() < static_cast<size_t>(options.most_effects);
    });
    if (next == lines.end()) break;
    if (!next->model.terms.empty()) list = search.shortlist(next->model);
    if (stopped) return cancelled();
    std::vector<Line> children = search.extend(*next, list);
    if (stopped) return cancelled();
    for (Line& child : children) child.accepted.back().alike = alike(children, child);
    const bool is_end = children.empty() && next == lines.begin();
    if (is_end && adequacy_of(setup, lines.front().model).adequate) break;
    std::ranges::move(children, std::back_inserter(lines));
    std::ranges::stable_sort(lines, {}, &Line::cost);
    drop_repeated(lines);
    if (lines.size() > static_cast<size_t>(options.lines))
      lines.erase(lines.begin() + options.lines, lines.end());
  }

  Line& best = lines.front();
  result.accepted = std::move(best.accepted);
  result.refused = std::move(best.refused);
  result.after = adequacy_of(setup, best.model);
  const Projection projection =
      project(setup, best.model, discretisation_directions(setup, best.model));
  const std::vector<LawScore> last = score_laws(best.model, projection, search.laws(), watched);
  if (stopped) return cancelled();
  result.limits = limits_of(last, std::sqrt(std::max(1.0, result.after.chi_square_per_dof)));

  if (result.accepted.empty()) {
    result.found = result.base;
    result.verdict =
        result.after.adequate ? DiagnosisVerdict::adequate : DiagnosisVerdict::unexplained;
  } else {
    FitOptions again = options_with(options.fit, best.model.terms);
    again.start = values_by_name(*best.model.problem, best.model.values);
    result.found = fit(with_terms(input, best.model.terms), again, watched);
    if (stopped) return cancelled();
    if (!result.found.usable()) {
      result.stop = result.found.stop;
      result.message = "with " + title(best.model.terms) + ": " + result.found.message;
      return result;
    }
    result.verdict =
        result.after.adequate ? DiagnosisVerdict::explained : DiagnosisVerdict::partly_explained;
  }
  if (!result.after.adequate) {
    result.law = propose_law(
        setup, best.model,
        {.blocks = kTimeBlocks, .without = options.without, .threshold = threshold}, watched);
    if (stopped) return cancelled();
    if (result.law.found()) {
      FitOptions again = options_with(options.fit, result.law.model.terms);
      again.start = values_by_name(*result.law.model.problem, result.law.model.values);
      result.with_law = fit(with_terms(input, result.law.model.terms), again, watched);
      if (stopped) return cancelled();
    }
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return result;
}

}  // namespace clothfit
