#include "fit/diagnosis/model_fit.h"

#include "fit/measurement_effects/measurement_effect.h"
#include "fit/parameterised_model.h"

namespace clothfit {
namespace {

/// A model that is wrong has a rough cost, on which a refinement could go on for long; what is
/// accepted is fitted once more, to the end.
constexpr RefineOptions kStage{
    .iterations = 12, .least_gain = 1e-4, .trust_region_radius = 1e4, .most_spring_steps = 1e10};

void set_neutral(const EffectDescription& effect, const std::vector<Binding>& bindings,
                 Eigen::VectorXd& values) {
  for (size_t k = 0; k < bindings.size(); ++k)
    if (bindings[k].parameter >= 0) values[bindings[k].parameter] = effect.parameters[k].neutral;
}

}  // namespace

Eigen::VectorXd values_of(const FitProblem& problem, const std::map<std::string, double>& known) {
  Eigen::VectorXd values = problem.space.start();
  for (size_t e = 0; e < problem.effects.size(); ++e)
    set_neutral(problem.cloth.effect_descriptions[e], problem.effects[e], values);
  for (const FitProblem::MeasurementTerm& term : problem.measurement)
    set_neutral(term.description, term.parameters, values);
  for (int p = 0; p < problem.space.size(); ++p) {
    const auto found = known.find(problem.space.parameters[static_cast<size_t>(p)].name);
    if (found != known.end()) values[p] = found->second;
  }
  return values;
}

std::map<std::string, double> values_by_name(const FitProblem& problem,
                                             const Eigen::VectorXd& values) {
  std::map<std::string, double> named;
  for (int p = 0; p < problem.space.size(); ++p)
    named[problem.space.parameters[static_cast<size_t>(p)].name] = values[p];
  return named;
}

FitOptions options_with(FitOptions options, const std::vector<Term>& terms) {
  for (const Term& term : terms)
    if (term.fits_shape)
      for (const auto& [parameter, value] : term.shape)
        options.priors.push_back({.name = term.effect + "." + parameter,
                                  .mean = value,
                                  .sigma = term.shape_sigma.at(parameter)});
  return options;
}

std::shared_ptr<const FitProblem> problem_of(const DiagnosisSetup& setup,
                                             const std::vector<Term>& terms) {
  return std::make_shared<const FitProblem>(make_problem(with_terms(setup.input, terms),
                                                         options_with(setup.options, terms),
                                                         setup.columns, setup.rows));
}

ModelFit model_at(std::shared_ptr<const FitProblem> problem, std::vector<Term> terms,
                  Eigen::VectorXd values, int frames, const TimeSteps& steps) {
  ModelFit model{.terms = std::move(terms),
                 .problem = std::move(problem),
                 .values = std::move(values),
                 .frames = frames,
                 .steps = steps,
                 .linear = {}};
  model.linear = model.objective().linearise(model.values);
  model.usable = model.linear.usable;
  return model;
}

ModelFit fit_model(const DiagnosisSetup& setup, const std::vector<Term>& terms,
                   const std::map<std::string, double>& start, const std::vector<int>& horizons,
                   const ProgressCallback& progress, int rounds) {
  ModelFit model{.terms = terms, .problem = problem_of(setup, terms), .values = {}, .linear = {}};
  std::map<std::string, double> known = start;
  for (const Term& term : terms)
    for (const auto& [parameter, value] : term.shape)
      known.try_emplace(term.effect + "." + parameter, value);
  model.values = values_of(*model.problem, known);
  RefineOptions options = kStage;
  options.rounds = rounds;
  options.loss = setup.options.loss;
  options.substep_scale = setup.options.substep_scale;
  options.most_spring_steps *= setup.options.work;
  for (const int frames : horizons) {
    const RefineResult refined = refine(*model.problem, frames, model.values, options, progress);
    model.cancelled = refined.cancelled;
    if (refined.cancelled || !refined.usable) return model;
    model.values = refined.values;
    model.frames = frames;
    model.steps = time_steps_of_run(
        model.problem->cloth, parameter_set(*model.problem, model.values), refined.time_step_s);
  }
  return model_at(model.problem, terms, model.values, model.frames, model.steps);
}

}  // namespace clothfit
