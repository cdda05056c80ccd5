#include "fit/diagnose.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <tuple>

#include "data/input_error.h"
#include "fit/diagnosis/clearance.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/refit.h"
#include "fit/measurement_effects/registry.h"
#include "fit/parameterised_model.h"
#include "fit/uncertainty.h"

namespace clothfit {
namespace {

/// Horizons at which laws are scored, as shares of the fitted frames. Where a hidden effect is
/// large the fit over all frames is biased, and the score with it: the shortest horizon at which
/// something is missing says best what.
constexpr double kScoreShares[] = {0.28, 0.4, 0.56, 0.75, 1.0};
constexpr double kVisible = 1.2;  ///< chi-square per residual there
/// A fit that leaves less than this over all frames is not biased by much.
constexpr double kHardlyBiased = 3;
constexpr size_t kScoreHorizons = 3;

/// Frames that a residual force is taken from, as a share, at least.
constexpr double kForceShare = 0.28;

constexpr int kTimeBlocks = 5;  ///< of the cross-validation

/// What a model must gain for each number more (Bayesian information criterion).
double price(const ModelFit& model) {
  double amplitudes = 0;
  for (const Term& term : model.terms)
    amplitudes +=
        static_cast<double>(term.amplitudes.size() + (term.fits_shape ? term.shape.size() : 0));
  return amplitudes * std::log(static_cast<double>(model.residual_count()));
}

/// A line of the search: a model, and what was said of the laws that led to it.
struct Line {
  ModelFit model;
  std::vector<AcceptedEffect> accepted;
  double cost = 0;
  bool finished = false;       ///< no law more leads on from here
  std::vector<LawScore> last;  ///< what its model would still show, over all frames
  std::vector<LawTrial> refused;
};

/// What a line's next law may be.
struct Shortlist {
  double share = 1;              ///< the shortest horizon
  std::vector<LawScore> scores;  ///< of all laws there, by the derivatives of the coarser mesh
  /// Of the best of them by those of the model's own mesh, averaged over horizons; with columns
  /// where all frames are one.
  std::vector<LawScore> best;

  /// All scores, those of the model's own mesh where there are any.
  std::vector<LawScore> merged() const {
    std::vector<LawScore> all = scores;
    for (LawScore& score : all)
      for (const LawScore& known : best)
        if (known.term.same_law(score.term)) score = known;
    for (LawScore& score : all) score.columns.clear();
    std::ranges::stable_sort(all, std::greater<>(), &LawScore::share);
    return all;
  }
};

Adequacy adequacy_of(const DiagnosisSetup& setup, const ModelFit& model) {
  return judge_adequacy(model, ModelProjection(model, setup.options.loss),
                        ModelProjection(model, setup.options.loss, false));
}

/// The fitted model on the mesh that is analysed: twice the cells a side where that leaves clearly
/// less, for derivatives of a mesh that cannot follow the cloth mistake one effect for another.
/// `setup` is given that mesh.
ModelFit on_analysed_mesh(ModelFit own, DiagnosisSetup& setup) {
  constexpr double kClearlyLess = 0.05;  // of chi-square, per residual
  if (setup.options.spring_set != SpringSet::fabric) return own;
  const DiagnosisSetup other = with_other_mesh(setup, own);
  if (other.columns < setup.columns) return own;
  ModelFit finer = fit_on_mesh(other, own);
  const double least_gain = kClearlyLess * static_cast<double>(own.residual_count());
  if (!finer.usable || own.residual().squaredNorm() - finer.residual().squaredNorm() < least_gain)
    return own;
  linearise_model(finer);
  if (!finer.usable) return own;
  setup.columns = other.columns;
  setup.rows = other.rows;
  return finer;
}

class Search {
 public:
  Search(const DiagnosisSetup& setup, const DiagnoseOptions& options, std::vector<LawShapes> laws,
         double threshold, const ProgressCallback& progress, const bool& stopped)
      : setup_(setup),
        coarse_(setup),
        options_(options),
        laws_(std::move(laws)),
        threshold_(threshold),
        progress_(progress),
        stopped_(stopped) {
    // Twice as coarse; a start in motion has corrections on nodes of its own.
    constexpr int kSmallest = 9;
    const auto half = [&](int count) {
      return std::min(count, std::max({kSmallest, setup.options.start_nodes + 1, (count + 1) / 2}));
    };
    if (setup.options.spring_set == SpringSet::fabric) {
      coarse_.columns = half(setup.columns);
      coarse_.rows = half(setup.rows);
    }
  }

