#pragma once

#include <memory>
#include <span>
#include <string>

#include "fit/measurement_effects/measurement_effect.h"
#include "model/cloth/effect.h"

namespace clothfit {

struct MeasurementEffectEntry {
  const char* name;
  EffectDescription (*describe)();
  std::unique_ptr<MeasurementEffect> (*make)();
};

/// Returns every effect of the measurement that the program knows, in alphabetical order.
std::span<const MeasurementEffectEntry> measurement_effect_registry();

/// Returns the entry called `name`; null where there is none.
const MeasurementEffectEntry* measurement_effect_named(const std::string& name);

/// Throws InputError at `where`, with the names that there are, for an unknown `name`. Known are
/// effects of motion (model/effects/registry.h) and of the measurement.
void require_effect(const std::string& name, const std::string& where);

}  // namespace clothfit
