#pragma once

#include "apps/verbs/verb.h"

namespace clothfit {

/// Adds `clothfit experiment identification`, which measures the targets of identification.
void add_identification_experiment(Verb experiment);

}  // namespace clothfit
