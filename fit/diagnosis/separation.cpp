#include "fit/diagnosis/separation.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "data/parallel.h"
#include "fit/diagnosis/candidate_recording.h"
#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/horizons.h"
#include "fit/diagnosis/hypothesis_derivatives.h"
#include "fit/diagnosis/projection.h"
#include "fit/diagnosis/refit.h"
#include "fit/jobs/stop_token.h"
#include "fit/problem/effects_of.h"
#include "fit/problem/parameterised_model.h"
#include "model/cloth/stability.h"

namespace clothfit {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr size_t kKept = 3;  ///< recordings that are named

/// Hypotheses whose amplitudes together are those of one refit.
using Refit = std::vector<Hypothesis>;

/// Returns the hypothesis at its shape and beside it, and a harmonic at any phase.
std::vector<Refit> refits_of(const Hypothesis& hypothesis) {
  constexpr double kPart = 0.5;
  ShapeCandidates shapes = shapes_around(hypothesis, kPart);
  shapes.insert(shapes.begin(), hypothesis);
  if (!is_harmonic(hypothesis)) {
    std::vector<Refit> refits;
    for (const Hypothesis& shape : shapes) refits.push_back({shape});
    return refits;
  }
  std::map<double, Refit> by_frequency;
  for (const Hypothesis& shape : shapes) {
    Refit& phases = by_frequency[shape.shape.at("frequency")];
    if (!phases.empty()) continue;
    for (const double phase : {0.0, 0.25}) {
      phases.push_back(shape);
      phases.back().shape["phase"] = phase;
    }
  }
  std::vector<Refit> refits;
  for (auto& [frequency, phases] : by_frequency) refits.push_back(std::move(phases));
  return refits;
}

/// Returns the parameters of a hypothesis in a problem's space: amplitudes, and shapes where they
/// are fitted.
std::vector<int> parameters_of(const Hypothesis& hypothesis, const ParameterSpace& space) {
  std::vector<std::string> names = hypothesis.parameters();
  if (hypothesis.fits_shape)
    for (const auto& [name, value] : hypothesis.shape)
      names.push_back(hypothesis.effect + "." + name);
  std::vector<int> parameters;
  for (const std::string& name : names)
    if (const int p = space.index(name); p >= 0) parameters.push_back(p);
  return parameters;
}

/// Returns the model as if it did not have a hypothesis, near where it stands with it.
FittedModel without(FittedModel model, const Hypothesis& hypothesis) {
  for (size_t n = 0; n < model.parts.size(); ++n)
    for (const int p : parameters_of(hypothesis, model.problems[n]->space))
      model.parts[n].linear.residual_by_coordinate.col(p).setZero();
  return model;
}

/// Returns the change of the residuals by a hypothesis' amplitudes, D_a a: a column of each
/// recording.
Columns change_by(const FittedModel& model, const Hypothesis& hypothesis) {
  const EffectDescription effect = describe_effect(hypothesis.effect);
  Columns change;
  for (size_t n = 0; n < model.parts.size(); ++n) {
    const PooledPart& part = model.parts[n];
    const ParameterSpace& space = model.problems[n]->space;
    const Eigen::VectorXd slope = space.value_by_coordinate(part.values);
    change.emplace_back(Eigen::MatrixXd::Zero(part.linear.residual.size(), 1));
    for (const std::string& name : hypothesis.amplitudes) {
      const int p = space.index(hypothesis.effect + "." + name);
      if (p < 0) continue;
      const double neutral =
          std::ranges::find(effect.parameters, name, &EffectParameter::name)->neutral;
      change.back() +=
          (part.values[p] - neutral) / slope[p] * part.linear.residual_by_coordinate.col(p);
    }
  }
  return change;
}

/// A hypothesis of the model, and one that may do the same.
struct Pair {
  size_t accepted = 0;
  Hypothesis hypothesis, other;
  std::vector<Refit> refits;  ///< of the other one
};

struct Distance {
  double sigmas = kNone;
  Refit nearest;  ///< of the other hypothesis; none where it cannot act
};

/// Computes hypothesis_distance() of each pair.
std::vector<Distance> distances(const FittedModel& model, const std::vector<Pair>& pairs) {
  std::vector<Hypothesis> hypotheses;
  for (const Pair& pair : pairs)
    for (const Refit& refit : pair.refits)
      hypotheses.insert(hypotheses.end(), refit.begin(), refit.end());
  const std::vector<Columns> columns = hypothesis_derivatives(model, hypotheses);
  std::vector<Distance> result;
  std::optional<ModelProjection> projection;
  Eigen::VectorXd change;
  size_t next = 0;
  for (size_t k = 0; k < pairs.size(); ++k) {
    if (k == 0 || pairs[k].accepted != pairs[k - 1].accepted) {
      // Noise is taken as stated, for the distance is one of the recording and not of its
      // residuals.
      projection.emplace(without(model, pairs[k].hypothesis), Loss::squared);
      change = projection->columns(change_by(model, pairs[k].hypothesis));
    }
    Distance& distance = result.emplace_back();
    for (const Refit& refit : pairs[k].refits) {
      Eigen::MatrixXd can(change.size(), 0);
      for (size_t n = 0; n < refit.size(); ++n, ++next) {
        if (columns[next].empty()) continue;
        const Eigen::MatrixXd own = projection->columns(columns[next]);
        can.conservativeResize(Eigen::NoChange, can.cols() + own.cols());
        can.rightCols(own.cols()) = own;
      }
      if (can.cols() == 0) continue;
      const double left = 1 - squared_multiple_correlation(change, can);
      const double sigmas = std::sqrt(std::max(0.0, left)) * change.norm();
      if (!(sigmas >= distance.sigmas)) distance = {.sigmas = sigmas, .nearest = refit};
    }
  }
  return result;
}

/// Returns the pairs with the refits that have been found nearest, where any was.
std::vector<Pair> narrowed(std::vector<Pair> pairs, const std::vector<Distance>& known) {
  for (size_t k = 0; k < known.size(); ++k)
    if (!known[k].nearest.empty()) pairs[k].refits = {known[k].nearest};
  return pairs;
}

/// Returns how a recording errs on another mesh, as discretisation_errors() has it. The model is
/// fitted there to what is seen here, with updated derivatives. Nothing where that does not run.
std::optional<Eigen::VectorXd> mesh_direction(FitProblem other, const FittedModel& own) {
  const PooledPart& here = own.parts.front();
  const int cells = own.problems.front()->cloth.mesh.columns - 1;
  const double factor = other.cloth.mesh.columns - 1 < cells ? 1.0 / 3 : 4.0 / 3;
  other.observations = own.problems.front()->observations;
  PooledPart part{.values = values_of(other, own.values().front()),
                  .frames = here.frames,
                  .linear = {},
                  .correction = {},
                  .directions = {},
                  .amplitudes = {}};
  part.steps = stable_time_steps(other.cloth, parameter_set(other, part.values))
                   .times(1 / PooledOptions().stability_margin);
  const TrajectoryObjective objective(other, part.frames, part.steps);
  part.linear.residual = objective.residuals({part.values}).front();
  part.linear.residual_by_coordinate = here.linear.residual_by_coordinate;
  part.linear.usable = part.linear.residual.size() == here.linear.residual.size();
  part.borrowed = true;
  if (!part.linear.usable) return std::nullopt;
  const FitProblem* problem = &other;
  const PooledFit fitted =
      fit_pooled({&problem, 1}, {part},
                 {.iterations = 12,
                  .rounds = 1,
                  .least_decrease = kUnrefinedDecrease * objective.residual_count(),
                  .kept_within = 0.02,
                  .updated_within = 0.1,
                  .unrefined = true},
                 {});
  if (!fitted.usable) return std::nullopt;
  return factor * fitted.parts.front().linear.residual;
}

/// Returns the model found in a candidate recording. It is not usable where it does not run.
/// `other` is the first recording on the other mesh, or null where that is not asked.
FittedModel in_candidate(const CandidateRecording& candidate, const FittedModel& model,
                         const FitProblem* other) {
  const PooledPart& found = model.parts.front();
  FittedModel result{.hypotheses = model.hypotheses, .problems = {}, .parts = {}};
  FitProblem problem = *model.problems.front();
  candidate.change(problem);
  if (!observe(problem, found.values, found.steps)) return result;
  PooledPart& at = result.parts.emplace_back();
  at.values = found.values;
  at.frames = problem.first_held_out;
  at.steps = found.steps;
  result.problems.push_back(std::make_shared<const FitProblem>(std::move(problem)));
  linearise_model(result);
  if (!result.usable()) return result;

  PooledPart& part = result.parts.front();
  const Eigen::VectorXd& residual = part.linear.residual;
  std::vector<Eigen::VectorXd> directions;
  // The step's direction is half of its expected error, where the model itself expects one.
  if (found.correction.size() > 0) {
    const TrajectoryObjective half(*result.problems.front(), part.frames, part.steps.times(0.5));
    const Eigen::VectorXd there = half.residuals({part.values}).front();
    if (there.size() == residual.size()) directions.emplace_back(there - residual);
  }
  if (other != nullptr) {
    FitProblem changed = *other;
    candidate.change(changed);
    if (auto direction = mesh_direction(std::move(changed), result))
      directions.push_back(std::move(*direction));
  }
  part.directions.resize(residual.size(), static_cast<Eigen::Index>(directions.size()));
  for (size_t k = 0; k < directions.size(); ++k)
    part.directions.col(static_cast<Eigen::Index>(k)) = directions[k];
  return result;
}

/// Returns the model where it stands on a mesh of half the cells a side. None where that is the
/// same mesh.
std::optional<FittedModel> on_coarse_mesh(const DiagnosisSetup& setup, const FittedModel& model) {
  DiagnosisSetup coarse = with_coarse_mesh(setup);
  coarse.inputs = setup.inputs.first(1);
  if (coarse.columns == setup.columns && coarse.rows == setup.rows) return std::nullopt;
  return model_at(coarse, model.hypotheses, {model.values().front()});
}

/// Returns the first recording on the mesh that the model's directions are taken from. There is
/// none where it has no direction of a mesh.
std::optional<FitProblem> on_other_mesh(const DiagnosisSetup& setup, const FittedModel& model) {
  const PooledPart& first = model.parts.front();
  const Eigen::Index of_step = first.correction.size() > 0 ? 1 : 0;
  if (first.directions.cols() <= of_step) return std::nullopt;
  DiagnosisSetup other = with_other_mesh(setup);
  other.inputs = setup.inputs.first(1);
  return *problems_of(other, model.hypotheses).front();
}

/// A candidate, and how far the hypotheses of each pair are apart in it. There are no distances
/// where it does not run.
struct Recorded {
  const CandidateRecording* candidate = nullptr;
  std::vector<Distance> distances;
};

/// Returns the candidates that tell a pair apart best, at most kKept. Only the best of each kind is
/// among them, so that who cannot do one thing is told of another.
std::vector<const Recorded*> best_of(const std::vector<Recorded>& all, size_t pair) {
  std::vector<const Recorded*> sorted, best;
  for (const Recorded& one : all)
    if (!one.distances.empty() && std::isfinite(one.distances[pair].sigmas)) sorted.push_back(&one);
  std::ranges::stable_sort(sorted, std::greater<>(),
                           [&](const Recorded* one) { return one->distances[pair].sigmas; });
  for (const Recorded* one : sorted) {
    const bool known = std::ranges::any_of(best, [&](const Recorded* better) {
      return better->candidate->kind == one->candidate->kind;
    });
    if (!known && best.size() < kKept) best.push_back(one);
  }
  return best;
}

/// Returns the pairs of an accepted effect and a hypothesis that is alike and not in the model.
std::vector<Pair> pairs_of(const FittedModel& model, const std::vector<AcceptedEffect>& accepted) {
  std::vector<Pair> pairs;
  for (size_t k = 0; k < accepted.size(); ++k)
    for (const Hypothesis& other : accepted[k].alike)
      if (std::ranges::none_of(model.hypotheses,
                               [&](const Hypothesis& own) { return own.same_mode(other); }))
        pairs.push_back({.accepted = k,
                         .hypothesis = accepted[k].trial.hypothesis,
                         .other = other,
                         .refits = refits_of(other)});
  return pairs;
}

/// Measures how far the hypotheses of each pair are apart in each candidate.
void record(const FittedModel& model, const FitProblem* other, const std::vector<Pair>& pairs,
            const ProgressCallback& progress, std::vector<Recorded>& recorded) {
  std::atomic<size_t> begun = 0;
  for_each_index(recorded.size(), [&](size_t n) {
    report_progress(progress, {.stage = "recordings that would tell modes apart",
                               .done = static_cast<double>(begun++),
                               .total = static_cast<double>(recorded.size()),
                               .unit = "recordings",
                               .note = ""});
    const FittedModel there = in_candidate(*recorded[n].candidate, model, other);
    recorded[n].distances = there.usable()
                                ? distances(there, narrowed(pairs, recorded[n].distances))
                                : std::vector<Distance>{};
  });
}

/// Returns the best candidates of each pair.
std::vector<Recorded> chosen_of(const std::vector<Recorded>& recorded, size_t pairs) {
  std::set<const Recorded*> best;
  for (size_t k = 0; k < pairs; ++k)
    for (const Recorded* one : best_of(recorded, k)) best.insert(one);
  std::vector<Recorded> chosen;
  for (const Recorded& one : recorded)
    if (best.contains(&one)) chosen.push_back(one);
  return chosen;
}

}  // namespace

