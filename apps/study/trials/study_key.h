#pragma once

#include "apps/study/scene/synthetic_recording.h"
#include "fit/interface/fit_options.h"
#include "fit/jobs/journal_key.h"

namespace clothfit {

/// Adds all that determines a synthetic recording but its seed.
void add_fields(const SyntheticScene& scene, JournalKey& key);

/// Adds the options that trials set of their fits.
void add_fields(const FitOptions& fit, JournalKey& key);

}  // namespace clothfit
