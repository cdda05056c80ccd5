#include "fit/diagnosis/search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <utility>

#include "data/shared_progress.h"
#include "fit/cost/huber.h"
#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/clearance.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/refit.h"
#include "fit/refine/refine.h"

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

/// Chi-square per number of a model that is so far off that its valley may be the wrong one, and
/// that sigmas are those of all it lacks.
constexpr double kFarOff = 3;

/// What a model must gain for each number more (Bayesian information criterion).
double price(const ModelFit& model) {
  double amplitudes = 0;
  for (const Term& term : model.terms)
    amplitudes +=
        static_cast<double>(term.amplitudes.size() + (term.fits_shape ? term.shape.size() : 0));
  return amplitudes * std::log(static_cast<double>(model.residual_count()));
}

/// What a model's chi-square has above what noise makes, twice its standard deviation included.
double surely_above(const ModelFit& model, double threshold) {
  const auto count = static_cast<double>(model.residual_count());
  return std::max(0.0, model.chi_square(threshold) - count - 2 * std::sqrt(2 * count));
}

/// A line of the search: a model, and what was said of the laws that led to it.
struct Line {
  ModelFit model;
  std::vector<AcceptedEffect> accepted;
  double cost = 0;
  /// What its laws still have to beat: chi-square, cross-validated, of corrections without physics
  /// that did as well as one of them; infinite: nothing.
  double owes = std::numeric_limits<double>::infinity();
  bool anew = false;           ///< its model was identified from scratch
  bool moved = false;          ///< to another valley, that a law led to
  bool finished = false;       ///< no law more leads on from here
  std::vector<LawScore> last;  ///< what its model would still show, over all frames
  std::vector<LawTrial> refused;

  bool sound() const { return std::isinf(owes); }
};

std::vector<LawScore> without_columns(std::vector<LawScore> scores) {
  for (LawScore& score : scores) score.columns.clear();
  return scores;
}

/// What a line's next law may be.
struct Shortlist {
  /// The line's model on the coarse mesh, where it is so far off that this one does for the round;
  /// otherwise not usable.
  ModelFit coarse;
  double share = 1;              ///< the shortest horizon
  ModelFit early;                ///< the model fitted over that
  std::vector<LawScore> scores;  ///< of all laws there
  /// Of the best of them, averaged over horizons; with columns where all frames are one.
  std::vector<LawScore> best;

  /// All scores, averaged ones where there are any.
  std::vector<LawScore> merged() const {
    std::vector<LawScore> all = scores;
    for (LawScore& score : all)
      for (const LawScore& known : best)
        if (known.term.same_law(score.term)) score = known;
    std::ranges::stable_sort(all, std::greater<>(), &LawScore::share);
    return without_columns(std::move(all));
  }
};

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

/// The same laws in another order are the same line, and what they have beaten in one of them they
/// have beaten.
void drop_repeated(std::vector<Line>& lines) {
  const auto has = [](const ModelFit& model, const Term& term) {
    return std::ranges::any_of(model.terms, [&](const Term& own) { return own.same_law(term); });
  };
  for (size_t n = 1; n < lines.size();) {
    const auto own = lines.begin() + static_cast<std::ptrdiff_t>(n);
    const auto same = std::find_if(lines.begin(), own, [&](const Line& known) {
      return known.model.terms.size() == own->model.terms.size() &&
             std::ranges::all_of(known.model.terms,
                                 [&](const Term& term) { return has(own->model, term); });
    });
    if (same == own) {
      ++n;
      continue;
    }
    same->owes = std::max(same->owes, own->owes);
    lines.erase(own);
  }
}

/// Moves those of the sorted lines that are not followed any further to `dropped`: what gained far
/// less than the best one, and more than `most`.
void drop_hopeless(std::vector<Line>& lines, double base_cost, size_t most,
                   std::vector<Line>& dropped) {
  constexpr double kFarLess = 0.5;
  const double enough = kFarLess * (base_cost - lines.front().cost);
  size_t kept = 1;
  while (kept < std::min(most, lines.size()) && base_cost - lines[kept].cost >= enough) ++kept;
  const auto first = lines.begin() + static_cast<std::ptrdiff_t>(std::min(kept, lines.size()));
  std::move(first, lines.end(), std::back_inserter(dropped));
  lines.erase(first, lines.end());
}

