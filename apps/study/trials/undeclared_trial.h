#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "apps/study/scene/releases.h"
#include "fit/diagnosis/diagnose.h"

namespace clothfit {

/// The error of an amplitude whose own mode was accepted.
struct FoundAmplitude {
  std::string name;  ///< EFFECT.PARAMETER
  double truth = 0, estimate = 0, sigma = 0;
};

/// One mode that a trial hid.
struct HiddenInTrial {
  HiddenMode mode;
  std::map<std::string, double> shape;
  double sigmas = 0;
  std::vector<std::string> right;  ///< effects that count as it
  bool named = false;              ///< by an accepted effect that counts as no other hidden one
  std::vector<FoundAmplitude> found;
  double amplitude_ratio = 0;  ///< found over true, along the true direction; NaN without `found`
};

struct UndeclaredTrial {
  /// The reason why there was no trial; empty: there was one. An example is a mode that this kind
  /// of recording does not show within its bounds.
  std::string refused;
  std::vector<HiddenInTrial> hidden;
  double mimicked = 0;  ///< squared multiple correlation with all other effects; where withheld
  FitStop stop = FitStop::not_run;
  std::string message;
  DiagnosisVerdict verdict = DiagnosisVerdict::not_reached;
  std::vector<std::string> accepted;  ///< modes' titles, in order
  std::vector<std::string> accepted_effects;
  /// rms over coordinates of held-out frames (m or px), and the noise. The models are the declared
  /// one, that with the accepted effects, and that with the true modes declared. NaN where there is
  /// none.
  double before = 0, after = 0, with_truth = 0, noise = 0;
  double with_law = 0;  ///< with the proposed law, where an effect was withheld
  double before_fitted = 0, after_fitted = 0;
  double drawing_seconds = 0, seconds = 0;  ///< the only numbers that differ from run to run

  bool usable() const { return refused.empty() && is_usable(stop); }
  /// Says whether the first accepted effect counts as a hidden one. For clean recordings it says
  /// whether nothing was accepted.
  bool right_first() const;
  bool all_named() const;  ///< each hidden effect by one of its own
};

}  // namespace clothfit
