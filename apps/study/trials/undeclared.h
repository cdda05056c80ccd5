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

/// Undeclared effects: recordings whose truth has an effect that they do not declare are diagnosed,
/// and what the diagnosis says is held against the truth.
struct UndeclaredOptions {
  enum class Hide {
    one,      ///< a law in each trial, in turn
    nothing,  ///< clean recordings: whatever is accepted is a false alarm
    pairs,    ///< that law and another one, each seen beside the other
    withheld  ///< one, whose effect the diagnosis does not know and the others mimic badly
  };
  SyntheticScene scene;
  DiagnoseOptions diagnosis;
  Hide hide = Hide::one;
  std::vector<HiddenLaw> laws;  ///< hidden in turn; of pairs the second is drawn from them
  int trials = 20;              ///< of each law, or in all where nothing is hidden
  DrawOptions draw;
  /// Squared multiple correlation of what is withheld with all that others can do, below.
  double most_mimicked = 0.25;
  unsigned long long seed = 1;
  int threads = 0;

  int count() const;      ///< of trials in all
  void validate() const;  ///< throws InputError
  /// One line that names all that determines the trials, for their journal.
  std::string key() const;
};
std::string to_string(UndeclaredOptions::Hide hide);

/// Trial `index` of the study. Pure but for its seconds. All laws are hidden in the same releases,
/// one for each round of the laws: what `releases` knows of one serves them all.
UndeclaredTrial undeclared_once(const UndeclaredOptions& options, int index, std::uint64_t seed,
                                Releases& releases);

struct UndeclaredResult {
  ExecuteStop stop = ExecuteStop::finished;
  std::string message;
  std::vector<UndeclaredTrial> trials;
};

UndeclaredResult recover_undeclared(const UndeclaredOptions& options, Journal* journal,
                                    const ProgressCallback& progress);

}  // namespace clothfit
