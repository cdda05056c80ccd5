#include "fit/diagnosis/planting.h"

#include <algorithm>

#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/twin.h"
#include "fit/fit.h"
#include "fit/jobs/draws.h"
#include "fit/problem/effects_of.h"

namespace clothfit {
namespace {

PlantOutcome failed(PlantOutcome outcome, const std::string& why) {
  outcome.why_not = why;
  return outcome;
}

}  // namespace

bool PlantOutcome::named() const {
  return std::ranges::any_of(found, [&](const Hypothesis& hypothesis) {
    return hypothesis.effect == plant.hypothesis.effect;
  });
}

PlantOutcome search_twins(const DiagnosisSetup& setup, const FittedModel& model, const Plant& plant,
                          const SearchOptions& options, std::uint64_t seed,
                          const ProgressCallback& progress) {
  PlantOutcome outcome{.plant = plant, .found = {}, .why_not = {}};
  std::vector<Hypothesis> hypotheses = model.hypotheses;
  if (!plant.hypothesis.effect.empty()) hypotheses.push_back(plant.hypothesis);
  std::vector<NamedValues> values = model.values();
  std::vector<FitInput> twins;
  for (size_t n = 0; n < setup.inputs.size(); ++n) {
    NamedValues truth = values[n];
    if (!plant.hypothesis.effect.empty()) {
      const EffectDescription effect = describe_effect(plant.hypothesis.effect);
      for (const EffectParameter& parameter : effect.parameters)
        truth.try_emplace(effect.name + "." + parameter.name, parameter.neutral);
      truth[effect.name + "." + plant.parameter] += plant.beyond_neutral;
    }
    const FitReport report = report_at(setup.inputs[n], options_on_mesh(setup, hypotheses, n),
                                       {.values = truth, .sigma = {}});
    if (!report.usable()) return failed(std::move(outcome), report.message);
    twins.push_back(twin_of(setup.inputs[n], report, derived_seed(seed, static_cast<int>(n))));
  }
  DiagnosisSetup of_twins = setup;
  of_twins.inputs = twins;
  FittedModel base = model_at(of_twins, model.hypotheses, values);
  refine_model(base, of_twins, {}, progress);
  if (base.usable()) refine_with_discretisation(base, of_twins, progress);
  if (!base.usable()) return failed(std::move(outcome), "the model without it could not be fitted");
  SearchOptions one_more = options;
  one_more.most_effects = model.hypotheses.size() + 1;
  const SearchResult search = search_hypotheses(of_twins, std::move(base), one_more, progress);
  outcome.ran = true;
  if (!search.accepted.empty()) {
    outcome.found = search.accepted.front().alike;
    outcome.found.insert(outcome.found.begin(), search.accepted.front().trial.hypothesis);
  }
  return outcome;
}

}  // namespace clothfit
