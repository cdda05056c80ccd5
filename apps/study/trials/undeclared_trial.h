#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "apps/study/scene/releases.h"
#include "fit/diagnosis/diagnose.h"

namespace clothfit {

/// How well an amplitude was found whose very law was accepted.
struct FoundAmplitude {
  std::string name;  ///< EFFECT.PARAMETER
  double truth = 0, estimate = 0, sigma = 0;
};

/// One law that a trial hid.
struct HiddenInTrial {
  HiddenLaw law;
  std::map<std::string, double> shape;
  double sigmas = 0;
  std::vector<std::string> right;  ///< effects that count as it
  bool named = false;              ///< by an accepted effect that counts as no other hidden one
  std::vector<FoundAmplitude> found;
  double amplitude_ratio = 0;  ///< found over true, along the true direction; NaN without `found`
};

struct UndeclaredTrial {
  /// Why there was no trial; empty: there was one. Such as a law that this kind of recording does
  /// not show within its bounds.
  std::string refused;
  std::vector<HiddenInTrial> hidden;
  double mimicked = 0;  ///< squared multiple correlation with all other effects; where withheld
  FitStop stop = FitStop::diverged;
  std::string message;
  DiagnosisVerdict verdict = DiagnosisVerdict::adequate;
  std::vector<std::string> accepted;  ///< laws' titles, in order
  std::vector<std::string> accepted_effects;
  /// rms over coordinates of held-out frames (m or px): of the model as declared, with what was
  /// accepted, and with the true laws declared; and the noise. NaN where there is none.
  double before = 0, after = 0, with_truth = 0, noise = 0;
  double with_law = 0;  ///< with the law that was proposed, where an effect was withheld
  double before_fitted = 0, after_fitted = 0;
  double drawing_seconds = 0, seconds = 0;  ///< the only numbers that differ from run to run

  bool usable() const {
    return refused.empty() && stop != FitStop::diverged && stop != FitStop::cancelled;
  }
  /// Whether the first effect accepted counts as a hidden one; of clean recordings, whether nothing
  /// was accepted.
  bool right_first() const;
  bool all_named() const;  ///< each hidden effect by one of its own
};

}  // namespace clothfit
