#include "fit/diagnosis/search_context.h"

#include <algorithm>
#include <limits>

#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/worth.h"
#include "fit/jobs/stop_token.h"

namespace clothfit {

SearchContext::SearchContext(const DiagnosisSetup& analysed, const SearchOptions& asked,
                             const ProgressCallback& reported)
    : setup(analysed),
      coarse(with_coarse_mesh(analysed)),
      options(asked),
      progress(stop_token(reported)),
      threshold(asked.threshold) {}

double SearchContext::left_by(const FittedModel& model) const {
  return model.usable() ? model.chi_square(threshold) : std::numeric_limits<double>::infinity();
}

double SearchContext::cost(const FittedModel& model) const {
  return model.chi_square(threshold) + price_of_amplitudes(model);
}

double SearchContext::worth(const FittedModel& model) const {
  return worth_naming(model, threshold, base_chi_square - model.chi_square(threshold));
}

bool SearchContext::is_far_off(const FittedModel& model) const {
  return left_by(model) > kCriteria.far_off * static_cast<double>(model.residual_count());
}

bool SearchContext::may_ask(const FittedModel& model, const Hypothesis& hypothesis) const {
  const auto has = [&](const std::string& effect) {
    return std::ranges::find(model.hypotheses, effect, &Hypothesis::effect) !=
               model.hypotheses.end() ||
           std::ranges::find(setup.options.effects, effect) != setup.options.effects.end() ||
           std::ranges::any_of(
               setup.inputs.front().recording.declared,
               [&](const DeclaredEffect& declared) { return declared.name == effect; });
  };
  const bool is_new = std::ranges::none_of(
      model.hypotheses, [&](const Hypothesis& own) { return own.same_mode(hypothesis); });
  return is_new && (hypothesis.beside.empty() || std::ranges::any_of(hypothesis.beside, has));
}

std::vector<ShapeCandidates> SearchContext::untested(const FittedModel& model) const {
  const NamedValues values = model.values().front();
  std::vector<ShapeCandidates> result;
  for (const ShapeCandidates& shapes : options.hypotheses)
    if (may_ask(model, shapes.front()))
      result.push_back(at_shapes_of(model.hypotheses, values, shapes));
  return result;
}

}  // namespace clothfit
