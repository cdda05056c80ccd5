#include "apps/study/vision/fitted_pictures.h"

#include <algorithm>
#include <iterator>

#include "apps/steps/fit_step.h"
#include "apps/steps/steps.h"
#include "apps/study/vision/parameter_difference.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/interrupt.h"
#include "fit/diagnosis/diagnose.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

FitInput tracked_input(const Recording& recording, const fs::path& steps,
                       const ProgressCallback& progress) {
  constexpr auto kPixels = ObservationKind::tracks2d;
  return read_fit_input(complete_recording(recording, kPixels, {}, steps, progress).recording,
                        kPixels);
}

/// Returns the share of markers times frames that have a good row, over all cameras.
ChainNumber found_share_of(const FitInput& input) {
  double found = 0, possible = 0;
  for (const auto& [camera, tracks] : input.tracks2d) {
    if (tracks.empty()) continue;
    found += static_cast<double>(
        std::ranges::count_if(tracks, [](const auto& row) { return row.rejected.empty(); }));
    possible +=
        static_cast<double>(input.recording.markers.markers.size()) * (tracks.back().frame + 1);
  }
  return {.name = "found", .unit = "%", .value = 100 * found / possible};
}

void add_numbers(const FitResult& result, ChainResult& chain) {
  std::ranges::copy(fitted_parameters(result), std::back_inserter(chain.numbers));
  for (const ObservationErrors& errors : result.errors)
    if (errors.held_out.count > 0)
      chain.numbers.push_back(
          {.name = "held out, " + errors.kind, .unit = errors.unit, .value = errors.held_out.rms});
}

}  // namespace

ChainResult fit_pictures(const Recording& recording, const fs::path& steps,
                         const ProgressCallback& progress) {
  const FitInput input = tracked_input(recording, steps, progress);
  FitOptions options;
  options.observations = ObservationKind::tracks2d;
  options.is_cancelled = interrupted;
  const FitReport report = fit_and_judge(input, options, progress);
  if (report.stop == FitStop::cancelled || interrupted()) throw Cancelled();
  if (!report.usable()) throw NoResult("no fit: " + report.message);
  ChainResult chain;
  chain.numbers.push_back(found_share_of(input));
  add_numbers(report.result, chain);
  chain.verdict = to_string(report.result.verdict);
  return chain;
}

ChainResult diagnose_pictures(const Recording& recording, const fs::path& steps,
                              const ProgressCallback& progress) {
  const FitInput input = tracked_input(recording, steps, progress);
  DiagnoseOptions options;
  options.fit.observations = ObservationKind::tracks2d;
  options.fit.is_cancelled = interrupted;
  const Diagnosis diagnosis = diagnose(input, options, progress);
  if (diagnosis.stop == FitStop::cancelled || interrupted()) throw Cancelled();
  if (!diagnosis.usable()) throw NoResult("no diagnosis: " + diagnosis.message);
  ChainResult chain;
  chain.numbers.push_back(found_share_of(input));
  add_numbers(diagnosis.base().result, chain);
  chain.numbers.push_back({.name = "adequate",
                           .unit = "",
                           .value = diagnosis.verdict == DiagnosisVerdict::adequate ? 1.0 : 0.0});
  chain.verdict = to_string(diagnosis.verdict);
  return chain;
}

}  // namespace clothfit
