#pragma once

#include <memory>
#include <span>
#include <string>

#include "model/cloth/cloth.h"
#include "model/cloth/effect.h"

namespace clothfit {

struct EffectEntry {
  const char* name;
  EffectDescription (*describe)();
  std::unique_ptr<Effect> (*make)();
};

/// Returns every motion effect the program knows, in alphabetical order.
std::span<const EffectEntry> effect_registry();

/// Returns their names, for a message.
std::string effect_names();

/// Returns the entry called `name`. Throws InputError at `where` that lists the known names.
const EffectEntry& find_effect(const std::string& name, const std::string& where);

/// Adds the effect called `name` to a cloth. Throws InputError at `where` for an unknown name and
/// lists the known ones. Throws it also for contact_mesh on a cloth whose `obstacle` is not set
/// yet, which would silently touch nothing.
void add_effect(Cloth& cloth, const std::string& name, const std::string& where);

}  // namespace clothfit
