#include "fit/diagnosis/planting.h"

#include <algorithm>

#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/twin.h"
#include "fit/fit.h"
#include "fit/jobs/draws.h"

namespace clothfit {
namespace {

PlantOutcome failed(PlantOutcome outcome, const std::string& why) {
  outcome.why_not = why;
  return outcome;
}

}  // namespace

bool PlantOutcome::named() const {
  return std::ranges::any_of(found,
                             [&](const Term& term) { return term.effect == plant.term.effect; });
}

PlantOutcome search_twins(const DiagnosisSetup& setup, const ModelFit& model, const Plant& plant,
                          const SearchOptions& options, std::uint64_t seed,
                          const ProgressCallback& progress) {
  PlantOutcome outcome{.plant = plant, .found = {}, .why_not = {}};
  std::vector<Term> terms = model.terms;
  if (!plant.term.effect.empty()) terms.push_back(plant.term);
  std::vector<NamedValues> values = model.values();
  std::vector<FitInput> twins;
  for (size_t n = 0; n < setup.inputs.size(); ++n) {
    NamedValues truth = values[n];
    if (!plant.term.effect.empty()) {
      const EffectDescription effect = describe_effect(plant.term.effect);
      for (const EffectParameter& parameter : effect.parameters)
        truth.try_emplace(effect.name + "." + parameter.name, parameter.neutral);
      truth[effect.name + "." + plant.parameter] += plant.beyond_neutral;
    }
    FitOptions at = options_with(setup, terms, n);
    at.mesh_columns = setup.columns;
    at.mesh_rows = setup.rows;
    const FitReport report =
        report_at(with_terms(setup.inputs[n], terms), at, {.values = truth, .sigma = {}});
    if (!report.usable()) return failed(std::move(outcome), report.message);
    twins.push_back(twin_of(setup.inputs[n], report, derived_seed(seed, static_cast<int>(n))));
  }
  DiagnosisSetup of_twins = setup;
  of_twins.inputs = twins;
  ModelFit base = model_at(of_twins, model.terms, values);
  refine_model(base, of_twins, {}, progress);
  if (base.usable) refine_with_discretisation(base, of_twins, progress);
  if (!base.usable) return failed(std::move(outcome), "the model without it could not be fitted");
  SearchOptions one_more = options;
  one_more.most_effects = model.terms.size() + 1;
  const LawSearch search = search_laws(of_twins, std::move(base), one_more, progress);
  if (search.cancelled) return failed(std::move(outcome), "cancelled");
  outcome.ran = true;
  if (!search.accepted.empty()) {
    outcome.found = search.accepted.front().alike;
    outcome.found.insert(outcome.found.begin(), search.accepted.front().trial.term);
  }
  return outcome;
}

}  // namespace clothfit
