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

/// Every motion effect the program knows, in alphabetical order.
std::span<const EffectEntry> effect_registry();

/// Their names, for a message.
std::string effect_names();

/// The entry called `name`. Throws InputError at `where` that lists the known names.
const EffectEntry& find_effect(const std::string& name, const std::string& where);

/// Adds the effect called `name` to a cloth. Throws InputError at `where` for a name that is not
/// known (it lists those that are), and for contact_mesh on a cloth whose `obstacle` is not set
/// yet: it would touch nothing without a word.
void add_effect(Cloth& cloth, const std::string& name, const std::string& where);

}  // namespace clothfit
