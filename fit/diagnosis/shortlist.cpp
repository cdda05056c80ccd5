#include "fit/diagnosis/shortlist.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <utility>

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/contacts.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/search_context.h"
#include "fit/diagnosis/space_mapping.h"
#include "fit/diagnosis/worth.h"

namespace clothfit {
namespace {

/// Horizons at which hypotheses are scored, as shares of the fitted frames.
constexpr double kScoreShares[] = {0.28, 0.4, 0.56, 0.75, 1.0};
constexpr size_t kScoreHorizons = 3;  ///< of these, from the first on that shows something

/// Parts of the grid's spacing at which shapes beside the best one are scored, in turn.
constexpr double kShapeParts[] = {0.5, 0.25};

Score& of_same_mode(std::vector<Score>& scores, const Score& as) {
  return *std::ranges::find_if(
      scores, [&](const Score& known) { return known.hypothesis.same_mode(as.hypothesis); });
}

void sort_by_share(std::vector<Score>& scores) {
  std::ranges::stable_sort(scores, std::greater<>(), &Score::share);
}

double most_decrease(const std::vector<Score>& scores) {
  double most = 0;
  for (const Score& score : scores) most = std::max(most, score.decrease);
  return most;
}

/// Scores hypotheses at the shapes given, and then beside the best ones. A hypothesis that comes
/// with one shape keeps it. A mode may explain several times as much between the grid's points.
std::vector<Score> at_best_shapes(const SearchContext& search, const FittedModel& model,
                                  const ModelProjection& projection,
                                  const std::vector<ShapeCandidates>& hypotheses) {
  std::vector<Score> scores = score_hypotheses(model, projection, hypotheses, search.progress);
  for (const double part : kShapeParts) {
    const double most = std::max(least_decrease(1), most_decrease(scores));
    std::vector<ShapeCandidates> around;
    for (const Score& score : scores) {
      const ShapeCandidates& given =
          *std::ranges::find_if(hypotheses, [&](const ShapeCandidates& shapes) {
            return score.hypothesis.same_mode(shapes.front());
          });
      if (score.decrease > kCriteria.shape_refined_above * most && given.size() > 1)
        around.push_back(shapes_around(score.hypothesis, part));
    }
    for (Score& moved : score_hypotheses(model, projection, around, search.progress)) {
      Score& same = of_same_mode(scores, moved);
      if (moved.decrease > same.decrease) same = std::move(moved);
    }
  }
  sort_by_share(scores);
  return scores;
}

/// Returns the values of the effects' parameters alone.
std::vector<NamedValues> values_of_effects(const FittedModel& model) {
  std::vector<NamedValues> values = model.values();
  for (size_t n = 0; n < values.size(); ++n)
    for (const FitParameter& parameter : model.problems[n]->space.parameters)
      if (parameter.role != ParameterRole::effect && parameter.role != ParameterRole::measurement)
        values[n].erase(parameter.name);
  return values;
}

/// Leads a model from `start` over growing shares. The result takes the place of
/// `fitted` where it leaves less. Springs and place of a model that misfits grossly make up for
/// what is missing, so its optimum over few frames is not near the one over all. A start in motion
/// has hundreds of numbers, and is left out.
void leave_bias(const SearchContext& search, FittedModel& fitted,
                std::initializer_list<double> shares, std::vector<NamedValues> start) {
  if (std::ranges::any_of(fitted.problems,
                          [](const auto& problem) { return problem->start == StartKind::unknown; }))
    return;
  FittedModel other;
  for (const double share : shares) {
    other = model_at(search.setup, fitted.hypotheses, start);
    for (size_t n = 0; n < other.parts.size(); ++n)
      other.parts[n].frames = frames_of_share(*other.problems[n], share);
    refine_model(other, search.setup, {}, search.progress);
    if (!other.usable()) return;
    start = other.values();
  }
  if (search.left_by(other) < search.left_by(fitted)) fitted = std::move(other);
}

/// Fits a model over one horizon, after the one fitted over the horizon before.
FittedModel over_horizon(const SearchContext& search, const DiagnosisSetup& setup,
                         const FittedModel& model, double share, const FittedModel* before) {
  if (share == 1) return model;
  FittedModel fitted = shortened(model, share);
  refine_model(fitted, setup, {.rounds = 1}, search.progress);
  if (!search.only_chooses) {
    if (!fitted.usable()) return fitted;
    if (&setup == &search.setup)
      refine_with_discretisation(fitted, setup, search.progress);
    else  // what the meshes differ by over all frames is not what they differ by over few
      fitted = corrected_on_mesh(setup, mapped_to_analysed_mesh(search, fitted, share));
  } else if (before == nullptr) {
    leave_bias(search, fitted, {0.5 * share, share}, values_of_effects(model));
  } else {
    leave_bias(search, fitted, {share}, before->values());
  }
  return fitted;
}

/// A model over several horizons.
struct OverHorizons {
  FittedModel before;                ///< over the longest one at which nothing shows, or not run
  std::vector<FittedModel> shorter;  ///< those at which something does
  double first_share = 1;            ///< the first of these, as a share of the frames
};

/// Fits the model over horizons from share `first` on. They begin with the one at which chi-square
/// per residual is `visible`, or with all frames.
OverHorizons over_horizons(const SearchContext& search, const DiagnosisSetup& setup,
                           const FittedModel& model, double first, double visible) {
  OverHorizons result;
  std::vector<FittedModel>& shorter = result.shorter;
  for (const double share : kScoreShares) {
    if (share < first) continue;
    FittedModel fitted =
        over_horizon(search, setup, model, share, shorter.empty() ? nullptr : &shorter.back());
    if (!fitted.usable()) continue;
    const bool shows =
        fitted.residual().squaredNorm() > visible * static_cast<double>(fitted.residual_count());
    if (!shows && shorter.empty() && share < 1) {
      result.before = std::move(fitted);
      continue;
    }
    if (shorter.empty()) result.first_share = share;
    shorter.push_back(std::move(fitted));
    if (shorter.size() == kScoreHorizons) break;
  }
  return result;
}

/// Adds the scores over a further horizon, for the hypotheses that are best so far.
void add_horizon(const SearchContext& search, const FittedModel& at, double horizons,
                 std::vector<Score>& best) {
  std::vector<ShapeCandidates> hypotheses;
  for (const Score& score : best) hypotheses.push_back({score.hypothesis});
  const ModelProjection projection(at, search.setup.options.loss);
  for (Score& score : score_hypotheses(at, projection, hypotheses, search.progress)) {
    Score& same = of_same_mode(best, score);
    const double share = same.share + score.share / horizons;
    if (score.decrease > same.decrease) {
      score.columns.clear();
      same = std::move(score);
    }
    same.share = share;
  }
  sort_by_share(best);
}

/// Adds scores of contact with obstacles that a model does not have. Each is scored over the
/// horizon at which it explains most: a cloth may meet it late.
void add_contacts(const SearchContext& search, const DiagnosisSetup& setup,
                  const OverHorizons& over, double visible, Shortlist& list) {
  // Fits by the dozen are the coarse mesh's work.
  if (!search.only_chooses && is_coarser(search.coarse, setup)) return;
  std::vector<Score> best;
  const FittedModel* before = &over.before;
  for (const FittedModel& at : over.shorter) {
    std::vector<Hypothesis> untested = search.options.contacts;
    std::erase_if(untested, [&](const Hypothesis& contact) {
      return std::ranges::find(at.hypotheses, contact.effect, &Hypothesis::effect) !=
             at.hypotheses.end();
    });
    if (at.misfit() > visible) {
      for (Score& score : score_contacts(search, setup, *before, at, untested)) {
        const auto same = std::ranges::find_if(
            best, [&](const Score& known) { return known.hypothesis.same_mode(score.hypothesis); });
        if (same == best.end())
          best.push_back(std::move(score));
        else if (score.share > same->share)
          *same = std::move(score);
      }
    }
    before = &at;
  }
  for (Score& score : best) {
    list.scores.push_back(score);
    list.best.push_back(std::move(score));
  }
  sort_by_share(list.best);
}

Shortlist over_shares(const SearchContext& search, const DiagnosisSetup& setup,
                      const FittedModel& model, double first, double visible) {
  Shortlist list;
  OverHorizons over = over_horizons(search, setup, model, first, visible);
  list.share = over.first_share;
  std::vector<FittedModel>& shorter = over.shorter;
  const auto horizons = static_cast<double>(shorter.size());
  for (size_t k = 0; k < shorter.size(); ++k) {
    if (k == 0) {
      list.best = score_at_best_shapes(search, setup, shorter[k], search.untested(shorter[k]));
      for (Score& score : list.best) {
        score.share /= horizons;
        if (list.share < 1) score.columns.clear();
      }
      list.scores = without_columns(list.best);
    } else {
      add_horizon(search, shorter[k], horizons, list.best);
    }
    const size_t kept = std::min(list.best.size(), static_cast<size_t>(2 * search.options.refits));
    list.best.erase(list.best.begin() + static_cast<std::ptrdiff_t>(kept), list.best.end());
  }
  add_contacts(search, setup, over, visible, list);
  if (!shorter.empty()) list.early = std::move(shorter.front());
  return list;
}

/// Tells whether one hypothesis is predicted to take a good part of what is missing, or nothing is.
/// Over all frames a missing effect shows least, for other parameters have taken up much of it.
bool says_enough(const SearchContext& search, const FittedModel& model, const Shortlist& list) {
  const double above = sure_excess(model, search.threshold);
  const double predicted = most_decrease(list.best);
  return above == 0 || predicted > kCriteria.explained_at_once * above ||
         judge_adequacy(model, search.setup.options.loss).adequate;
}

/// Scores over the shortest horizons at which chi-square per residual is `visible`, on the coarse
/// mesh where there is one.
Shortlist over_few_frames(const SearchContext& search, const FittedModel& model, double visible) {
  if (!search.only_chooses && is_coarser(search.coarse, search.setup)) {
    FittedModel coarse = corrected_on_mesh(search.coarse, model);
    if (coarse.usable()) {
      Shortlist list = over_shares(search, search.coarse, coarse, kScoreShares[0], visible);
      list.coarse = std::move(coarse);
      return list;
    }
  }
  return over_shares(search, search.setup, model, kScoreShares[0], visible);
}

}  // namespace

std::vector<Score> without_columns(std::vector<Score> scores) {
  for (Score& score : scores) score.columns.clear();
  return scores;
}

std::vector<Score> Shortlist::merged() const {
  std::vector<Score> all = scores;
  for (Score& score : all)
    for (const Score& known : best)
      if (known.hypothesis.same_mode(score.hypothesis)) score = known;
  sort_by_share(all);
  return without_columns(std::move(all));
}

std::vector<Score> score_at_best_shapes(const SearchContext& search, const DiagnosisSetup& setup,
                                        const FittedModel& model,
                                        std::vector<ShapeCandidates> hypotheses) {
  const ModelProjection projection(model, search.setup.options.loss);
  if (!is_coarser(search.coarse, setup))
    return at_best_shapes(search, model, projection, hypotheses);
  // A coarser mesh chooses frequencies and other shapes, which are many. It may get a place on the
  // cloth wrong altogether. So places are all scored here while nothing has been found yet.
  std::vector<ShapeCandidates> elsewhere;
  for (const ShapeCandidates& shapes : hypotheses)
    if (!model.hypotheses.empty() || !is_over_cloth(shapes.front())) elsewhere.push_back(shapes);
  std::vector<Score> far;
  const FittedModel coarse = with_derivatives_of(search.coarse, model);
  if (coarse.usable()) {
    const ModelProjection coarse_projection(coarse, search.setup.options.loss);
    far = at_best_shapes(search, coarse, coarse_projection, elsewhere);
    const double near = kCriteria.scored_again_of_best *
                        (far.empty() ? 0 : std::max(least_decrease(1), most_decrease(far)));
    for (const Score& score : far) {
      const auto own = std::ranges::find_if(hypotheses, [&](const ShapeCandidates& shapes) {
        return score.hypothesis.same_mode(shapes.front());
      });
      if (score.decrease < near)
        hypotheses.erase(own);
      else
        *own = {score.hypothesis};
    }
    std::erase_if(far, [&](const Score& score) { return score.decrease >= near; });
  }
  std::vector<Score> scores = at_best_shapes(search, model, projection, hypotheses);
  std::ranges::move(without_columns(std::move(far)), std::back_inserter(scores));
  sort_by_share(scores);
  return scores;
}

Shortlist make_shortlist(const SearchContext& search, const FittedModel& model) {
  if (model.misfit() > kCriteria.biased) return over_few_frames(search, model, kCriteria.visible);
  Shortlist list = over_shares(search, search.setup, model, 1, kCriteria.visible);
  if (says_enough(search, model, list)) return list;
  const double scatter = std::sqrt(2 / static_cast<double>(model.residual_count()));
  Shortlist over_few = over_few_frames(search, model, 1 + kCriteria.visible_sigmas * scatter);
  return over_few.share < 1 ? over_few : list;
}

}  // namespace clothfit
