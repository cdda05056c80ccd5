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

/// Every effect of the measurement the program knows, in alphabetical order.
std::span<const MeasurementEffectEntry> measurement_effect_registry();

/// The entry called `name`; null where there is none.
const MeasurementEffectEntry* measurement_effect_named(const std::string& name);

/// Throws InputError at `where`, with the names that there are, where `name` is neither an effect
/// of motion (model/effects/registry.h) nor one of the measurement.
void require_effect(const std::string& name, const std::string& where);

}  // namespace clothfit
