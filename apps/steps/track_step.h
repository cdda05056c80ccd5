#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/placement/world_placement.h"
#include "data/progress.h"
#include "data/recording.h"
#include "vision/track/track.h"

namespace clothfit {

/// One camera tracked, and placed in the world where that was possible and needed.
struct CameraTracks {
  std::string camera;
  TrackResult result;  ///< usable
  std::optional<WorldPlacementResult> placement;
  std::string not_placed;  ///< why the camera still has no pose; empty when it has one
};

struct TrackStepResult {
  Recording recording;  ///< as it stands in the step's folder, with tracks, poses and times
  std::vector<CameraTracks> cameras;
  Findings footage;  ///< what is to be said of the pictures and their times
};

/// Returns cameras whose pictures wait to be tracked. These are cameras without tracks, and those
/// whose pose can only come from reference points that tracking sees. Where only the videos state
/// the times, or with `again`, it is every camera with pictures.
std::vector<std::string> cameras_to_track(const Recording& recording, bool again);

/// Throws InputError for pictures that cannot be opened, and times that contradict the recording.
/// It names the user's files and takes no step, so it comes before all of them.
void require_footage(const Recording& recording, const std::vector<std::string>& cameras);

/// Tracks the named cameras and writes a complete recording into `folder`, which exists. It holds
/// tracks2d/CAMERA.csv, cameras/CAMERA.yaml with the pose, overlay_CAMERA.png, tracks.json, and
/// times.csv where the videos state the times. Throws InputError for a camera file of another size
/// than the pictures, and, before any is tracked, for times that contradict the recording.
TrackStepResult track_step(const Recording& recording, const std::vector<std::string>& cameras,
                           const TrackOptions& options, const std::filesystem::path& folder,
                           const ProgressCallback& progress);

}  // namespace clothfit
