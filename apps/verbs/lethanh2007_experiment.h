#pragma once

#include "apps/verbs/verb.h"

namespace clothfit {

/// Adds `experiment lethanh2007`.
void add_lethanh2007_experiment(Verb experiment);

}  // namespace clothfit
