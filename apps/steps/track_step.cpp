#include "apps/steps/track_step.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/steps/picture_size.h"
#include "apps/steps/recording_copy.h"
#include "apps/terminal/exit_code.h"
#include "apps/terminal/json_file.h"
#include "data/camera_parameters.h"
#include "data/input_error.h"
#include "data/recording_parts.h"
#include "vision/encode/encode_picture.h"
#include "vision/ingest/footage.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

bool has_pose(const CameraEntry& camera) {
  return camera.file && read_camera(*camera.file).camera_from_world;
}

void check_size(const CameraEntry& camera) {
  const CameraParameters parameters = read_camera(*camera.file);
  const PictureSize calibrated{parameters.image_width, parameters.image_height};
  const PictureSize pictures = picture_size(*camera.images);
  if (calibrated != pictures)
    throw InputError(camera.file->string(),
                     fmt::format("the camera was calibrated at {}", to_string(calibrated)),
                     fmt::format("{}, the size of the pictures in {}", to_string(pictures),
                                 camera.images->string()),
                     "calibrate at the size of the recording, or scale focal and centre");
}

/// Returns reference points with their mean pixels. Corners of one tag lie on one plate.
std::vector<PlacedPixel> reference_pixels(const Recording& recording,
                                          const std::vector<ReferencePixel>& seen) {
  std::vector<PlacedPixel> placed;
  for (const ReferencePixel& pixel : seen) {
    const ReferencePoint& point = recording.reference[static_cast<size_t>(pixel.point)];
    placed.push_back({.point_m = {point.x_m, point.y_m, point.z_m},
                      .pixel_px = pixel.pixel_px,
                      .sigma_px = pixel.sigma_px,
                      .group = point.tag.value_or(-1)});
  }
  return placed;
}

/// Returns the flat sheet as the first frame shows it; nothing where the start is not a flat sheet.
std::vector<PlacedPixel> first_sheet(const Recording& recording, const Tracks2d& tracks) {
  std::vector<PlacedPixel> sheet;
  if (recording.start != StartKind::released_flat) return sheet;
  for (const Position2d& row : tracks) {
    if (row.frame != 0 || !row.rejected.empty()) continue;
    const Marker& marker = recording.markers.markers[static_cast<size_t>(row.marker)];
    sheet.push_back({.point_m = {marker.s_m, marker.t_m, 0},
                     .pixel_px = row.position_px,
                     .sigma_px = row.sigma_px > 0 ? row.sigma_px : 1.0,
                     .group = marker.tag.value_or(-1)});
  }
  return sheet;
}

/// Gives the camera its pose in the world, or says in `not_placed` what is missing for it.
void place_camera(const Recording& recording, const CameraEntry& camera, CameraTracks& tracks) {
  if (!camera.file) {
    tracks.not_placed = "it is not calibrated: give it a file, or stills of a board";
    return;
  }
  CameraParameters parameters = read_camera(*camera.file);
  if (parameters.camera_from_world) return;
  if (recording.reference.empty()) {
    tracks.not_placed =
        "its file has no camera_from_world, and the recording has no reference points to find it "
        "from: add reference.csv with fixed tags, or the pose";
    return;
  }
  const WorldPlacementResult placement =
      place_world(parameters, reference_pixels(recording, tracks.result.reference),
                  first_sheet(recording, tracks.result.tracks));
  if (!placement.usable)
    throw NoResult(fmt::format("camera '{}' could not be placed in the world: {}", camera.name,
                               placement.message));
  parameters.camera_from_world =
      CameraPose{.rotation = placement.camera_from_world.rotation,
                 .translation_m = placement.camera_from_world.translation_m,
                 .covariance = placement.covariance};
  write_camera(parameters, *camera.file);
  tracks.placement = placement;
}

/// Writes the times that the videos state, and makes them the recording's.
void take_times(const std::vector<double>& times_s, Recording& recording) {
  recording.times_s = times_s;
  recording.times_file = recording.folder / "times.csv";
  write_times(times_s, *recording.times_file);
}