  std::vector<LawShapes> untested(const ModelFit& model) const {
    std::vector<LawShapes> result;
    for (const LawShapes& law : laws_)
      if (std::ranges::none_of(model.terms,
                               [&](const Term& term) { return term.same_law(law.front()); }))
        result.push_back(law);
    return result;
  }
  double cost(const ModelFit& model) const { return model.chi_square(threshold_) + price(model); }

  /// Scores of all laws, each at its best shape, with the derivatives of a coarser mesh.
  std::vector<LawScore> roughly_scored(const ModelFit& model,
                                       const std::vector<LawShapes>& laws) const {
    ModelFit rough = with_derivatives_of(coarse_, model);
    const ModelFit& by = rough.usable ? rough : model;
    std::vector<LawScore> scores =
        score_laws(by, ModelProjection(by, setup_.options.loss), laws, progress_);
    std::ranges::stable_sort(scores, std::greater<>(), &LawScore::share);
    return scores;
  }

  Shortlist shortlist(const ModelFit& model) {
    std::vector<ModelFit> shorter;
    const bool biased = model.residual().squaredNorm() >
                        kHardlyBiased * static_cast<double>(model.residual_count());
    Shortlist list;
    for (const double share : kScoreShares) {
      if (share < 1 && !biased) continue;
      ModelFit fitted = model;
      if (share < 1) {
        fitted = shortened(model, share);
        refine_model(fitted, setup_, {.rounds = 1}, progress_);
        if (stopped_) return {};
        if (fitted.usable) refine_with_discretisation(fitted, setup_, progress_);
      }
      if (stopped_) return {};
      if (!fitted.usable) continue;
      const bool visible =
          fitted.residual().squaredNorm() > kVisible * static_cast<double>(fitted.residual_count());
      if (!visible && shorter.empty() && share < 1) continue;
      if (shorter.empty()) list.share = share;
      shorter.push_back(std::move(fitted));
      if (shorter.size() == kScoreHorizons) break;
    }
    std::vector<LawShapes> laws;
    for (size_t k = 0; k < shorter.size(); ++k) {
      const ModelFit& at = shorter[k];
      if (k == 0) {
        list.scores = roughly_scored(at, untested(model));
        if (stopped_) return {};
        for (LawScore& score : list.scores) score.columns.clear();
        const size_t best = std::min(list.scores.size(), static_cast<size_t>(2 * options_.refits));
        for (size_t n = 0; n < best; ++n) {
          laws.push_back({list.scores[n].term});
          list.best.push_back(list.scores[n]);
          list.best.back().share = 0;
        }
      }
      std::vector<LawScore> scores =
          score_laws(at, ModelProjection(at, setup_.options.loss), laws, progress_);
      if (stopped_) return {};
      for (LawScore& score : scores) {
        LawScore& same = *std::ranges::find_if(
            list.best, [&](const LawScore& known) { return known.term.same_law(score.term); });
        same.share += score.share / static_cast<double>(shorter.size());
        if (k > 0 && score.fall <= same.fall) continue;
        same.fall = score.fall;
        same.amount = score.amount;
        same.sigma = score.sigma;
        if (list.share == 1) same.columns = std::move(score.columns);
      }
    }
    std::ranges::stable_sort(list.best, std::greater<>(), &LawScore::share);
    return list;
  }

