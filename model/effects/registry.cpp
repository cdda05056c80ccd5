#include "model/effects/registry.h"

#include <algorithm>
#include <array>

#include "data/input_error.h"

namespace clothfit {

#define EFFECT(name)              \
  namespace name {                \
  EffectDescription describe();   \
  std::unique_ptr<Effect> make(); \
  }
#include "model/effects/table.inc"
#undef EFFECT

namespace {

// The table is visible, because the linker drops self-registering statics from a static library.
constexpr std::array kEffects = {
#define EFFECT(name) EffectEntry{#name, name::describe, name::make},
#include "model/effects/table.inc"
#undef EFFECT
};

}  // namespace

std::span<const EffectEntry> effect_registry() {
  return kEffects;
}

std::string effect_names() {
  std::string names;
  for (const EffectEntry& entry : kEffects)
    names += (names.empty() ? "" : ", ") + std::string(entry.name);
  return names;
}

const EffectEntry& find_effect(const std::string& name, const std::string& where) {
  const auto found =
      std::ranges::find_if(kEffects, [&](const EffectEntry& entry) { return name == entry.name; });
  if (found != kEffects.end()) return *found;
  throw InputError(where, "there is no effect '" + name + "'", "known effects: " + effect_names());
}

void add_effect(Cloth& cloth, const std::string& name, const std::string& where) {
  const EffectEntry& entry = find_effect(name, where);
  if (name == "contact_mesh" && !cloth.obstacle)
    throw InputError(where, "effect 'contact_mesh' has no obstacle to touch",
                     "the key `obstacle: FILE.obj` beside the effects, a surface of triangles",
                     "add it; contact_plane and contact_sphere need none");
  cloth.effect_descriptions.push_back(entry.describe());
  cloth.effects.push_back(entry.make());
}

}  // namespace clothfit
