#pragma once

#include <filesystem>

#include "apps/study/trials/identification_targets.h"
#include "apps/verbs/verb.h"

namespace clothfit {

struct IdentificationOptions {
  TargetsOptions targets;
  std::filesystem::path out;       ///< empty: identification.experiment
  std::filesystem::path journals;  ///< empty: beside the output folder, gone with success
  bool resume = false;
};

/// Measures the targets of identification, prints and writes their table. Returns an exit code;
/// throws InputError, Cancelled.
int run_identification(const IdentificationOptions& options);

/// Adds `clothfit experiment identification`.
void add_identification_experiment(Verb experiment);

}  // namespace clothfit
