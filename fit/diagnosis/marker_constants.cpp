#include "fit/diagnosis/marker_constants.h"

#include <algorithm>

#include "fit/diagnosis/adequacy.h"
#include "fit/diagnosis/base_fit.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/cross_validation.h"
#include "fit/diagnosis/discretisation.h"

namespace clothfit {
namespace {

CrossValidation blocks_left_out(const Analysis& analysis) {
  return cross_validate(analysis.setup, analysis.found.model,
                        static_cast<int>(kCriteria.time_blocks), analysis.search.threshold);
}

/// Takes the model that `from` has found for the base, and refines it under other options.
bool continue_from(const Analysis& from, Analysis& analysis, const ProgressCallback& progress) {
  analysis.setup.columns = from.setup.columns;
  analysis.setup.rows = from.setup.rows;
  analysis.base = restored(analysis.setup, from.found.model.fit());
  linearise_model(analysis.base);
  refine_with_discretisation(analysis.base, analysis.setup, progress);
  return analysis.base.usable();
}

bool begin(Analysis& analysis, const Analysis& declared, const ProgressCallback& progress) {
  if (!declared.found.accepted.empty() || declared.found.changed_basin)
    return continue_from(declared, analysis, progress);
  try {
    fit_base(analysis, progress);
  } catch (const GivenUp&) {
    return false;
  }
  return true;
}

}  // namespace

std::optional<SeenElsewhere> constants_to_try(const Analysis& analysis, RecordingReports& reports) {
  const FittedModel& model = analysis.found.model;
  const bool in_space = std::ranges::all_of(model.problems, [](const auto& problem) {
    return problem->observations.front().dimension == 3;
  });
  if (!in_space || analysis.options.marker_offset_sigma_m > 0 ||
      judge_adequacy(model, analysis.options.loss).adequate)
    return std::nullopt;
  const CrossValidation left_out = blocks_left_out(analysis);
  if (!left_out.usable ||
      left_out.mean - left_out.constant_offset < kCriteria.good_part * (left_out.mean - 1))
    return std::nullopt;
  RecordingReports::Which report = &DiagnosedRecording::before;
  if (!model.hypotheses.empty()) {
    // The last model's report takes this one's place.
    report = &DiagnosedRecording::after;
    reports.add_fitted(analysis.setup, model, report);
  }
  return SeenElsewhere{.rms_m = reports.mean_residual_rms_m(report),
                       .cross_validated = left_out.constant_offset,
                       .without_it = left_out.mean};
}

bool search_beside_constants(Analysis& analysis, const Analysis& declared,
                             const SeenElsewhere& constants, const ProgressCallback& progress) {
  if (!begin(analysis, declared, progress)) return false;
  search_for_effects(analysis, progress, nullptr);
  const CrossValidation left_out = blocks_left_out(analysis);
  if (!left_out.usable ||
      constants.without_it - left_out.mean < kCriteria.good_part * (constants.without_it - 1))
    return false;
  std::vector<AcceptedEffect>& accepted = analysis.found.accepted;
  accepted.insert(accepted.begin(), declared.found.accepted.begin(), declared.found.accepted.end());
  return true;
}

}  // namespace clothfit