/// What is known of effects alone.
std::vector<NamedValues> values_of_effects(const ModelFit& model) {
  std::vector<NamedValues> values = model.values();
  for (size_t n = 0; n < values.size(); ++n)
    for (const FitParameter& parameter : model.problems[n]->space.parameters)
      if (parameter.role != ParameterRole::effect && parameter.role != ParameterRole::measurement)
        values[n].erase(parameter.name);
  return values;
}

/// The line of least cost that owes nothing, of two lists of which one has such.
Line best_sound(std::vector<Line> lines, std::vector<Line> more) {
  std::ranges::move(more, std::back_inserter(lines));
  std::erase_if(lines, [](const Line& line) { return !line.sound(); });
  return std::move(*std::ranges::min_element(lines, {}, &Line::cost));
}

class Search {
 public:
  Search(const DiagnosisSetup& setup, const SearchOptions& options,
         const ProgressCallback& progress)
      : setup_(setup),
        coarse_(with_coarse_mesh(setup)),
        options_(options),
        threshold_(options.threshold),
        progress_([this, asked = for_threads(progress)](const Progress& now) {
          if (asked && !asked(now)) stopped_ = true;
          return !stopped_;
        }) {}

  /// Always the best line is led on, until nothing leads on from it, or from as many as are
  /// followed.
  LawSearch run(ModelFit base) {
    LawSearch result;
    const auto cancelled = [&] {
      result.cancelled = true;
      return result;
    };
    std::vector<Line> lines, dropped;
    lines.push_back({.model = std::move(base), .accepted = {}, .refused = {}});
    begin_at(lines.front());
    Shortlist list = shortlist(lines.front().model);
    if (stopped_) return cancelled();
    if (lines.front().model.rough && !list.coarse.usable) {
      settle(lines.front());
      list = shortlist(lines.front().model);
      if (stopped_) return cancelled();
    }
    result.first = list.merged();
    result.first_share = list.share;
    for (;;) {
      const auto next = std::ranges::find_if(lines, [&](const Line& line) {
        return !line.finished && line.model.terms.size() < options_.most_effects;
      });
      if (next == lines.end()) {
        if (lines.front().sound()) break;
        Line sound = best_sound(std::move(lines), std::move(dropped));
        lines.clear();
        dropped.clear();
        lines.push_back(std::move(sound));
        continue;
      }
      if (!next->accepted.empty()) {
        ModelFit refined = next->model;
        refine_with_discretisation(refined, setup_, progress_);
        if (stopped_) return cancelled();
        if (next == lines.begin() && !next->anew) leave_valley(refined);
        if (stopped_) return cancelled();
        if (!refined.usable) {
          next->finished = true;
          continue;
        }
        next->model = std::move(refined);
        next->cost = cost(next->model);
        list = shortlist(next->model);
        if (stopped_) return cancelled();
      }
      std::vector<Line> children = extend(*next, list);
      if (stopped_) return cancelled();
      if (children.empty() && (next->moved || list.coarse.usable)) {
        // In its own valley other laws may show, and on its own mesh.
        settle(*next);
        if (stopped_) return cancelled();
        list = shortlist(next->model, next->moved);
        if (stopped_) return cancelled();
        children = extend(*next, list);
        if (stopped_) return cancelled();
      }
      if (next->moved && next->accepted.empty()) {
        result.first = without_columns(scored(setup_, next->model, untested(next->model)));
        result.first_share = 1;
        if (stopped_) return cancelled();
      }
      for (Line& child : children) child.accepted.back().alike = alike(children, child);
      const bool is_end = children.empty() && next == lines.begin() && next->sound();
      if (is_end && judge_adequacy(lines.front().model, setup_.options.loss).adequate) break;
      std::ranges::move(children, std::back_inserter(lines));
      std::ranges::stable_sort(lines, {}, &Line::cost);
      drop_repeated(lines);
      drop_hopeless(lines, base_cost_, static_cast<size_t>(options_.lines), dropped);
      // Of those, the best that owes nothing is enough to fall back on.
      if (std::ranges::any_of(dropped, &Line::sound)) {
        Line sound = best_sound(std::move(dropped), {});
        dropped.clear();
        dropped.push_back(std::move(sound));
      }
    }
    Line& best = lines.front();
    settle(best);
    const bool found = !best.accepted.empty();
    prune(best);
    if (stopped_) return cancelled();
    const bool came_back = found && best.accepted.empty();
    if (came_back) base_ = best.model;
    result.base = std::move(base_);
    result.moved = best.moved || came_back;
    result.threshold = threshold_;
    // Of laws that are not in the model, over all frames.
    if (best.last.empty()) best.last = scored(setup_, best.model, untested(best.model));
    if (stopped_) return cancelled();
    result.model = std::move(best.model);
    result.accepted = std::move(best.accepted);
    result.refused = std::move(best.refused);
    result.last = std::move(best.last);
    return result;
  }

