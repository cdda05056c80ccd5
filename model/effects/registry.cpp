#include "model/effects/registry.h"

#include <algorithm>
#include <array>

#include "data/input_error.h"
#include "model/effects/added_air_mass.h"
#include "model/effects/contact_mesh.h"
#include "model/effects/contact_plane.h"
#include "model/effects/contact_sphere.h"
#include "model/effects/frame_acceleration.h"
#include "model/effects/gravity_scale.h"
#include "model/effects/gravity_tilt.h"
#include "model/effects/gust.h"
#include "model/effects/nonuniform_mass.h"
#include "model/effects/quadratic_drag.h"
#include "model/effects/self_contact.h"
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
    EffectEntry{"contact_mesh", contact_mesh::describe, contact_mesh::make},
    EffectEntry{"contact_plane", contact_plane::describe, contact_plane::make},
    EffectEntry{"contact_sphere", contact_sphere::describe, contact_sphere::make},
    EffectEntry{"frame_acceleration", frame_acceleration::describe, frame_acceleration::make},
    EffectEntry{"gravity_scale", gravity_scale::describe, gravity_scale::make},
    EffectEntry{"gravity_tilt", gravity_tilt::describe, gravity_tilt::make},
    EffectEntry{"gust", gust::describe, gust::make},
    EffectEntry{"nonuniform_mass", nonuniform_mass::describe, nonuniform_mass::make},
    EffectEntry{"quadratic_drag", quadratic_drag::describe, quadratic_drag::make},
    EffectEntry{"self_contact", self_contact::describe, self_contact::make},
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
