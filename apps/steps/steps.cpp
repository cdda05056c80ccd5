#include "apps/steps/steps.h"

#include <fmt/format.h>

#include <utility>

#include "apps/steps/calibrate_step.h"
#include "apps/steps/track_step.h"
#include "data/camera_parameters.h"
#include "data/input_error.h"
#include "fit/observe/held_tracks.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

std::string yaml_of(const Recording& recording) {
  return (recording.folder / "recording.yaml").string();
}

/// Throws InputError for a camera that cannot be placed. A pose comes from the camera's file or
/// from reference points. Without either, hours of tracking would end in nothing.
void check_cameras_can_be_placed(const Recording& recording) {
  for (const CameraEntry& camera : recording.cameras) {
    if (!camera.images && !recording.tracks2d.contains(camera.name)) continue;
    if (!camera.file && !camera.calibration)
      throw InputError(
          yaml_of(recording), fmt::format("camera '{}' has neither a file nor stills", camera.name),
          "a calibrated camera", "give it `file`, or stills of a board under `calibration`");
    const bool has_pose = camera.file && read_camera(*camera.file).camera_from_world;
    const bool can_be_placed = camera.images && !recording.reference.empty();
    if (!has_pose && !can_be_placed)
      throw InputError(camera.file ? camera.file->string() : yaml_of(recording),
                       fmt::format("nothing says where camera '{}' stands", camera.name),
                       "camera_from_world in its file, or pictures of reference points",
                       "add reference.csv with tags that stay in the picture, or measure the pose");
  }
}

}  // namespace

ObservationKind resolve_observations(const Recording& recording, ObservationKind kind) {
  if (kind != ObservationKind::automatic) return kind;
  return recording.tracks3d ? ObservationKind::tracks3d : ObservationKind::tracks2d;
}

CompletedRecording complete_recording(const Recording& recording, ObservationKind kind,
                                      const StepOptions& options,
                                      const std::filesystem::path& steps,
                                      const ProgressCallback& progress) {
  CompletedRecording result{.recording = recording, .footage = {}};
  Recording& complete = result.recording;
  // Measured 3D positions need no camera.
  if (resolve_observations(recording, kind) == ObservationKind::tracks3d) return result;
  check_cameras_can_be_placed(recording);

  require_footage(recording, cameras_to_track(recording, false));
  const std::vector<std::string> uncalibrated = cameras_to_calibrate(complete, false);
  if (!uncalibrated.empty()) {
    const fs::path folder = steps / "calibrated";
    fs::create_directories(folder);
    complete =
        calibrate_step(complete, uncalibrated, options.calibrate, folder, progress).recording;
  }
  const std::vector<std::string> untracked = cameras_to_track(complete, false);
  if (!untracked.empty()) {
    const fs::path folder = steps / "tracked";
    fs::create_directories(folder);
    TrackStepResult step = track_step(complete, untracked, options.track, folder, progress);
    complete = std::move(step.recording);
    result.footage = std::move(step.footage);
  }
  return result;
}

namespace {

/// Reads clouds and turns them from the axes of the camera that saw them into the world's.
PointClouds read_clouds_in_world(const Recording& recording, const Clouds& clouds) {
  const CameraEntry* camera = recording.find_camera(clouds.camera);
  if (camera == nullptr || !camera->file) return {};
  const std::optional<CameraPose> pose = read_camera(*camera->file).camera_from_world;
  if (!pose) return {};
  PointClouds result = read_point_clouds(clouds.folder);
  for (auto& [frame, points_m] : result)
    points_m =
        pose->rotation.conjugate().toRotationMatrix() * (points_m.colwise() - pose->translation_m);
  return result;
}

}  // namespace

FitInput read_fit_input(const Recording& recording, ObservationKind kind) {
  FitInput input;
  input.recording = recording;
  if (recording.clouds) input.clouds = read_clouds_in_world(recording, *recording.clouds);
  if (resolve_observations(recording, kind) == ObservationKind::tracks3d) {
    if (!recording.tracks3d)
      throw InputError(yaml_of(recording), "has no 3D tracks", "observations: {tracks3d: FILE}",
                       "leave --observations out to fit what there is");
    input.tracks3d = read_tracks3d(*recording.tracks3d, recording.markers);
    return input;
  }

  if (recording.tracks2d.empty())
    throw InputError(yaml_of(recording), "has nothing to fit to",
                     "3D tracks, 2D tracks, or a camera with pictures", "");
  for (const auto& [name, file] : recording.tracks2d) {
    const CameraEntry* camera = recording.find_camera(name);
    if (camera == nullptr || !camera->file)
      throw InputError(yaml_of(recording), fmt::format("camera '{}' has tracks but no file", name),
                       "a calibrated camera",
                       "give it `file`, or stills of a board under `calibration`");
    CameraParameters parameters = read_camera(*camera->file);
    if (!parameters.camera_from_world)
      throw InputError(camera->file->string(), "has no camera_from_world",
                       "where the camera stands in the world", "track the recording first");
    parameters.name = name;
    input.tracks2d[name] = read_tracks2d(file, recording.markers);
    input.cameras.push_back(std::move(parameters));
  }
  if (follows_markers(recording)) input.held_tracks = held_tracks_from_pixels(input);
  return input;
}

}  // namespace clothfit