 private:
  std::vector<LawShapes> untested(const ModelFit& model) const {
    const NamedValues values = model.values().front();
    std::vector<LawShapes> result;
    for (const LawShapes& law : options_.laws)
      if (std::ranges::none_of(model.terms,
                               [&](const Term& term) { return term.same_law(law.front()); }))
        result.push_back(at_shapes_of(model.terms, values, law));
    return result;
  }
  double cost(const ModelFit& model) const { return model.chi_square(threshold_) + price(model); }

  /// The line that has found nothing yet.
  void begin_at(Line& line) {
    base_chi_square_ = line.model.chi_square(threshold_);
    base_cost_ = line.cost = cost(line.model);
  }

  double worth(const ModelFit& model) const {
    return worth_naming(model, threshold_, base_chi_square_ - model.chi_square(threshold_));
  }

  /// Scores of all laws, each at its best shape. A coarser mesh chooses frequencies and other
  /// shapes, which are many; a place on the cloth it may get wrong altogether, so that all are
  /// looked at on `setup`'s mesh itself while nothing has been found yet.
  std::vector<LawScore> scored(const DiagnosisSetup& setup, const ModelFit& model,
                               std::vector<LawShapes> laws) const {
    const ModelProjection projection(model, setup_.options.loss);
    if (is_coarser(coarse_, setup)) {
      std::vector<LawShapes> elsewhere;
      for (const LawShapes& law : laws)
        if (law.size() > 1 && (!model.terms.empty() || !is_over_cloth(law.front())))
          elsewhere.push_back(law);
      const ModelFit rough = with_derivatives_of(coarse_, model);
      if (rough.usable) {
        const ModelProjection rough_projection(rough, setup_.options.loss);
        const std::vector<LawScore> chosen = at_best_shapes(rough, rough_projection, elsewhere);
        for (LawShapes& law : laws)
          for (const LawScore& score : chosen)
            if (score.term.same_law(law.front())) law = {score.term};
      }
    }
    return at_best_shapes(model, projection, laws);
  }

  /// Of those given, and then beside them; a law that comes with one shape keeps it.
  std::vector<LawScore> at_best_shapes(const ModelFit& model, const ModelProjection& projection,
                                       const std::vector<LawShapes>& laws) const {
    std::vector<LawScore> scores = score_laws(model, projection, laws, progress_);
    // Between the grid's points a law may explain several times as much.
    constexpr double kSome = 0.25, kParts[] = {0.5, 0.25};
    for (const double part : kParts) {
      double most = least_fall(1);
      for (const LawScore& score : scores) most = std::max(most, score.fall);
      std::vector<LawShapes> around;
      for (const LawScore& score : scores) {
        const LawShapes& given = *std::ranges::find_if(
            laws, [&](const LawShapes& law) { return score.term.same_law(law.front()); });
        if (score.fall > kSome * most && given.size() > 1)
          around.push_back(shapes_around(score.term, part));
      }
      for (LawScore& moved : score_laws(model, projection, around, progress_)) {
        LawScore& same = *std::ranges::find_if(
            scores, [&](const LawScore& known) { return known.term.same_law(moved.term); });
        if (moved.fall > same.fall) same = std::move(moved);
      }
    }
    std::ranges::stable_sort(scores, std::greater<>(), &LawScore::share);
    return scores;
  }

  Shortlist shortlist(const ModelFit& model, bool may_be_coarse = true) {
    const double left =
        model.residual().squaredNorm() / static_cast<double>(model.residual_count());
    if (model.is_hopeless() && may_be_coarse && is_coarser(coarse_, setup_)) {
      ModelFit coarse = fit_on_mesh(coarse_, model, progress_);
      if (stopped_) return {};
      if (coarse.usable && coarse.is_hopeless()) {
        Shortlist list = shortlist_from(coarse_, coarse, kScoreShares[0], kVisible);
        list.coarse = std::move(coarse);
        return list;
      }
    }
    if (left > kHardlyBiased) return shortlist_from(setup_, model, kScoreShares[0], kVisible);
    Shortlist list = shortlist_from(setup_, model, 1, kVisible);
    if (stopped_) return {};
    // What its other numbers have taken up of a missing law shows least over all frames.
    constexpr double kMostOfIt = 0.5, kSure = 4;
    const double above = surely_above(model, threshold_);
    double foreseen = 0;
    for (const LawScore& score : list.best) foreseen = std::max(foreseen, score.fall);
    if (above == 0 || foreseen > kMostOfIt * above ||
        judge_adequacy(model, setup_.options.loss).adequate)
      return list;
    const double scatter = std::sqrt(2 / static_cast<double>(model.residual_count()));
    Shortlist over_few = shortlist_from(setup_, model, kScoreShares[0], 1 + kSure * scatter);
    return over_few.share < 1 ? over_few : list;
  }