  /// Lines that a law more leads to, of those on the list.
  std::vector<Line> extend(Line& line, const Shortlist& list) {
    line.finished = true;
    if (list.share == 1) line.last = list.scores;
    std::vector<Tried> tried;
    for (const LawScore& score : list.best) {
      if (score.fall < least_fall(score.amount.size())) continue;
      if (tried.size() == static_cast<size_t>(options_.refits)) break;
      tried.push_back(
          {.score = &score,
           .model = fit_with_law(setup_, line.model, score, list.share, threshold_, progress_)});
      if (stopped_) return {};
    }
    let_best_err(tried, line.model);
    if (stopped_) return {};
    std::vector<Line> children;
    std::vector<LawTrial> trials;
    const CrossValidation before = cross_validate(setup_, line.model, kTimeBlocks, threshold_);
    for (Tried& child : tried) {
      LawTrial trial = judge(line.model, before, *child.score, child.model);
      trials.push_back(trial);
      if (!trial.refused.empty()) {
        line.refused.push_back(std::move(trial));
        continue;
      }
      children.push_back({.model = std::move(child.model), .accepted = line.accepted});
      children.back().cost = cost(children.back().model);
      children.back().accepted.push_back({.trial = std::move(trial), .alike = {}, .refused = {}});
    }
    std::ranges::stable_sort(children, {}, &Line::cost);
    fit_shapes(children);
    if (stopped_) return {};
    for (Line& child : children)
      for (const LawTrial& trial : trials)
        if (!trial.term.same_law(child.accepted.back().trial.term))
          child.accepted.back().refused.push_back(trial);
    return children;
  }

 private:
  struct Tried {
    const LawScore* score = nullptr;
    ModelFit model;
  };

  /// Directions of their own for the models that leave least, of those that stand far from where
  /// the line's directions were taken.
  void let_best_err(std::vector<Tried>& tried, const ModelFit& line) const {
    constexpr double kNear = 0.5;  ///< of the best one's fall
    const double from = line.chi_square(threshold_);
    double best = 0;
    for (const Tried& child : tried)
      if (child.model.usable) best = std::max(best, from - child.model.chi_square(threshold_));
    for (Tried& child : tried) {
      ModelFit& model = child.model;
      if (!model.usable || model.parts.front().directions.cols() > 0 ||
          from - model.chi_square(threshold_) < kNear * best)
        continue;
      refine_with_discretisation(model, setup_, progress_);
      if (stopped_) return;
    }
  }

  /// Shapes between those of the grid, for laws that are near the best.
  void fit_shapes(std::vector<Line>& children) {
    constexpr double kNear = 0.2;  ///< of the best one's fall
    if (children.empty()) return;
    const double reach = kNear * children.front().accepted.back().trial.fall;
    const double best = children.front().cost;
    for (Line& child : children) {
      std::vector<Term> terms = child.model.terms;
      if (terms.back().shape.empty() || child.cost > best + reach) continue;
      terms.back().fits_shape = true;
      ModelFit with_shape = with_terms(setup_, child.model, terms, {});
      refine_model(with_shape, setup_, {.rounds = 1}, progress_);
      if (stopped_) return;
      if (!with_shape.usable || cost(with_shape) >= child.cost) continue;
      LawTrial& trial = child.accepted.back().trial;
      trial.fall += child.model.chi_square(threshold_) - with_shape.chi_square(threshold_);
      trial.term = with_shape.terms.back();
      child.model = std::move(with_shape);
      child.cost = cost(child.model);
    }
    std::ranges::stable_sort(children, {}, &Line::cost);
  }

  LawTrial judge(const ModelFit& before, const CrossValidation& validated, const LawScore& score,
                 const ModelFit& after) const {
    LawTrial trial{.term = score.term, .foreseen_fall = score.fall, .refused = {}};
    if (!after.usable) {
      trial.refused = "no fit with it worked out";
      return trial;
    }
    trial.term = after.terms.back();
    trial.fall = before.chi_square(threshold_) - after.chi_square(threshold_);
    const double least = least_fall(score.amount.size());
    if (trial.fall < std::max(least, 0.5 * score.fall)) {
      trial.refused = "the fit gains less than half of what was foreseen";
      return trial;
    }
    const CrossValidation own = cross_validate(setup_, after, kTimeBlocks, threshold_);
    trial.cross_validated = own.mean;
    trial.without_it = validated.mean;
    trial.best_trivial = std::min(validated.constant_offset, validated.last_residual);
    trial.clear_of_neutral = clear_of_neutral(after, adequacy_of(setup_, after), threshold_);
    if (!own.usable || own.mean >= validated.mean)
      trial.refused = "frames that were left out are predicted no better";
    else if (own.mean >= trial.best_trivial)
      trial.refused = "a correction without physics does as well";
    else if (trial.clear_of_neutral < 5)
      trial.refused = "not clear of its neutral value";
    return trial;
  }

