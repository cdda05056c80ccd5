#include "model/effects/registry.h"

#include <algorithm>
#include <array>

#include "data/input_error.h"
#include "model/effects/anisotropy.h"
#include "model/effects/bending_energy.h"
#include "model/effects/hysteresis.h"
#include "model/effects/nonuniform_stiffness.h"
#include "model/effects/relaxation.h"
#include "model/effects/rest_curvature.h"
#include "model/effects/spring_damping.h"
#include "model/effects/stiffening.h"
#include "model/effects/viscous_damping.h"
#include "model/effects/wind.h"

namespace clothfit {
namespace {

// A visible table: self-registering statics would be dropped by the linker from a static library.
constexpr std::array kEffects = {
    // alphabetical
    EffectEntry{"anisotropy", anisotropy::describe, anisotropy::make},
    EffectEntry{"bending_energy", bending_energy::describe, bending_energy::make},
    EffectEntry{"hysteresis", hysteresis::describe, hysteresis::make},
    EffectEntry{"nonuniform_stiffness", nonuniform_stiffness::describe, nonuniform_stiffness::make},
    EffectEntry{"relaxation", relaxation::describe, relaxation::make},
    EffectEntry{"rest_curvature", rest_curvature::describe, rest_curvature::make},
    EffectEntry{"spring_damping", spring_damping::describe, spring_damping::make},
    EffectEntry{"stiffening", stiffening::describe, stiffening::make},
    EffectEntry{"viscous_damping", viscous_damping::describe, viscous_damping::make},
    EffectEntry{"wind", wind::describe, wind::make},
};

}  // namespace

std::span<const EffectEntry> effect_registry() {
  return kEffects;
}

const EffectEntry& find_effect(const std::string& name, const std::string& where) {
  const auto found =
      std::ranges::find_if(kEffects, [&](const EffectEntry& entry) { return name == entry.name; });
  if (found != kEffects.end()) return *found;
  std::string known;
  for (const EffectEntry& entry : kEffects)
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  throw InputError(where, "there is no effect '" + name + "'", "known effects: " + known);
}

}  // namespace clothfit