  /// Over shares of the frames from `first` on at which chi-square per residual is `visible`, or
  /// all.
  Shortlist shortlist_from(const DiagnosisSetup& setup, const ModelFit& model, double first,
                           double visible_from) {
    std::vector<ModelFit> shorter;
    Shortlist list;
    for (const double share : kScoreShares) {
      if (share < first) continue;
      ModelFit fitted = model;
      if (share < 1) {
        fitted = shortened(model, share);
        refine_model(fitted, setup, {.rounds = 1}, progress_);
        if (stopped_) return {};
        if (&setup == &coarse_) {
          // (It errs, and is to choose alone: without directions.)
          if (shorter.empty())
            leave_bias(fitted, {0.5 * share, share}, values_of_effects(model));
          else
            leave_bias(fitted, {share}, shorter.back().values());
        } else if (fitted.usable) {
          refine_with_discretisation(fitted, setup, progress_);
        }
      }
      if (stopped_) return {};
      if (!fitted.usable) continue;
      const bool visible = fitted.residual().squaredNorm() >
                           visible_from * static_cast<double>(fitted.residual_count());
      if (!visible && shorter.empty() && share < 1) continue;
      if (shorter.empty()) list.share = share;
      shorter.push_back(std::move(fitted));
      if (shorter.size() == kScoreHorizons) break;
    }
    const auto horizons = static_cast<double>(shorter.size());
    for (size_t k = 0; k < shorter.size(); ++k) {
      const ModelFit& at = shorter[k];
      if (k == 0) {
        list.best = scored(setup, at, untested(at));
        for (LawScore& score : list.best) {
          score.share /= horizons;
          if (list.share < 1) score.columns.clear();
        }
        list.scores = without_columns(list.best);
      } else {
        std::vector<LawShapes> laws;
        for (const LawScore& score : list.best) laws.push_back({score.term});
        for (LawScore& score :
             score_laws(at, ModelProjection(at, setup_.options.loss), laws, progress_)) {
          LawScore& same = *std::ranges::find_if(
              list.best, [&](const LawScore& known) { return known.term.same_law(score.term); });
          const double share = same.share + score.share / horizons;
          if (score.fall > same.fall) {
            score.columns.clear();
            same = std::move(score);
          }
          same.share = share;
        }
        std::ranges::stable_sort(list.best, std::greater<>(), &LawScore::share);
      }
      if (stopped_) return {};
      const size_t best = std::min(list.best.size(), static_cast<size_t>(2 * options_.refits));
      list.best.erase(list.best.begin() + static_cast<std::ptrdiff_t>(best), list.best.end());
    }
    if (!shorter.empty()) list.early = std::move(shorter.front());
    return list;
  }

  /// Where a model is hopelessly far off over all frames, its springs and its place make up for
  /// what is missing, and its optimum over few frames is not near. `fitted` to the last of these
  /// shares on the coarse mesh is led there from `start` too, and stands where it leaves less. Not
  /// of a start in motion, which has hundreds of numbers.
  void leave_bias(ModelFit& fitted, std::initializer_list<double> shares,
                  std::vector<NamedValues> start) const {
    if (std::ranges::any_of(fitted.problems, [](const auto& problem) {
          return problem->start == StartKind::unknown;
        }))
      return;
    ModelFit other;
    for (const double share : shares) {
      other = model_at(coarse_, fitted.terms, start);
      for (size_t n = 0; n < other.parts.size(); ++n)
        other.parts[n].frames = frames_of_share(*other.problems[n], share);
      refine_model(other, coarse_, {}, progress_);
      if (stopped_ || !other.usable) return;
      start = other.values();
    }
    if (left_by(other) < left_by(fitted)) fitted = std::move(other);
  }

