#pragma once

#include <string>
#include <vector>

#include "apps/study/foreign/foreign_truth.h"
#include "fit/diagnosis/diagnose.h"

namespace clothfit {

/// An effect that a diagnosis accepted.
struct NamedEffect {
  std::string effect;
  std::string title;               ///< "nonuniform_mass (hem)"
  std::vector<std::string> alike;  ///< effects that the recording cannot tell from it
};

/// What is wrong with a diagnosis; one without any fault is right.
struct Judgement {
  std::vector<std::string> missed;     ///< hidden effects that no accepted one answers to
  std::vector<std::string> not_there;  ///< accepted effects that answer to no hidden one
  bool wrong_verdict = false;

  bool right() const { return missed.empty() && not_there.empty() && !wrong_verdict; }
};

/// Compares a diagnosis with the truth, by the kind of truth.
///
/// Hidden effects: each is accepted or alike to an accepted effect, and no accepted effect is left
/// over that answers to none of them. The verdict does not matter.
/// Nothing hidden: the verdict is `adequate` and nothing is accepted.
/// Foreign law: the verdict is not `adequate`, and nothing accepted lies outside the cloth.
Judgement judge(const ForeignTruth& truth, DiagnosisVerdict verdict,
                const std::vector<NamedEffect>& named);

}  // namespace clothfit