double hypothesis_distance(const FittedModel& model, const Hypothesis& hypothesis,
                           const Hypothesis& other) {
  return distances(model, {{.hypothesis = hypothesis, .other = other, .refits = refits_of(other)}})
      .front()
      .sigmas;
}

std::vector<std::vector<Separation>> separating_recordings(
    const DiagnosisSetup& setup, const FittedModel& model,
    const std::vector<AcceptedEffect>& accepted, const ProgressCallback& progress) {
  const std::vector<Pair> pairs = pairs_of(model, accepted);
  if (pairs.empty()) return {};
  // A coarser mesh chooses which refits and recordings are looked at, for a sixteenth of the work.
  std::optional<FittedModel> coarse = on_coarse_mesh(setup, model);
  if (coarse) linearise_model(*coarse);
  if (coarse && !coarse->usable()) coarse.reset();
  FittedModel present = model;
  linearise_model(present);
  if (!present.usable()) return {};
  const std::vector<Distance> now =
      distances(present, coarse ? narrowed(pairs, distances(*coarse, pairs)) : pairs);

  const std::vector<CandidateRecording> candidates = candidate_recordings(*model.problems.front());
  std::vector<Recorded> recorded;
  for (const CandidateRecording& candidate : candidates)
    recorded.push_back({.candidate = &candidate, .distances = {}});
  const ProgressCallback reported = stop_token(progress);
  // Candidates are chosen before anything is fitted on another mesh.
  const std::optional<FitProblem> other = on_other_mesh(setup, model);
  if (coarse || other) {
    record(coarse ? *coarse : model, nullptr, pairs, reported, recorded);
    recorded = chosen_of(recorded, pairs.size());
  }
  record(model, other ? &*other : nullptr, pairs, reported, recorded);

  std::vector<std::vector<Separation>> result(accepted.size());
  for (size_t k = 0; k < pairs.size(); ++k) {
    if (!std::isfinite(now[k].sigmas)) continue;
    Separation& separation = result[pairs[k].accepted].emplace_back(
        Separation{.from = pairs[k].other, .now = now[k].sigmas, .recordings = {}});
    for (const Recorded* best : best_of(recorded, k))
      separation.recordings.push_back(
          {.what = best->candidate->what, .sigmas = best->distances[k].sigmas});
  }
  return result;
}

}  // namespace clothfit
