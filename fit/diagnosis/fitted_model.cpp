#include "fit/diagnosis/fitted_model.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "fit/cost/huber.h"
#include "fit/diagnosis/criteria.h"
#include "fit/identify.h"
#include "fit/measurement_effects/measurement_effect.h"
#include "fit/measurement_effects/registry.h"
#include "fit/problem/effects_of.h"
#include "fit/problem/mesh_ladder.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/prior_cost.h"
#include "model/cloth/stability.h"

namespace clothfit {
namespace {

constexpr int kFewestFrames = 8;

/// Derivatives are kept, or updated, as long as they predict the residuals' change this well.
constexpr double kKeptWithin = 0.02;
constexpr double kUpdatedWithin = 0.15;

void set_neutral(const EffectDescription& effect, const std::vector<Binding>& bindings,
                 Eigen::VectorXd& values) {
  for (size_t k = 0; k < bindings.size(); ++k)
    if (bindings[k].parameter >= 0) values[bindings[k].parameter] = effect.parameters[k].neutral;
}

/// Tells whether a parameter's name is that of an effect of the measurement.
bool is_of_measurement(const std::string& name) {
  const size_t dot = name.find('.');
  return dot != std::string::npos && measurement_effect_named(name.substr(0, dot)) != nullptr;
}

}  // namespace

Eigen::VectorXd values_of(const FitProblem& problem, const NamedValues& known) {
  Eigen::VectorXd values = problem.space.start();
  for (size_t e = 0; e < problem.effects.size(); ++e)
    set_neutral(problem.cloth.effect_descriptions[e], problem.effects[e], values);
  for (const FitProblem::MeasurementTerm& term : problem.measurement)
    set_neutral(term.description, term.parameters, values);
  for (int p = 0; p < problem.space.size(); ++p) {
    const FitParameter& parameter = problem.space.parameters[static_cast<size_t>(p)];
    const auto found = known.find(parameter.name);
    if (found != known.end())
      values[p] = std::clamp(found->second, parameter.lower, parameter.upper);
  }
  return values;
}

std::vector<const FitProblem*> FittedModel::problem_pointers() const {
  std::vector<const FitProblem*> pointers;
  for (const auto& problem : problems) pointers.push_back(problem.get());
  return pointers;
}

TrajectoryObjective FittedModel::objective(size_t recording) const {
  return {*problems[recording], parts[recording].frames, parts[recording].steps};
}

std::vector<NamedValues> FittedModel::values() const {
  std::vector<NamedValues> named(problems.size());
  for (size_t n = 0; n < problems.size(); ++n) {
    const ParameterSpace& space = problems[n]->space;
    for (int p = 0; p < space.size(); ++p)
      named[n][space.parameters[static_cast<size_t>(p)].name] = parts[n].values[p];
  }
  return named;
}

ModelFit FittedModel::fit() const {
  ModelFit plain{.hypotheses = hypotheses, .recordings = {}};
  const std::vector<NamedValues> named = values();
  for (size_t n = 0; n < parts.size(); ++n)
    plain.recordings.push_back(
        {.values = named[n], .frames = parts[n].frames, .steps = parts[n].steps});
  return plain;
}

Eigen::Index FittedModel::residual_count() const {
  Eigen::Index count = 0;
  for (const PooledPart& part : parts) count += part.linear.residual.size();
  return count;
}

Eigen::VectorXd FittedModel::residual() const {
  Eigen::VectorXd all(residual_count());
  Eigen::Index first = 0;
  for (const PooledPart& part : parts) {
    all.segment(first, part.linear.residual.size()) = residual_of(part);
    first += part.linear.residual.size();
  }
  return all;
}

double FittedModel::misfit() const {
  return residual().squaredNorm() / static_cast<double>(residual_count());
}

double grossly_misfitting(bool starts_in_motion) {
  return starts_in_motion ? kCriteria.grossly_misfitting_in_motion : kCriteria.grossly_misfitting;
}

bool FittedModel::misfits_grossly() const {
  const bool starts_in_motion = std::ranges::any_of(
      problems, [](const auto& problem) { return problem->start == StartKind::unknown; });
  return residual().squaredNorm() >
         grossly_misfitting(starts_in_motion) * static_cast<double>(residual_count());
}

double FittedModel::chi_square(double threshold) const {
  double sum = 0;
  for (size_t n = 0; n < parts.size(); ++n) {
    const Eigen::VectorXd residual = residual_of(parts[n]);
    sum += parts[n].amplitudes.squaredNorm() + 2 * prior_cost(*problems[n], parts[n].values).cost;
    const TrajectoryObjective of = objective(n);
    for (const Objective::Block& block : of.blocks()) {
      const double length = residual.segment(block.offset, block.dimension).norm();
      sum += huber_square(length, threshold);
    }
  }
  return sum;
}

FitOptions options_with(const DiagnosisSetup& setup, const std::vector<Hypothesis>& hypotheses,
                        size_t recording) {
  FitOptions options = setup.options;
  options.hypotheses = hypotheses;
  std::set<std::string> fitted;
  for (const Hypothesis& hypothesis : hypotheses) {
    if (!hypothesis.fits_shape) continue;
    for (const auto& [parameter, value] : hypothesis.shape) {
      const std::string name = hypothesis.effect + "." + parameter;
      if (fitted.insert(name).second)
        options.priors.push_back(
            {.name = name, .mean = value, .sigma = hypothesis.shape_sigma.at(parameter)});
    }
  }
  if (recording > 0)
    std::erase_if(options.priors,
                  [](const ParameterPrior& prior) { return !is_of_measurement(prior.name); });
  return options;
}

FitOptions options_on_mesh(const DiagnosisSetup& setup, const std::vector<Hypothesis>& hypotheses,
                           size_t recording) {
  FitOptions options = options_with(setup, hypotheses, recording);
  options.mesh_columns = setup.columns;
  options.mesh_rows = setup.rows;
  return options;
}

std::vector<std::shared_ptr<const FitProblem>> problems_of(
    const DiagnosisSetup& setup, const std::vector<Hypothesis>& hypotheses) {
  std::vector<std::shared_ptr<const FitProblem>> problems;
  for (size_t n = 0; n < setup.inputs.size(); ++n)
    problems.push_back(std::make_shared<const FitProblem>(make_problem(
        setup.inputs[n], options_with(setup, hypotheses, n), setup.columns, setup.rows)));
  return problems;
}

FittedModel model_at(const DiagnosisSetup& setup, const std::vector<Hypothesis>& hypotheses,
                     const std::vector<NamedValues>& values) {
  FittedModel model{
      .hypotheses = hypotheses, .problems = problems_of(setup, hypotheses), .parts = {}};
  for (size_t n = 0; n < model.problems.size(); ++n) {
    NamedValues known = values[n];
    for (const Hypothesis& hypothesis : hypotheses)
      for (const auto& [parameter, value] : hypothesis.shape)
        known.try_emplace(hypothesis.effect + "." + parameter, value);
    const FitProblem& problem = *model.problems[n];
    PooledPart& part = model.parts.emplace_back();
    part.values = values_of(problem, known);
    part.frames = problem.first_held_out;
    part.steps = stable_time_steps(problem.cloth, parameter_set(problem, part.values))
                     .times(1 / PooledOptions().stability_margin);
  }
  return model;
}

FittedModel restored(const DiagnosisSetup& setup, const ModelFit& fit) {
  std::vector<NamedValues> values;
  for (const ModelFit::OfRecording& recording : fit.recordings) values.push_back(recording.values);
  FittedModel model = model_at(setup, fit.hypotheses, values);
  for (size_t n = 0; n < model.parts.size(); ++n) {
    model.parts[n].frames = fit.recordings[n].frames;
    model.parts[n].steps = fit.recordings[n].steps;
  }
  return model;
}

void set_amplitudes(const Hypothesis& hypothesis, const Eigen::VectorXd& beyond_neutral,
                    std::vector<NamedValues>& values) {
  const EffectDescription effect = describe_effect(hypothesis.effect);
  const size_t each = hypothesis.amplitudes.size();
  for (size_t n = 0; n < values.size(); ++n)
    for (size_t k = 0; k < each; ++k) {
      const std::string& name = hypothesis.amplitudes[k];
      const auto own = static_cast<size_t>(beyond_neutral.size()) > each ? n * each + k : k;
      values[n][hypothesis.effect + "." + name] =
          std::ranges::find(effect.parameters, name, &EffectParameter::name)->neutral +
          beyond_neutral[static_cast<Eigen::Index>(own)];
    }
}

int frames_of_share(const FitProblem& problem, double share) {
  const int all = problem.first_held_out;
  return std::clamp(static_cast<int>(std::lround(share * all)), std::min(kFewestFrames, all), all);
}

FittedModel shortened(const FittedModel& model, double share) {
  FittedModel result = model;
  for (size_t n = 0; n < model.parts.size(); ++n) {
    const PooledPart& whole = model.parts[n];
    PooledPart& part = result.parts[n];
    part.frames = std::min(whole.frames, frames_of_share(*model.problems[n], share));
    const TrajectoryObjective objective = model.objective(n);
    std::vector<int> rows;
    for (const Objective::Block& block : objective.blocks())
      if (block.frame < part.frames)
        for (int c = 0; c < block.dimension; ++c) rows.push_back(block.offset + c);
    if (whole.correction.size() > 0) part.correction = whole.correction(rows);
    if (whole.directions.cols() > 0) part.directions = whole.directions(rows, Eigen::all);
    // Markers' constant offsets are those of the frames that are looked at.
    const bool same = model.problems[n]->marker_offset_sigma_m == 0 && whole.linear.usable;
    part.linear = {};
    if (!same) continue;
    part.linear.usable = true;
    part.linear.residual = whole.linear.residual(rows);
    part.linear.residual_by_coordinate = whole.linear.residual_by_coordinate(rows, Eigen::all);
  }
  return result;
}

void refine_model(FittedModel& model, const DiagnosisSetup& setup, const StageOptions& options,
                  const ProgressCallback& progress) {
  // A fit that cannot follow the cloth goes on and on, at ever shorter time steps. So its work is
  // bounded.
  double most_spring_steps = 0;
  for (const auto& problem : model.problems)
    most_spring_steps += final_refinement(*problem, setup.options).most_spring_steps;
  const PooledOptions pooled{
      .iterations = options.iterations,
      .linearisations = options.linearisations * static_cast<int>(model.problems.size()),
      .rounds = options.rounds,
      .least_decrease = options.least_decrease,
      .loss = setup.options.loss,
      .kept_within = kKeptWithin,
      .updated_within = kUpdatedWithin,
      .own_only = options.own_only,
      .unrefined = options.unrefined,
      .most_spring_steps = most_spring_steps};
  const std::vector<const FitProblem*> problems = model.problem_pointers();
  PooledFit fitted = fit_pooled(problems, model.parts, pooled, progress);
  model.state = !fitted.usable      ? FitState::failed
                : options.unrefined ? FitState::unrefined
                                    : FitState::complete;
  if (fitted.usable) model.parts = std::move(fitted.parts);
}

void linearise_model(FittedModel& model) {
  bool usable = true;
  for (size_t n = 0; n < model.parts.size(); ++n) {
    PooledPart& part = model.parts[n];
    part.linear = model.objective(n).linearise(part.values);
    usable = usable && part.linear.usable;
  }
  if (!usable)
    model.state = FitState::failed;
  else if (!model.is_unrefined())
    model.state = FitState::complete;
}

DiagnosisSetup with_coarse_mesh(const DiagnosisSetup& setup) {
  constexpr int kSmallest = 9;
  DiagnosisSetup coarse = setup;
  if (setup.options.spring_set != SpringSet::fabric) return coarse;
  const int smallest = std::max(kSmallest, vertices_for_start(setup.options.start_nodes));
  for (int* count : {&coarse.columns, &coarse.rows})
    *count = std::min(*count, std::max(smallest, (*count + 1) / 2));
  return coarse;
}

bool is_coarser(const DiagnosisSetup& mesh, const DiagnosisSetup& than) {
  return mesh.columns < than.columns || mesh.rows < than.rows;
}

FittedModel with_derivatives_of(const DiagnosisSetup& other_mesh, const FittedModel& model) {
  FittedModel result = model_at(other_mesh, model.hypotheses, model.values());
  for (size_t n = 0; n < result.parts.size(); ++n) {
    result.parts[n].frames = model.parts[n].frames;
    result.parts[n].correction = model.parts[n].correction;
    result.parts[n].directions = model.parts[n].directions;
    result.parts[n].amplitudes = model.parts[n].amplitudes;
  }
  linearise_model(result);
  for (size_t n = 0; result.usable() && n < result.parts.size(); ++n) {
    Eigen::VectorXd& residual = result.parts[n].linear.residual;
    if (residual.size() != model.parts[n].linear.residual.size()) result.state = FitState::failed;
    residual = model.parts[n].linear.residual;
  }
  return result;
}

FittedModel corrected_on_mesh(const DiagnosisSetup& other, const FittedModel& model) {
  if (!model.usable()) return {};
  FittedModel result = model_at(other, model.hypotheses, model.values());
  for (size_t n = 0; n < result.parts.size(); ++n) result.parts[n].frames = model.parts[n].frames;
  linearise_model(result);
  for (size_t n = 0; result.usable() && n < result.parts.size(); ++n) {
    PooledPart& part = result.parts[n];
    part.correction = residual_of(model.parts[n]) - part.linear.residual;
  }
  return result;
}

}  // namespace clothfit
