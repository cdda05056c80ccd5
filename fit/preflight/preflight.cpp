#include "fit/preflight/preflight.h"

#include <fmt/format.h>

#include "data/input_error.h"
#include "fit/preflight/checks.h"

namespace clothfit {

Findings check_declarations(const Recording& recording) {
  CheckList list(recording);
  check_declarations(recording, list);
  return list.findings();
}

Findings check_recording(const FitInput& input, ObservationKind kind) {
  CheckList list(input.recording);
  check_declarations(input.recording, list);
  const RecordedMotion motion(input, kind);
  check_units(motion, list);
  if (list.refused()) return list.findings();
  check_first_sheet(motion, list);
  if (list.refused()) return list.findings();
  check_timing(motion, list);
  check_marker_tracks(motion, list);
  check_held_points(motion, list);
  if (list.refused()) return list.findings();
  check_hanging(motion, list);
  check_release(motion, list);
  check_obstacle(motion, list);
  return list.findings();
}

void refuse_wrong(const Findings& findings) {
  const Findings refused = with_state(findings, FindingState::refused);
  if (refused.empty()) return;
  const Finding& first = refused.front();
  std::string remedy = first.remedy;
  if (refused.size() > 1)
    remedy += fmt::format("{}{} more of this recording {} refused too", remedy.empty() ? "" : "; ",
                          refused.size() - 1, refused.size() == 2 ? "is" : "are");
  throw InputError(first.where, first.found, first.expected, remedy);
}

}  // namespace clothfit
