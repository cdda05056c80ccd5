#pragma once

#include "apps/terminal/command_line.h"

namespace clothfit {

/// Adds `clothfit study vision` to the verb `study`.
void add_vision_study(Verb study);

}  // namespace clothfit
