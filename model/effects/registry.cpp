#include "model/effects/registry.h"

#include <algorithm>
#include <array>

#include "data/input_error.h"
#include "model/effects/added_air_mass.h"
#include "model/effects/anisotropy.h"
#include "model/effects/bending_energy.h"
#include "model/effects/contact_plane.h"
#include "model/effects/contact_sphere.h"
#include "model/effects/frame_acceleration.h"
#include "model/effects/gravity_scale.h"
#include "model/effects/gravity_tilt.h"
#include "model/effects/gust.h"
#include "model/effects/hysteresis.h"
#include "model/effects/nonuniform_mass.h"
#include "model/effects/nonuniform_stiffness.h"
#include "model/effects/quadratic_drag.h"
#include "model/effects/relaxation.h"
#include "model/effects/rest_curvature.h"
#include "model/effects/spring_damping.h"
#include "model/effects/stiffening.h"
#include "model/effects/support_drift.h"
#include "model/effects/support_motion.h"
#include "model/effects/support_slip.h"
#include "model/effects/viscous_damping.h"
#include "model/effects/wind.h"

namespace clothfit {
namespace {

// A visible table: self-registering statics would be dropped by the linker from a static library.
constexpr std::array kEffects = {
    // alphabetical
    EffectEntry{"added_air_mass", added_air_mass::describe, added_air_mass::make},
    EffectEntry{"anisotropy", anisotropy::describe, anisotropy::make},
    EffectEntry{"bending_energy", bending_energy::describe, bending_energy::make},
    EffectEntry{"contact_plane", contact_plane::describe, contact_plane::make},
    EffectEntry{"contact_sphere", contact_sphere::describe, contact_sphere::make},
    EffectEntry{"frame_acceleration", frame_acceleration::describe, frame_acceleration::make},
    EffectEntry{"gravity_scale", gravity_scale::describe, gravity_scale::make},
    EffectEntry{"gravity_tilt", gravity_tilt::describe, gravity_tilt::make},
    EffectEntry{"gust", gust::describe, gust::make},
    EffectEntry{"hysteresis", hysteresis::describe, hysteresis::make},
    EffectEntry{"nonuniform_mass", nonuniform_mass::describe, nonuniform_mass::make},
    EffectEntry{"nonuniform_stiffness", nonuniform_stiffness::describe, nonuniform_stiffness::make},
    EffectEntry{"quadratic_drag", quadratic_drag::describe, quadratic_drag::make},
    EffectEntry{"relaxation", relaxation::describe, relaxation::make},
    EffectEntry{"rest_curvature", rest_curvature::describe, rest_curvature::make},
    EffectEntry{"spring_damping", spring_damping::describe, spring_damping::make},
    EffectEntry{"stiffening", stiffening::describe, stiffening::make},
    EffectEntry{"support_drift", support_drift::describe, support_drift::make},
    EffectEntry{"support_motion", support_motion::describe, support_motion::make},
    EffectEntry{"support_slip", support_slip::describe, support_slip::make},
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
