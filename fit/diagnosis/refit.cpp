#include "fit/diagnosis/refit.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>

#include "data/parallel.h"
#include "fit/diagnosis/catalogue.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/horizons.h"
#include "fit/diagnosis/worth.h"
#include "fit/identify.h"
#include "fit/problem/problem.h"

namespace clothfit {
namespace {

/// A share of the frames over which most of what is missing has shown, and little has grown.
constexpr double kShortHorizon = 0.4;

/// Returns the model with a hypothesis at a share of its predicted amplitude, not linearised. A
/// start at half of it is on the right side, and not too far. A place on the cloth is fitted from
/// the shortest horizon on. In the wrong place an amplitude shrinks from horizon to horizon.
FittedModel cautious_start(const DiagnosisSetup& setup, const FittedModel& model,
                           const Score& score) {
  std::vector<Hypothesis> hypotheses = model.hypotheses;
  hypotheses.push_back(score.hypothesis);
  hypotheses.back().fits_shape = is_over_cloth(score.hypothesis);
  std::vector<NamedValues> start = model.values();
  set_amplitudes(score.hypothesis, kCriteria.cautious_start * score.amplitude, start);
  return model_at(setup, hypotheses, start);
}

/// Moves a model over all frames to its optimum over a share of them. Returns the model over that
/// share. Over all frames its discretisation may err as that of `from` does.
FittedModel refined_over(const DiagnosisSetup& setup, FittedModel& whole, const FittedModel& from,
                         double share, const ProgressCallback& progress) {
  FittedModel fitted = share < 1 ? shortened(whole, share) : whole;
  // What leads the race is refined further before it is extended.
  StageOptions stage = is_coarser(with_coarse_mesh(setup), setup) ? kNearEnough : StageOptions();
  if (share < 1) {
    stage.rounds = 1;
    stage.least_decrease = 0;
    for (size_t n = 0; n < fitted.parts.size(); ++n)
      stage.least_decrease += kUnrefinedDecrease * fitted.objective(n).residual_count();
  }
  for (size_t n = 0; n < fitted.parts.size(); ++n) {
    PooledPart& part = fitted.parts[n];
    part.linear = {};
    if (share < 1) continue;
    part.correction = from.parts[n].correction;
    part.directions = from.parts[n].directions;
    part.amplitudes = from.parts[n].amplitudes;
  }
  refine_model(fitted, setup, stage, progress);
  for (size_t n = 0; fitted.usable() && n < whole.parts.size(); ++n)
    whole.parts[n].values = fitted.parts[n].values;
  return fitted;
}

/// Fits the model with a hypothesis from where it stands, over all frames.
FittedModel fit_from_here(const DiagnosisSetup& setup, const FittedModel& model, const Score& score,
                          const StageOptions& stage, const ProgressCallback& progress) {
  std::vector<Hypothesis> hypotheses = model.hypotheses;
  hypotheses.push_back(score.hypothesis);
  FittedModel fitted = with_hypotheses(setup, model, hypotheses, score.columns);
  refine_model(fitted, setup, stage, progress);
  return fitted;
}

/// A model fitted over a share of the frames.
using FitOver = std::function<FittedModel(size_t model, double share)>;

/// Fits models side by side over growing horizons. Those that leave far more than the best one
/// fall out, and are not usable.
/// `least_gain`, where it is above 0, is the decrease that the first horizon must bring below
/// `without`.
std::vector<FittedModel> race(size_t models, double first_share, double threshold,
                              const FitOver& fit_over, double without = 0, double least_gain = 0) {
  std::vector<FittedModel> fitted(models);
  std::vector<size_t> running(models);
  std::iota(running.begin(), running.end(), size_t{0});
  for (const double share : shares_from(first_share)) {
    double least = std::numeric_limits<double>::infinity();
    for_each_index(running.size(), [&](size_t n) {
      const size_t k = running[n];
      fitted[k] = fit_over(k, share);
    });
    for (const size_t k : running)
      if (fitted[k].usable()) least = std::min(least, fitted[k].chi_square(threshold));
    if (share == 1) break;
    const bool is_first = share == first_share;
    std::erase_if(running, [&](size_t k) {
      if (!fitted[k].usable()) return true;
      if (is_first && least_gain > 0 && without - fitted[k].chi_square(threshold) < least_gain) {
        fitted[k].state = FitState::failed;
        return true;
      }
      const auto count = static_cast<double>(fitted[k].residual_count());
      const double above = fitted[k].chi_square(threshold) - count;
      const bool keeps_up = above <= kCriteria.race_far_behind *
                                         std::max(least - count, kCriteria.race_of_noise * count);
      if (!keeps_up) fitted[k].state = FitState::failed;
      return !keeps_up;
    });
  }
  return fitted;
}

/// Returns a recording's correction over all frames: that of `early` over its own.
Eigen::VectorXd correction_of(const FittedModel& model, const FittedModel& early, size_t n) {
  Eigen::VectorXd correction = model.parts[n].correction;
  const Eigen::VectorXd& first = early.parts[n].correction;
  if (correction.size() == 0 || first.size() == 0) return correction;
  Eigen::Index row = 0;
  const TrajectoryObjective objective = model.objective(n);
  for (const Objective::Block& block : objective.blocks()) {
    if (block.frame >= early.parts[n].frames) continue;
    correction.segment(block.offset, block.dimension) = first.segment(row, block.dimension);
    row += block.dimension;
  }
  return correction;
}

/// Fits hypotheses beside a model, from where `early` stands.
std::vector<FittedModel> race_hypotheses(const DiagnosisSetup& setup, const FittedModel& model,
                                         const FittedModel& early,
                                         const std::vector<const Score*>& scores,
                                         double first_share, double threshold,
                                         const ProgressCallback& progress) {
  std::vector<FittedModel> whole;
  for (const Score* score : scores) {
    whole.push_back(cautious_start(setup, early, *score));
    for (size_t n = 0; n < model.parts.size(); ++n)
      whole.back().parts[n].correction = correction_of(model, early, n);
  }
  const bool is_early = first_share < 1 && early.parts.front().frames < model.parts.front().frames;
  const double least_gain = is_early ? kCriteria.race_worth * worth_naming(early, threshold) : 0;
  return race(
      scores.size(), first_share, threshold,
      [&](size_t k, double share) { return refined_over(setup, whole[k], model, share, progress); },
      is_early ? early.chi_square(threshold) : 0, least_gain);
}

/// Leads contact from where it was fitted over few frames to all of them.
FittedModel lead_contact(const DiagnosisSetup& setup, const FittedModel& model,
                         const FittedModel& early, const Score& score,
                         const ProgressCallback& progress) {
  std::vector<Hypothesis> hypotheses = model.hypotheses;
  hypotheses.push_back(score.hypothesis);
  FittedModel whole = model_at(setup, hypotheses, score.fitted);
  for (size_t n = 0; n < model.parts.size(); ++n)
    whole.parts[n].correction = correction_of(model, early, n);
  FittedModel fitted;
  for (const double share : shares_from(score.fitted_share)) {
    fitted = refined_over(setup, whole, model, share, progress);
    if (!fitted.usable()) break;
  }
  return fitted;
}

/// Refines an unrefined fit. Where that does not gain what was predicted, growing horizons are
/// tried.
FittedModel fit_from_unrefined(const DiagnosisSetup& setup, const FittedModel& model,
                               const Score& score, FittedModel near, double threshold,
                               const ProgressCallback& progress) {
  refine_model(near, setup, {}, progress);
  if (near.usable()) {
    const double left = near.chi_square(threshold);
    const double decrease = model.chi_square(threshold) - left;
    if (decrease > kCriteria.kept_promise * score.decrease ||
        left < kCriteria.hardly_above_noise * static_cast<double>(near.residual_count()))
      return near;
  }
  FittedModel far =
      race_hypotheses(setup, model, model, {&score}, kShortHorizon, threshold, progress).front();
  if (!near.usable()) return far;
  return far.usable() && far.chi_square(threshold) < near.chi_square(threshold) ? far : near;
}

/// Fits all hypotheses along the derivatives of the score, unrefined. Those that gain half as much
/// as the best one, or less than was predicted, are refined then.
std::vector<FittedModel> fit_near(const DiagnosisSetup& setup, const FittedModel& model,
                                  const std::vector<const Score*>& scores, double threshold,
                                  const ProgressCallback& progress) {
  const double without = model.chi_square(threshold);
  std::vector<FittedModel> fitted(scores.size());
  std::vector<double> decrease(scores.size(), 0);
  for_each_index(scores.size(), [&](size_t k) {
    fitted[k] =
        scores[k]->fitted.empty()
            ? fit_from_here(setup, model, *scores[k], {.rounds = 1, .unrefined = true}, progress)
            : lead_contact(setup, model, model, *scores[k], progress);
    if (fitted[k].usable()) decrease[k] = without - fitted[k].chi_square(threshold);
  });
  if (fitted.empty()) return fitted;
  const double enough = kCriteria.exact_fit_of_best * *std::ranges::max_element(decrease);
  for_each_index(scores.size(), [&](size_t k) {
    if (decrease[k] < enough && decrease[k] > kCriteria.kept_promise * scores[k]->decrease) return;
    if (!scores[k]->fitted.empty()) return;
    fitted[k] =
        fit_from_unrefined(setup, model, *scores[k], std::move(fitted[k]), threshold, progress);
  });
  return fitted;
}

}  // namespace

FittedModel with_hypotheses(const DiagnosisSetup& setup, const FittedModel& model,
                            const std::vector<Hypothesis>& hypotheses, const Columns& columns) {
  FittedModel result = model_at(setup, hypotheses, model.values());
  const std::vector<std::string> added =
      hypotheses.empty() ? std::vector<std::string>() : hypotheses.back().parameters();
  for (size_t n = 0; n < result.parts.size(); ++n) {
    const PooledPart& from = model.parts[n];
    PooledPart& part = result.parts[n];
    part.frames = from.frames;
    part.correction = from.correction;
    part.directions = from.directions;
    part.amplitudes = from.amplitudes;
    // The run is another one where a hypothesis is dropped.
    const std::vector<FitParameter>& before = model.problems[n]->space.parameters;
    const bool kept_all = std::ranges::all_of(before, [&](const FitParameter& parameter) {
      return result.problems[n]->space.index(parameter.name) >= 0;
    });
    if (!from.linear.usable || !kept_all) continue;
    part.steps = from.steps;
    const ParameterSpace& space = result.problems[n]->space;
    const Eigen::VectorXd slope = space.value_by_coordinate(part.values);
    Eigen::MatrixXd& jacobian = part.linear.residual_by_coordinate;
    jacobian.resize(from.linear.residual.size(), space.size());
    std::vector<int> unknown;
    for (int p = 0; p < space.size(); ++p) {
      const std::string& name = space.parameters[static_cast<size_t>(p)].name;
      const auto known = model.problems[n]->space.index(name);
      const auto scored = std::ranges::find(added, name);
      if (known >= 0) {
        jacobian.col(p) = from.linear.residual_by_coordinate.col(known);
      } else if (!columns.empty() && scored != added.end()) {
        // A recording's own amplitudes have columns of their own.
        const auto count = static_cast<Eigen::Index>(added.size());
        const Eigen::Index first =
            columns[n].cols() > count ? static_cast<Eigen::Index>(n) * count : 0;
        jacobian.col(p) = columns[n].col(first + (scored - added.begin())) * slope[p];
      } else {
        unknown.push_back(p);
      }
    }
    part.linear.residual = from.linear.residual;
    part.linear.usable = true;
    part.borrowed = true;
    if (unknown.empty()) continue;
    const Linearisation rest = result.objective(n).linearise_by(part.values, unknown);
    part.linear.usable = rest.usable;
    if (rest.usable) jacobian(Eigen::all, unknown) = rest.residual_by_coordinate;
  }
  return result;
}

std::vector<FittedModel> fit_with_hypotheses(const DiagnosisSetup& setup, const FittedModel& model,
                                             const FittedModel& early,
                                             const std::vector<const Score*>& scores,
                                             double first_share, double threshold,
                                             const ProgressCallback& progress) {
  if (first_share == 1) return fit_near(setup, model, scores, threshold, progress);
  std::vector<FittedModel> fitted(scores.size());
  const double without = model.chi_square(threshold);
  const auto count = static_cast<double>(model.residual_count());
  bool is_contact_alone = false;
  std::vector<size_t> racing;
  for (size_t k = 0; k < scores.size(); ++k) {
    if (scores[k]->fitted.empty()) {
      racing.push_back(k);
      continue;
    }
    fitted[k] = lead_contact(setup, model, early, *scores[k], progress);
    is_contact_alone = is_contact_alone || (fitted[k].usable() &&
                                            fitted[k].chi_square(threshold) - count <
                                                (1 - kCriteria.contact_alone) * (without - count));
  }
  // Nothing else can take as much, and none of the others is told from contact by the race.
  if (is_contact_alone) return fitted;
  std::vector<const Score*> raced;
  for (const size_t k : racing) raced.push_back(scores[k]);
  std::vector<FittedModel> models =
      race_hypotheses(setup, model, early, raced, first_share, threshold, progress);
  for (size_t n = 0; n < racing.size(); ++n) fitted[racing[n]] = std::move(models[n]);
  // Growing horizons can lead astray where no single hypothesis brings the model near the cloth.
  for (size_t k = 0; k < fitted.size(); ++k) {
    if (!fitted[k].usable() || fitted[k].chi_square(threshold) < without) continue;
    if (!scores[k]->fitted.empty()) continue;
    fitted[k] = fit_from_here(setup, model, *scores[k], {}, progress);
  }
  return fitted;
}

FittedModel identified_from_scratch(const DiagnosisSetup& setup,
                                    const std::vector<Hypothesis>& hypotheses,
                                    const ProgressCallback& progress) {
  // A start in motion has hundreds of numbers more. A fit of it from scratch takes minutes, where
  // one from a known model takes seconds.
  if (std::ranges::any_of(setup.inputs, [](const FitInput& input) {
        return input.recording.start == StartKind::unknown;
      }))
    return {};
  const FitOptions options = options_on_mesh(setup, hypotheses, 0);
  const FitProblem problem = make_problem(setup.inputs.front(), options, setup.columns, setup.rows);
  FitReport report;
  std::vector<Candidate> candidates;
  const RefineResult found =
      identify(setup.inputs.front(), problem, options, progress, report, candidates);
  if (!found.usable) return {};
  NamedValues values;
  for (int p = 0; p < problem.space.size(); ++p)
    values[problem.space.parameters[static_cast<size_t>(p)].name] = found.values[p];
  FittedModel fitted =
      model_at(setup, hypotheses, std::vector<NamedValues>(setup.inputs.size(), values));
  if (setup.inputs.size() > 1) return fit_on_mesh(setup, fitted, progress);
  linearise_model(fitted);
  return fitted;
}

}  // namespace clothfit
