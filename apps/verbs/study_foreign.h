#pragma once

#include "apps/terminal/command_line.h"

namespace clothfit {

/// Adds `clothfit study foreign` to the verb `study`.
void add_foreign_study(Verb study);

}  // namespace clothfit
