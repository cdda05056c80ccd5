#include "fit/measurement_effects/registry.h"

#include <algorithm>
#include <array>

#include "data/input_error.h"
#include "model/effects/registry.h"

namespace clothfit {

#define MEASUREMENT_EFFECT(name)             \
  namespace name {                           \
  EffectDescription describe();              \
  std::unique_ptr<MeasurementEffect> make(); \
  }
#include "fit/measurement_effects/table.inc"
#undef MEASUREMENT_EFFECT

namespace {

constexpr std::array kEffects = {
#define MEASUREMENT_EFFECT(name) MeasurementEffectEntry{#name, name::describe, name::make},
#include "fit/measurement_effects/table.inc"
#undef MEASUREMENT_EFFECT
};

}  // namespace

std::span<const MeasurementEffectEntry> measurement_effect_registry() {
  return kEffects;
}

const MeasurementEffectEntry* measurement_effect_named(const std::string& name) {
  const auto found = std::ranges::find_if(
      kEffects, [&](const MeasurementEffectEntry& entry) { return name == entry.name; });
  return found != kEffects.end() ? &*found : nullptr;
}

void require_effect(const std::string& name, const std::string& where) {
  const auto has_name = [&](const auto& entry) { return name == entry.name; };
  if (std::ranges::any_of(effect_registry(), has_name) || measurement_effect_named(name)) return;
  std::string names;
  for (const MeasurementEffectEntry& entry : kEffects)
    names += (names.empty() ? "" : ", ") + std::string(entry.name);
  throw InputError(where, "there is no effect '" + name + "'",
                   "known effects: " + effect_names() + "; of the measurement: " + names);
}

}  // namespace clothfit
