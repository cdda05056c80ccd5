#include "fit/problem/effects_of.h"

#include <algorithm>
#include <iterator>

#include "fit/measurement_effects/registry.h"
#include "model/effects/registry.h"

namespace clothfit {

EffectDescription describe_effect(const std::string& name) {
  require_effect(name, name);
  if (const MeasurementEffectEntry* entry = measurement_effect_named(name))
    return entry->describe();
  return std::ranges::find_if(effect_registry(),
                              [&](const EffectEntry& entry) { return name == entry.name; })
      ->describe();
}

std::vector<DeclaredEffect> effects_of(const Recording& recording,
                                       const std::vector<Hypothesis>& hypotheses) {
  std::vector<DeclaredEffect> effects = recording.declared;
  for (const Hypothesis& hypothesis : hypotheses) {
    auto effect = std::ranges::find(effects, hypothesis.effect, &DeclaredEffect::name);
    if (effect == effects.end()) {
      DeclaredEffect neutral{.name = hypothesis.effect, .parameters = {}};
      for (const EffectParameter& parameter : describe_effect(hypothesis.effect).parameters)
        neutral.parameters[parameter.name] = {parameter.neutral};
      effects.push_back(std::move(neutral));
      effect = std::prev(effects.end());
    }
    for (const auto& [parameter, value] : hypothesis.shape) effect->parameters[parameter] = {value};
    for (const auto& [parameter, number] : hypothesis.picked)
      effect->parameters[parameter] = {static_cast<double>(number)};
  }
  // A parameter that any hypothesis fits has no given value.
  for (const Hypothesis& hypothesis : hypotheses) {
    DeclaredEffect& effect = *std::ranges::find(effects, hypothesis.effect, &DeclaredEffect::name);
    for (const std::string& amplitude : hypothesis.amplitudes) effect.parameters.erase(amplitude);
    if (!hypothesis.fits_shape) continue;
    for (const auto& [parameter, value] : hypothesis.shape) effect.parameters.erase(parameter);
  }
  return effects;
}

}  // namespace clothfit