  const DiagnosisSetup& setup_;
  DiagnosisSetup coarse_;
  const DiagnoseOptions& options_;
  std::vector<LawShapes> laws_;
  double threshold_;
  const ProgressCallback& progress_;
  const bool& stopped_;  ///< set by `progress_` once it has said so
};

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
  const auto cancelled = [&] {
    result.stop = FitStop::cancelled;
    result.message = "cancelled";
    return result;
  };
  result.base = fit(input, options.fit, watched);
  result.stop = result.base.stop;
  result.message = result.base.message;
  if (!result.base.usable()) return result;

  DiagnosisSetup setup{.inputs = {&input, 1},
                       .options = options.fit,
                       .columns = result.base.result.mesh_columns,
                       .rows = result.base.result.mesh_rows};
  Line base{.model = model_at(setup, {}, {result.base.values}), .accepted = {}, .refused = {}};
  {
    PooledPart& part = base.model.parts.front();
    const FitProblem& own = *base.model.problems.front();
    part.steps = time_steps_of_run(own.cloth, parameter_set(own, part.values),
                                   result.base.result.time_step_s);
  }
  linearise_model(base.model);
  if (base.model.usable) {
    base.model = on_analysed_mesh(std::move(base.model), setup);
    refine_with_discretisation(base.model, setup, watched);
  }
  if (stopped) return cancelled();
  if (!base.model.usable) {
    result.stop = FitStop::diverged;
    result.message = "the derivatives at the optimum could not be computed";
    return result;
  }
  const FitProblem& problem = *base.model.problems.front();
  result.columns = setup.columns;
  result.rows = setup.rows;
  result.before = adequacy_of(setup, base.model);

  const double duration_s = problem.frame_time_s[static_cast<size_t>(problem.first_held_out - 1)] -
                            problem.frame_time_s.front();
  std::vector<LawShapes> laws = laws_to_test(input, options.fit, duration_s);
  std::erase_if(laws, [&](const LawShapes& law) {
    return std::ranges::find(options.without, law.front().effect) != options.without.end();
  });
  const double threshold = options.fit.loss == Loss::huber
                               ? kHuberScales * robust_scale(base.model.residual())
                               : std::numeric_limits<double>::infinity();
  Search search(setup, options, std::move(laws), threshold, watched, stopped);

  base.cost = search.cost(base.model);
  Shortlist list = search.shortlist(base.model);
  if (stopped) return cancelled();
  result.score_frames = frames_of_share(problem, list.share);
  result.scores = list.merged();
  // Over few frames, where the cloth's answer to a missing force is still small.
  ModelFit early = shortened(base.model, std::max(list.share, kForceShare));
  refine_model(early, setup, {.rounds = 1}, watched);
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
    if (!next->model.terms.empty()) {
      refine_with_discretisation(next->model, setup, watched);
      if (!next->model.usable) {
        next->finished = true;
        continue;
      }
      next->cost = search.cost(next->model);
      list = search.shortlist(next->model);
    }
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
  // Of laws that are not in the model, over all frames.
  if (best.last.empty()) best.last = search.roughly_scored(best.model, search.untested(best.model));
  if (stopped) return cancelled();
  result.limits = limits_of(best.last, std::sqrt(std::max(1.0, result.after.chi_square_per_dof)));

  if (result.accepted.empty()) {
    result.found = result.base;
    result.verdict =
        result.after.adequate ? DiagnosisVerdict::adequate : DiagnosisVerdict::unexplained;
  } else {
    FitOptions again = options_with(setup, best.model.terms, 0);
    again.start = best.model.values().front();
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
      FitOptions again = options_with(setup, result.law.model.terms, 0);
      again.start = result.law.model.values().front();
      result.with_law = fit(with_terms(input, result.law.model.terms), again, watched);
      if (stopped) return cancelled();
    }
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return result;
}

}  // namespace clothfit