nlohmann::ordered_json to_json(const CameraTracks& tracks) {
  const TrackResult& result = tracks.result;
  const auto good = std::count_if(result.tracks.begin(), result.tracks.end(),
                                  [](const Position2d& row) { return row.rejected.empty(); });
  nlohmann::ordered_json json;
  json["camera"] = tracks.camera;
  json["message"] = result.message;
  json["frames"] = result.frames;
  json["image_size"] = {result.image_width, result.image_height};
  json["observations"] = {{"good", good}, {"rejected", result.rejected}};
  json["missing"] = result.missing;
  json["reference_points"] = result.reference.size();
  if (tracks.placement) {
    const WorldPlacementResult& placement = *tracks.placement;
    json["placement"] = {{"message", placement.message},
                         {"reference_rms", placement.reference_rms_px},
                         {"reference_survey_sigma", placement.reference_survey_sigma_m}};
    if (placement.has_sheet) json["placement"]["sheet_rms"] = placement.sheet_rms_px;
  } else if (!tracks.not_placed.empty()) {
    json["not_placed"] = tracks.not_placed;
  }
  return json;
}

}  // namespace

std::vector<std::string> cameras_to_track(const Recording& recording, bool again) {
  const bool untimed = !recording.frame_rate_hz && !recording.times_file;
  std::vector<std::string> names;
  for (const CameraEntry& camera : recording.cameras) {
    if (!camera.images) continue;
    const bool tracked = recording.tracks2d.contains(camera.name);
    const bool waits_for_pose = !recording.reference.empty() && !has_pose(camera);
    if (again || untimed || !tracked || waits_for_pose) names.push_back(camera.name);
  }
  return names;
}

void require_footage(const Recording& recording, const std::vector<std::string>& cameras) {
  open_footage(recording, cameras);
}

TrackStepResult track_step(const Recording& recording, const std::vector<std::string>& cameras,
                           const TrackOptions& options, const std::filesystem::path& folder,
                           const ProgressCallback& progress) {
  const Footage footage = open_footage(recording, cameras);
  TrackStepResult step{
      .recording = copy_recording(recording, folder), .cameras = {}, .footage = footage.findings};
  if (!footage.times_s.empty()) take_times(footage.times_s, step.recording);
  fs::create_directories(folder / "tracks2d");
  nlohmann::ordered_json json;
  json["format"] = "clothfit-tracks/1";
  json["cameras"] = nlohmann::ordered_json::array();

  for (const CameraEntry& camera : step.recording.cameras) {
    if (std::find(cameras.begin(), cameras.end(), camera.name) == cameras.end()) continue;
    // A refusal names the file where the user has it, not its copy.
    const CameraEntry& given = *recording.find_camera(camera.name);
    if (given.file) check_size(given);

    CameraTracks tracks;
    tracks.camera = camera.name;
    tracks.result = track(recording, given, *footage.cameras.at(camera.name), options, progress);
    step.footage.insert(step.footage.end(), tracks.result.footage.begin(),
                        tracks.result.footage.end());
    if (tracks.result.cancelled) throw Cancelled();
    if (!tracks.result.usable)
      throw NoResult(
          fmt::format("camera '{}' gave no tracks: {}", camera.name, tracks.result.message));
    place_camera(step.recording, camera, tracks);

    const fs::path file = folder / "tracks2d" / (camera.name + ".csv");
    const auto older = step.recording.tracks2d.find(camera.name);
    if (older != step.recording.tracks2d.end()) fs::remove(older->second);
    write_tracks2d(tracks.result.tracks, step.recording.markers, file);
    step.recording.tracks2d[camera.name] = file;
    if (!tracks.result.overlay.empty())
      write_png(tracks.result.overlay, folder / fmt::format("overlay_{}.png", camera.name));
    json["cameras"].push_back(to_json(tracks));
    step.cameras.push_back(std::move(tracks));
  }
  write_json(json, folder / "tracks.json");
  write_recording(step.recording, folder);
  return step;
}

}  // namespace clothfit
