#include "fit/problem/unknown_group.h"

namespace clothfit {

std::span<const UnknownGroup* const> unknown_groups() {
  static const UnknownGroup* const kGroups[] = {
      &spring_unknowns(), &effect_unknowns(), &gravity_unknowns(),
      &sheet_unknowns(),  &start_unknowns(),  &drive_unknowns(),
  };
  return kGroups;
}

std::string recording_file(const Recording& recording) {
  return (recording.folder / "recording.yaml").string();
}

}  // namespace clothfit
