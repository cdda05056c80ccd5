#include "apps/study/foreign/judgement.h"

#include <algorithm>

namespace clothfit {
namespace {

/// Says whether an accepted effect, or one of its class, is right about a hidden one.
bool answers(const NamedEffect& named, const HiddenTruth& hidden) {
  return hidden.is_answered_by(named.effect) ||
         std::ranges::any_of(
             named.alike, [&](const std::string& effect) { return hidden.is_answered_by(effect); });
}

}  // namespace

Judgement judge(const ForeignTruth& truth, DiagnosisVerdict verdict,
                const std::vector<NamedEffect>& named) {
  Judgement judgement;
  for (const HiddenTruth& hidden : truth.hidden)
    if (std::ranges::none_of(named, [&](const NamedEffect& one) { return answers(one, hidden); }))
      judgement.missed.push_back(hidden.title());
  const auto expected = [&](const NamedEffect& one) {
    if (truth.kind() == TruthKind::foreign_law) return is_inside_cloth(one.effect);
    return std::ranges::any_of(truth.hidden,
                               [&](const HiddenTruth& hidden) { return answers(one, hidden); });
  };
  for (const NamedEffect& one : named)
    if (!expected(one)) judgement.not_there.push_back(one.title);
  const bool adequate = verdict == DiagnosisVerdict::adequate;
  if (truth.kind() == TruthKind::nothing_hidden) judgement.wrong_verdict = !adequate;
  if (truth.kind() == TruthKind::foreign_law) judgement.wrong_verdict = adequate;
  return judgement;
}

}  // namespace clothfit