  /// Lines that a law more leads to, of those on the list.
  std::vector<Line> extend(Line& line, const Shortlist& list) {
    line.finished = true;
    line.refused.clear();
    line.last.clear();
    if (list.share == 1 && !list.coarse.usable) line.last = list.scores;
    std::vector<const LawScore*> scores;
    const double least_gain = worth(line.model);
    for (const LawScore& score : list.best) {
      if (score.fall < least_fall(score.amount.size())) continue;
      // Where little is left over all frames, a fit gains about what was foreseen.
      constexpr double kMoreThanForeseen = 1.25;
      if (list.share == 1 && !list.coarse.usable && kMoreThanForeseen * score.fall < least_gain)
        continue;
      if (scores.size() == static_cast<size_t>(options_.refits)) break;
      scores.push_back(&score);
    }
    std::vector<ModelFit> fitted =
        list.coarse.usable
            ? on_analysed_mesh(line.model, fit_with_laws(coarse_, list.coarse, list.early, scores,
                                                         list.share, threshold_, progress_))
            : fit_with_laws(setup_, line.model, list.early, scores, list.share, threshold_,
                            progress_);
    if (stopped_) return {};
    std::vector<Tried> tried;
    for (size_t k = 0; k < scores.size(); ++k)
      tried.push_back({.score = scores[k], .model = std::move(fitted[k])});
    // What a rough model leaves more than its optimum is nothing to a law that takes nearly all.
    if (tried.empty() || leaves_good_part(best_of(tried), line.model)) settle(line);
    if (stopped_) return {};
    look_elsewhere(tried, line.model);
    if (stopped_) return {};
    let_best_err(tried, line.model);
    if (stopped_) return {};
    ModelFit there;
    if (!tried.empty()) there = in_valley_of(best_of(tried), line.model);
    if (stopped_) return {};
    const bool moves = there.usable, elsewhere = moves || list.coarse.usable;
    if (moves) move(line, std::move(there));
    std::vector<Line> children;
    CrossValidation before;
    if (!tried.empty()) before = validated(line.model, &coarse_);
    if (moves && !line.sound()) line.owes = without_physics(before);
    std::vector<LawTrial> trials(tried.size());
    tbb::parallel_for(size_t{0}, tried.size(), [&](size_t k) {
      ModelFit& model = tried[k].model;
      const auto judged = [&] {
        return judge(line.model, before, *tried[k].score, model, elsewhere);
      };
      trials[k] = judged();
      if ((trials[k].refused.empty() || trials[k].with_later_ones) && model.rough) {
        refine_model(model, setup_, {}, progress_);
        if (!stopped_) trials[k] = judged();
      }
    });
    if (stopped_) return {};
    for (size_t k = 0; k < tried.size(); ++k) {
      Tried& child = tried[k];
      const bool on_credit = std::exchange(trials[k].with_later_ones, false);
      LawTrial trial = trials[k];
      if (!trial.refused.empty()) line.refused.push_back(trial);
      if (!trial.refused.empty() && !on_credit) continue;
      children.push_back({.model = std::move(child.model), .accepted = line.accepted});
      Line& led = children.back();
      led.anew = child.anew;
      led.cost = cost(led.model);
      if (on_credit)
        led.owes = std::min(line.owes, without_physics(before));
      else if (trial.cross_validated >= line.owes)
        led.owes = line.owes;
      trial.refused.clear();
      trial.with_later_ones = on_credit;
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

  /// The models of the coarse mesh that leave least, fitted on the analysed one side by side: from
  /// there, and where that leaves more than the line's model does, or none works out, from this.
  /// Others are not usable, nor those that fall out.
  std::vector<ModelFit> on_analysed_mesh(const ModelFit& line, std::vector<ModelFit> models) const {
    // What is left above the noise: times the best one's, or times a share of the noise.
    constexpr double kMore = 2, kOfNoise = 0.2;
    const auto above = [&](const ModelFit& model) {
      return left_by(model) - static_cast<double>(model.residual_count());
    };
    double least = std::numeric_limits<double>::infinity();
    for (const ModelFit& model : models)
      if (model.usable)
        least = std::min(
            least, std::max(above(model), kOfNoise * static_cast<double>(model.residual_count())));
    std::vector<size_t> best;
    std::vector<ModelFit> coarse;
    for (size_t k = 0; k < models.size(); ++k) {
      ModelFit& model = models[k];
      if (model.usable && above(model) <= kMore * least) {
        best.push_back(k);
        coarse.push_back(std::move(model));
      }
      model.usable = false;
    }
    std::vector<ModelFit> fitted = race_on_mesh(setup_, coarse, threshold_, progress_);
    const bool none = std::ranges::none_of(fitted, &ModelFit::usable);
    tbb::parallel_for(size_t{0}, best.size(), [&](size_t k) {
      ModelFit& model = models[best[k]] = std::move(fitted[k]);
      if (stopped_ || (!model.usable && !none) || left_by(model) < left_by(line)) return;
      model = with_terms(setup_, line, coarse[k].terms, {});
      refine_model(model, setup_, {}, progress_);
    });
    return models;
  }

  /// To a valley where it leaves less.
  void move(Line& line, ModelFit there) {
    stand_at(line, std::move(there));
    line.moved = true;
  }

  /// Refines a base model that was left rough. Where that does not work out it stands as it is.
  void settle(Line& line) {
    if (!line.model.rough || !line.accepted.empty()) return;
    ModelFit settled = line.model;
    refine_with_discretisation(settled, setup_, progress_);
    line.model.rough = false;
    if (!stopped_ && settled.usable) stand_at(line, std::move(settled));
  }

  /// What was scored where a line stood says nothing of it elsewhere.
  void stand_at(Line& line, ModelFit there) {
    line.model = std::move(there);
    line.last.clear();
    if (line.accepted.empty()) {
      base_ = line.model;
      if (std::isfinite(threshold_))
        threshold_ = kHuberScales * robust_scale(line.model.residual());
      begin_at(line);
    }
    line.cost = cost(line.model);
  }

  struct Tried {
    const LawScore* score = nullptr;
    ModelFit model;
    bool anew = false;  ///< identified from scratch
  };

  /// Drops laws that those accepted after them make needless: the model without one fits as well,
  /// by what counts as a gain. What made up for a law on credit stays. The last one has just been
  /// found to be needed, unless the line has moved to another valley since.
  void prune(Line& line) const {
    const size_t given = line.model.terms.size() - line.accepted.size();
    const size_t kept = line.moved ? 0 : 1;
    for (size_t k = 0; k + kept < line.accepted.size();) {
      const auto own = line.accepted.begin() + static_cast<std::ptrdiff_t>(k);
      if (std::any_of(line.accepted.begin(), own, [](const AcceptedEffect& earlier) {
            return earlier.trial.with_later_ones;
          })) {
        ++k;
        continue;
      }
      std::vector<Term> terms = line.model.terms;
      const Term dropped = terms[given + k];
      terms.erase(terms.begin() + static_cast<std::ptrdiff_t>(given + k));
      for (Term& term : terms) {
        if (!share_shape(term, dropped)) continue;
        term = at_shapes_of({dropped}, line.model.values().front(), {term}).front();
        term.fits_shape = term.fits_shape || dropped.fits_shape;
      }
      ModelFit without = with_terms(setup_, line.model, terms, {});
      refine_model(without, setup_, {}, progress_);
      if (stopped_) return;
      LawTrial trial = line.accepted[k].trial;
      const double rise = without.chi_square(threshold_) - line.model.chi_square(threshold_);
      const double least = least_fall(static_cast<Eigen::Index>(trial.term.amplitudes.size()));
      if (!without.usable || rise >= std::max(least, worth(without))) {
        ++k;
        continue;
      }
      trial.refused = "those accepted after it make it needless";
      line.refused.push_back(std::move(trial));
      line.accepted.erase(line.accepted.begin() + static_cast<std::ptrdiff_t>(k));
      line.model = std::move(without);
      line.last.clear();
    }
  }

  /// Identifies a model that leaves more than noise anew: its optimum may lie in another valley
  /// than the one that it was led into. Of several recordings, which costs more, only one that is
  /// far off.
  void leave_valley(ModelFit& model) const {
    if (!model.usable || surely_above(model, threshold_) == 0) return;
    if (model.parts.size() > 1 && !is_far_off(model)) return;
    ModelFit anew = fitted_anew(setup_, model.terms, progress_);
    if (!anew.usable || anew.chi_square(threshold_) >= model.chi_square(threshold_)) return;
    refine_with_discretisation(anew, setup_, progress_);
    if (anew.usable) model = std::move(anew);
  }

  double left_by(const ModelFit& model) const {
    return model.usable ? model.chi_square(threshold_) : std::numeric_limits<double>::infinity();
  }

  bool is_far_off(const ModelFit& model) const {
    return left_by(model) > kFarOff * static_cast<double>(model.residual_count());
  }

  const Tried& best_of(const std::vector<Tried>& tried) const {
    return *std::ranges::min_element(tried, {},
                                     [&](const Tried& child) { return left_by(child.model); });
  }

  bool leaves_good_part(const Tried& tried, const ModelFit& line) const {
    return left_by(tried.model) >= kGoodPart * left_by(line);
  }

  /// Where even the best of them is far off, and leaves a good part of what the line leaves, its
  /// law may be right in another valley of the cost than the one that the line stands in: those
  /// foreseen to take half as much as the best are identified from scratch (where starts are
  /// known).
  void look_elsewhere(std::vector<Tried>& tried, const ModelFit& line) const {
    constexpr double kOfBest = 0.5;
    if (tried.empty() || !best_of(tried).model.usable || !is_far_off(best_of(tried).model) ||
        !leaves_good_part(best_of(tried), line))
      return;
    double foreseen = 0;
    for (const Tried& child : tried) foreseen = std::max(foreseen, child.score->fall);
    for (Tried& child : tried) {
      if (!child.model.usable || child.score->fall < kOfBest * foreseen) continue;
      ModelFit anew = fitted_anew(setup_, child.model.terms, progress_);
      if (!stopped_ && anew.usable) refine_with_discretisation(anew, setup_, progress_);
      if (stopped_) return;
      if (left_by(anew) >= left_by(child.model)) continue;
      child.model = std::move(anew);
      child.anew = true;
    }
  }

  /// What a valley is worth is no merit of the law that led there: the line's model led to the
  /// valley of the best law; where that leaves less than the line's own but much, or the law was
  /// identified from scratch, identified so too. Not usable where neither leaves clearly less,
  /// nor where the law is foreseen to be worth all that it took.
  ModelFit in_valley_of(const Tried& best, const ModelFit& line) const {
    if (!best.model.usable || !is_far_off(line)) return {};
    const double taken = left_by(line) - left_by(best.model);
    if (taken <= 0 || (!best.anew && rise_without_last(best.model, threshold_) > taken)) return {};
    ModelFit there = with_terms(setup_, best.model, line.terms, {});
    refine_model(there, setup_, {}, progress_);
    if (!stopped_ && there.usable) refine_with_discretisation(there, setup_, progress_);
    if (stopped_) return {};
    // What a fit gains that is begun anew in the same valley is none of the law's.
    constexpr double kOtherValley = 0.1;
    const double enough = left_by(line) - kOtherValley * taken;
    if (best.anew || (left_by(there) < enough && is_far_off(there))) {
      ModelFit anew = fitted_anew(setup_, line.terms, progress_);
      if (!stopped_ && anew.usable) refine_with_discretisation(anew, setup_, progress_);
      if (stopped_) return {};
      if (left_by(anew) < left_by(there)) there = std::move(anew);
    }
    if (left_by(there) >= enough) return {};
    return there;
  }

  /// Directions of their own for the models that leave least, of those that stand far from where
  /// the line's directions were taken.
  void let_best_err(std::vector<Tried>& tried, const ModelFit& line) const {
    constexpr double kNear = 0.5;  ///< of the best one's fall
    const double from = line.chi_square(threshold_);
    double best = 0;
    for (const Tried& child : tried)
      if (child.model.usable) best = std::max(best, from - child.model.chi_square(threshold_));
    tbb::parallel_for(size_t{0}, tried.size(), [&](size_t k) {
      ModelFit& model = tried[k].model;
      if (model.usable && model.parts.front().directions.cols() == 0 &&
          from - model.chi_square(threshold_) >= kNear * best)
        refine_with_discretisation(model, setup_, progress_);
    });
  }

  /// Shapes between those of the grid, for laws that are near the best.
  void fit_shapes(std::vector<Line>& children) {
    constexpr double kNear = 0.2;  ///< of the best one's fall
    if (children.empty()) return;
    const double reach = kNear * children.front().accepted.back().trial.fall;
    const double best = children.front().cost;
    for (Line& child : children) {
      std::vector<Term> terms = child.model.terms;
      const bool is_fitted = std::ranges::any_of(terms, [&](const Term& term) {
        return term.fits_shape && share_shape(term, terms.back());
      });
      if (terms.back().shape.empty() || is_fitted || child.cost > best + reach) continue;
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

  /// `forces_mesh`: of free forces, where these are asked for.
  CrossValidation validated(const ModelFit& model,
                            const DiagnosisSetup* forces_mesh = nullptr) const {
    // A recording left out says most where there are enough others.
    constexpr size_t kEnough = 3;
    return cross_validate(setup_, model, kTimeBlocks, threshold_, model.parts.size() >= kEnough,
                          forces_mesh);
  }

  /// Whether a law takes something from what free forces leave. These take much of all that is
  /// missing, and of several laws each one alone leaves more than they do.
  bool helps_free_forces(const CrossValidation& without, const ModelFit& after) const {
    constexpr double kLeastGain = 0.1;  ///< of what is above the noise
    const double gain = without.free_forces - validated(after, &coarse_).free_forces;
    return gain > kLeastGain * std::max(0.0, without.free_forces - 1);
  }

  /// What is left of a model that is mended without physics.
  static double without_physics(const CrossValidation& of) {
    return std::min(of.constant_offset, of.last_residual);
  }

  /// Whether a law takes much of what a model leaves, of observations left out, above the noise.
  static bool is_good_part(const CrossValidation& without, const CrossValidation& own) {
    return without.mean - own.mean > kGoodPart * (without.mean - 1);
  }

  /// Where a model is far off, what else it lacks makes the sigmas of any amplitude, and they say
  /// little of this one. A law that foresees no block left out worse is sure without them.
  bool is_sure_by_blocks(const ModelFit& before, const CrossValidation& without,
                         const CrossValidation& own) const {
    const auto count = static_cast<double>(before.residual_count());
    return before.chi_square(threshold_) > kFarOff * count && without.mean > kFarOff &&
           own.block.size() >= static_cast<size_t>(kTimeBlocks) &&
           std::ranges::equal(own.block, without.block, std::less_equal<>());
  }

  /// `elsewhere`: the law was scored in another valley, or on another mesh, than where the model
  /// without it stands.
  LawTrial judge(const ModelFit& before, const CrossValidation& without, const LawScore& score,
                 const ModelFit& after, bool elsewhere) const {
    LawTrial trial{.term = score.term, .foreseen_fall = score.fall, .refused = {}};
    if (!after.usable) {
      trial.refused = "others leave far less, or no fit worked out";
      return trial;
    }
    trial.term = after.terms.back();
    trial.fall = before.chi_square(threshold_) - after.chi_square(threshold_);
    const double least = least_fall(score.amount.size());
    if (trial.fall < std::max(least, elsewhere ? 0 : 0.5 * score.fall)) {
      trial.refused = "the fit gains less than half of what was foreseen";
      return trial;
    }
    if (trial.fall < worth(before)) {
      trial.refused = "it takes too little of what is above the noise";
      return trial;
    }
    const CrossValidation own = validated(after);
    trial.cross_validated = own.mean;
    trial.without_it = without.mean;
    const double trivial = without_physics(without);
    trial.best_trivial = std::min(trivial, without.free_forces);
    trial.clear_of_neutral =
        clear_of_neutral(after, judge_adequacy(after, setup_.options.loss), threshold_);
    const bool good_part = is_good_part(without, own);
    if (!own.usable || own.mean >= without.mean) {
      trial.refused = "frames that were left out are predicted no better";
    } else if (trial.clear_of_neutral < LawTrial::kClear &&
               !(trial.clear_of_neutral > 0 && good_part &&
                 is_sure_by_blocks(before, without, own))) {
      trial.refused = "not clear of its neutral value";
    } else if (own.mean >= without.free_forces && !helps_free_forces(without, after)) {
      trial.refused = "free forces do as well, and no better beside it";
    } else if (own.mean >= trivial) {
      trial.refused = "a correction without physics does as well";
      trial.with_later_ones = good_part;
    }
    return trial;
  }

  const DiagnosisSetup& setup_;
  DiagnosisSetup coarse_;
  const SearchOptions& options_;
  double threshold_;
  double base_chi_square_ = 0, base_cost_ = 0;  ///< of the model that has found nothing
  ModelFit base_;                               ///< that model, where it is not what was given
  std::atomic<bool> stopped_ = false;           ///< set by `progress_` once it has said so
  ProgressCallback progress_;
};

}  // namespace

double worth_naming(const ModelFit& model, double threshold, double explained) {
  constexpr double kNoiseKnown = 0.003, kOfExcess = 1.0 / 3, kOfAll = 0.05, kOfNoise = 0.25;
  constexpr double kFormKnown = 0.01;
  const auto count = static_cast<double>(model.residual_count());
  const double all = model.chi_square(threshold);
  const double of_much = std::max(kOfAll * all, kOfNoise * count);
  return std::max({kNoiseKnown * count, kFormKnown * kFormKnown * explained,
                   std::min(kOfExcess * surely_above(model, threshold), of_much)});
}

LawSearch search_laws(const DiagnosisSetup& setup, ModelFit base, const SearchOptions& options,
                      const ProgressCallback& progress) {
  return Search(setup, options, progress).run(std::move(base));
}

}  // namespace clothfit
