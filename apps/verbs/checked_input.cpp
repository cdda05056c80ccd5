#include "apps/verbs/checked_input.h"

#include <fmt/format.h>

#include <utility>

#include "apps/steps/steps.h"
#include "apps/terminal/option_flags.h"
#include "fit/preflight/preflight.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

/// Names the file that the user has, FILE or FILE:LINE: a step copies files, and makes tracks of
/// its own.
std::string as_given(const std::string& where, const fs::path& step, const fs::path& given) {
  const fs::path relative = fs::path(where).lexically_relative(step);
  if (step == given || relative.empty() || *relative.begin() == "..") return where;
  std::string file = relative.string(), line;
  if (const size_t colon = file.find(':'); colon != std::string::npos) {
    line = file.substr(colon);
    file.resize(colon);
  }
  std::error_code error;
  if (!fs::exists(given / file, error)) return (given / "recording.yaml").string();
  return (given / file).string() + line;
}

}  // namespace

Findings findings_of(const FitInput& input, const Recording& given, ObservationKind kind) {
  Findings findings = check_recording(input, resolve_observations(input.recording, kind));
  for (Finding& finding : findings)
    if (!finding.where.empty())
      finding.where = as_given(finding.where, input.recording.folder, given.folder);
  return findings;
}

Finding finding_of(const InputError& error, const fs::path& step, const fs::path& given) {
  return {.check = "input",
          .state = FindingState::refused,
          .found = error.problem(),
          .where = as_given(error.where(), step, given),
          .expected = error.expected(),
          .remedy = error.remedy()};
}

CheckedInput check_input(const Recording& given, ObservationKind kind, const fs::path& steps,
                         const ProgressCallback& progress) {
  CheckedInput checked{.input = {}, .findings = check_declarations(given)};
  if (!with_state(checked.findings, FindingState::refused).empty()) return checked;
  CompletedRecording complete = complete_recording(given, kind, {}, steps, progress);
  checked.input = read_fit_input(complete.recording, kind);
  checked.findings = std::move(complete.footage);
  const Findings of_tracks = findings_of(checked.input, given, kind);
  checked.findings.insert(checked.findings.end(), of_tracks.begin(), of_tracks.end());
  return checked;
}

CheckedInput checked_input(const Recording& given, ObservationKind kind, const fs::path& steps,
                           const ProgressCallback& progress) {
  CheckedInput checked = check_input(given, kind, steps, progress);
  refuse_wrong(checked.findings);
  checked.findings = with_state(checked.findings, FindingState::warning);
  return checked;
}

std::string warnings_text(const Findings& warnings) {
  std::string text;
  for (const Finding& warning : warnings)
    text += fmt::format("Warning: {}\n", with_flags(sentence(warning)));
  return warnings.empty() ? text : text + "\n";
}

}  // namespace clothfit
