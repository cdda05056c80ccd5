#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "data/recording.h"
#include "vision/look/look.h"

namespace clothfit {

/// Footage of one camera, and what it shows.
struct LookedFootage {
  std::filesystem::path images;  ///< a video or a folder of pictures
  LookResult seen;
};

/// What is known beside the footage.
struct DraftInput {
  Recording sheet;  ///< gives cloth and markers
  std::vector<LookedFootage> footage;
  std::optional<double> mass_kg;
  std::optional<double> frame_rate_hz;         ///< of pictures that state no times
  std::optional<std::filesystem::path> board;  ///< stills of a chessboard
  std::optional<LookResult> board_seen;        ///< what these show
  std::optional<double> square_m;              ///< side of the board's fields
};

/// A recording.yaml to go on with.
struct RecordingDraft {
  std::string yaml;                  ///< with comments; complete, so that it can be tracked
  std::vector<std::string> assumed;  ///< what was concluded from the footage, with its reason
  std::vector<std::string> needed;   ///< what no picture tells, and what to do about it
};

/// Throws InputError: nobody said which sheet the cloth carries. It says which tags the footage
/// shows, and how such a sheet is made.
[[noreturn]] void refuse_without_sheet(const LookedFootage& footage);

/// Describes footage of a cloth that carries a known sheet. Which points are held, and how the
/// motion starts, is concluded from what moves. `folder` will hold recording.yaml. Throws
/// InputError where nothing of the sheet appears, or another one does, and for a frame rate that
/// the videos' own times contradict.
RecordingDraft draft_recording(const DraftInput& input, const std::string& name,
                               const std::filesystem::path& folder);

}  // namespace clothfit
