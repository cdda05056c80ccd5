#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "apps/study/scene/releases.h"
#include "apps/study/trials/undeclared_trial.h"
#include "fit/diagnosis/diagnose.h"
#include "fit/jobs/executor.h"

namespace clothfit {

/// Options of the study of undeclared effects. Recordings whose truth has an effect that they do
/// not declare are diagnosed, and the diagnosis is compared with the truth.
struct UndeclaredOptions {
  enum class Hide {
    one,      ///< a mode in each trial, in turn
    nothing,  ///< clean recordings: whatever is accepted is a false alarm
    pairs,    ///< that mode and another one, each seen beside the other
    withheld  ///< one, whose effect the diagnosis does not know and the others mimic badly
  };
  SyntheticScene scene;
  DiagnoseOptions diagnosis;
  Hide hide = Hide::one;
  std::vector<HiddenMode> modes;  ///< hidden in turn; the second of a pair is drawn from them
  int trials = 20;                ///< for each mode, or in all where nothing is hidden
  DrawOptions draw;
  /// The squared multiple correlation of a withheld mode with all others must be below this.
  double most_mimicked = 0.25;
  unsigned long long seed = 1;
  int threads = 0;

  int count() const;      ///< trials in all
  void validate() const;  ///< throws InputError
  /// Returns one line that names all that determines the trials, for their journal.
  std::string key() const;
};
std::string to_string(UndeclaredOptions::Hide hide);

/// Runs trial `index` of the study. Pure but for its seconds. All modes are hidden in the same
/// releases, one for each round of the modes: `releases` serves them all.
UndeclaredTrial undeclared_once(const UndeclaredOptions& options, int index, std::uint64_t seed,
                                Releases& releases);

struct UndeclaredResult {
  ExecuteStop stop = ExecuteStop::not_run;
  std::string message;
  std::vector<UndeclaredTrial> trials;
};

UndeclaredResult recover_undeclared(const UndeclaredOptions& options, Journal* journal,
                                    const ProgressCallback& progress);

}  // namespace clothfit
