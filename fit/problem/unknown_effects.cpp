#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "data/input_error.h"
#include "fit/measurement_effects/applicability.h"
#include "fit/measurement_effects/registry.h"
#include "fit/problem/cloth_setup.h"
#include "fit/problem/effects_of.h"
#include "fit/problem/unknown_group.h"
#include "model/effects/registry.h"

/// Parameters of effects, of motion and of the measurement. The latter change what is seen
/// (fit/problem/predictor.h) and not how the model moves.
namespace clothfit {
namespace {

/// Messages name this place for an effect that no recording declares.
const std::string kAskedFor = "FitOptions::effects";

/// Adds an effect of the measurement. Its parameters are bound to `given` values, else to the fit.
void add_measurement_effect(const MeasurementEffectEntry& entry, const std::string& where,
                            const std::map<std::string, std::vector<double>>& given,
                            const FitOptions& options, FitProblem& problem) {
  FitProblem::MeasurementTerm term{
      .effect = entry.make(), .description = entry.describe(), .parameters = {}};
  if (const auto why = why_inapplicable(*term.effect, measurement_setting(problem)))
    throw InputError(where, term.description.name + ", and " + why->problem, why->expected);
  const std::map<std::string, double> values = by_parameter(term.description, where, given);
  for (const EffectParameter& parameter : term.description.parameters) {
    const auto value = values.find(parameter.name);
    if (value != values.end() || options.forecast) {
      // The measurement of another recording says nothing of this one.
      const double known = value != values.end() ? value->second : parameter.neutral;
      term.parameters.push_back({.parameter = -1, .constant = known});
      continue;
    }
    term.parameters.push_back({.parameter = problem.space.size(), .constant = 0});
    problem.space.parameters.push_back({.name = term.description.name + "." + parameter.name,
                                        .unit = parameter.unit,
                                        .role = ParameterRole::measurement,
                                        .scale = parameter.scale,
                                        .lower = parameter.lower,
                                        .upper = parameter.upper,
                                        .start = parameter.neutral,
                                        .typical = parameter.typical});
  }
  problem.measurement.push_back(std::move(term));
  const auto fitted =
      std::ranges::count(problem.space.parameters, ParameterRole::measurement, &FitParameter::role);
  if (fitted > kMeasurementParameters)
    throw InputError(where, fmt::format("{} parameters of the measurement would be fitted", fitted),
                     fmt::format("{} at most at once", kMeasurementParameters),
                     "declare values of some, or leave effects out");
}

/// Adds an effect to the cloth. Its parameters are bound to `given` values, else to the fit.
void add_effect(const std::string& name, const std::string& where,
                const std::map<std::string, std::vector<double>>& given, const FitOptions& options,
                FitProblem& problem) {
  require_effect(name, where);
  if (const MeasurementEffectEntry* entry = measurement_effect_named(name)) {
    if (options.forecast && where == kAskedFor)
      throw InputError(kAskedFor + (" = " + name), "asked for in a forecast, which fits nothing",
                       "a value that the recording declares", "leave it out");
    return add_measurement_effect(*entry, where, given, options, problem);
  }
  add_effect(problem.cloth, name, where);
  const EffectDescription& description = problem.cloth.effect_descriptions.back();
  const std::map<std::string, double> values = by_parameter(description, where, given);
  std::vector<Binding> bindings;
  for (const EffectParameter& parameter : description.parameters) {
    Binding binding;
    const auto value = values.find(parameter.name);
    if (value != values.end()) {
      binding.constant = value->second;
    } else if (parameter.picks) {
      binding.constant = parameter.neutral;
    } else if (options.forecast) {
      throw InputError(
          "FitOptions::forecast", "the fit holds no value for " + name + "." + parameter.name,
          "a forecast fits nothing", "fit with FitOptions::effects = " + name + " first");
    } else {
      binding.parameter = problem.space.size();
      problem.space.parameters.push_back({.name = name + "." + parameter.name,
                                          .unit = parameter.unit,
                                          .role = ParameterRole::effect,
                                          .scale = parameter.scale,
                                          .lower = parameter.lower,
                                          .upper = parameter.upper,
                                          .start = parameter.neutral + parameter.typical,
                                          .typical = parameter.typical});
    }
    bindings.push_back(binding);
  }
  problem.effects.push_back(std::move(bindings));
}

class EffectUnknowns final : public UnknownGroup {
 public:
  void declare(const ProblemSource& source, FitProblem& problem) const override {
    const Recording& recording = source.input.recording;
    const FitOptions& options = source.options;
    std::vector<std::string> present;
    const auto absent = [&](const std::string& name) {
      return std::ranges::find(present, name) == present.end();
    };
    if (options.forecast) {
      for (const EffectEstimate& effect : options.forecast->effects) {
        std::map<std::string, std::vector<double>> given;
        for (const ParameterEstimate& parameter : effect.parameters)
          given[parameter.name] = {parameter.value};
        add_effect(effect.name, "FitOptions::forecast", given, options, problem);
        present.push_back(effect.name);
      }
    }
    for (const DeclaredEffect& effect : effects_of(recording, options.hypotheses)) {
      if (!absent(effect.name)) continue;
      const std::string line = effect.line > 0 ? ":" + std::to_string(effect.line) : "";
      add_effect(effect.name, recording_file(recording) + line, effect.parameters, options,
                 problem);
      present.push_back(effect.name);
    }
    for (const std::string& name : options.effects) {
      if (!absent(name)) continue;
      add_effect(name, kAskedFor, {}, options, problem);
      present.push_back(name);
    }
    add_derivative_weights(problem);
  }

  void apply(const FitProblem& problem, const Eigen::VectorXd& values,
             ParameterSet& set) const override {
    for (const std::vector<Binding>& effect : problem.effects) {
      std::vector<double> numbers;
      for (const Binding& binding : effect) numbers.push_back(binding.value(values));
      set.effects.push_back(std::move(numbers));
    }
  }

  void differentiate(const FitProblem& problem, const Eigen::VectorXd&,
                     const Eigen::VectorXd& slope, std::vector<Direction>& along) const override {
    for (size_t e = 0; e < problem.effects.size(); ++e)
      for (size_t k = 0; k < problem.effects[e].size(); ++k)
        if (const Binding& binding = problem.effects[e][k]; binding.parameter >= 0)
          along[static_cast<size_t>(binding.parameter)].effects[e][k] = slope[binding.parameter];
    for (const FitProblem::EmergingTerm& term : problem.emerging)
      along[static_cast<size_t>(term.parameter)].emerging =
          EmergingEffect{.effect = term.effect,
                         .parameters = term.values,
                         .change = term.change / slope[term.parameter],
                         .start_memory = {}};
  }
};

}  // namespace

const UnknownGroup& effect_unknowns() {
  static const EffectUnknowns group;
  return group;
}

}  // namespace clothfit
