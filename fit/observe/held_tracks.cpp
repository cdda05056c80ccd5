#include "fit/observe/held_tracks.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "calib/camera/projection.h"
#include "data/input_error.h"
#include "fit/interface/fit_input.h"
#include "fit/observe/node_weights.h"
#include "fit/observe/observations.h"
#include "fit/observe/shape_from_pixels.h"
#include "fit/observe/sheet_placement.h"

namespace clothfit {
namespace {

/// A marker this close to a held point is that point: both are written in decimals.
constexpr double kSamePlaceM = 1e-6;

int marker_at(const Recording& recording, const Eigen::Vector2d& at_m) {
  const auto& markers = recording.markers.markers;
  for (size_t m = 0; m < markers.size(); ++m)
    if (std::hypot(markers[m].s_m - at_m.x(), markers[m].t_m - at_m.y()) < kSamePlaceM)
      return static_cast<int>(m);
  throw InputError((recording.folder / "recording.yaml").string(),
                   "no marker lies at the held point (" + std::to_string(at_m.x()) + ", " +
                       std::to_string(at_m.y()) + "), whose motion is tracked",
                   "a marker at its (s, t) in the markers file",
                   "use motion: fixed or path, or name a place that carries a marker");
}

/// Returns the observations of each camera, of all markers.
std::vector<ObservationSet> pixel_sets(const FitInput& input) {
  std::vector<ObservationSet> sets;
  std::map<std::string, int> rejected;
  for (const CameraParameters& camera : input.cameras) {
    const Tracks2d& tracks = input.tracks2d.at(camera.name);
    ObservedFrames frames;
    for (int f = 0; !tracks.empty() && f <= tracks.back().frame; ++f)
      frames.time_s.push_back(input.recording.frame_time_s(f));
    frames.first_held_out = static_cast<int>(frames.time_s.size());
    sets.push_back(observations_2d(tracks, camera, frames,
                                   static_cast<int>(input.recording.markers.markers.size()), {},
                                   rejected));
  }
  return sets;
}

/// Returns the point nearest to the rays through the pixels of a marker in a frame. Along
/// directions that these leave open, it is nearest to `guess_m`. Returns nothing where no camera
/// sees the marker.
std::optional<Eigen::Vector3d> on_rays(const std::vector<ObservationSet>& sets, int frame,
                                       int marker, const Eigen::Vector3d& guess_m) {
  constexpr double kGuess = 1e-4;  // as a share of a ray's weight
  Eigen::Matrix3d across = kGuess * Eigen::Matrix3d::Identity();
  Eigen::Vector3d right = kGuess * guess_m;
  bool seen = false;
  for (const ObservationSet& set : sets) {
    const auto row = std::ranges::find_if(set.rows, [&](const Observation& observation) {
      return observation.frame == frame && observation.marker == marker;
    });
    if (row == set.rows.end()) continue;
    const auto direction = unproject(*set.camera, row->observed.head<2>());
    if (!direction) continue;
    const CameraPose& pose = *set.camera->camera_from_world;
    const Eigen::Quaterniond to_world = pose.rotation.conjugate();
    const Eigen::Vector3d along = to_world * *direction;
    const Eigen::Matrix3d off_ray = Eigen::Matrix3d::Identity() - along * along.transpose();
    across += off_ray;
    right -= off_ray * (to_world * pose.translation_m);
    seen = true;
  }
  if (!seen) return std::nullopt;
  return Eigen::Vector3d(across.ldlt().solve(right));
}

}  // namespace

bool follows_markers(const Recording& recording) {
  return std::ranges::any_of(
      recording.held, [](const HeldPoint& point) { return point.motion == HeldMotion::tracked; });
}

std::vector<int> driving_markers(const Recording& recording) {
  std::vector<int> markers;
  for (const HeldPoint& point : recording.held)
    if (point.motion == HeldMotion::tracked) markers.push_back(marker_at(recording, point.at_m));
  return markers;
}

Tracks3d held_tracks_from_pixels(const FitInput& input) {
  constexpr int kNodes = 6;
  const Recording& recording = input.recording;
  const double width_m = recording.cloth.width_m, height_m = recording.cloth.height_m;
  const auto refuse = [&](const std::string& problem) -> InputError {
    return {(recording.folder / "recording.yaml").string(),
            "held points are tracked, and " + problem,
            "tracks3d, or pixels of at least half of the markers in every frame",
            "use motion: fixed or path, or cut the recording to frames that show the cloth"};
  };
  const Eigen::Matrix2Xd marker_m = marker_places(recording.markers);
  const std::vector<ObservationSet> sets = pixel_sets(input);
  const auto world_from_sheet = place_flat_sheet(sets, marker_m, 1);
  if (!world_from_sheet) throw refuse("frame 0 shows too few markers to place the sheet");
  int frames = 0;
  for (const ObservationSet& set : sets)
    if (!set.rows.empty()) frames = std::max(frames, set.rows.back().frame + 1);
  const int fitted = std::min(frames, recording.held_out_from_frame.value_or(frames));
  const auto shapes =
      shapes_from_pixels(sets, marker_m, width_m, height_m, *world_from_sheet, kNodes, fitted);
  if (!shapes) throw refuse("pixels do not show the shape of the cloth in every fitted frame");

  const std::vector<int> markers = driving_markers(recording);
  const Eigen::MatrixXd weights =
      node_weights({kNodes, kNodes, width_m, height_m}, kNodes, marker_m(Eigen::all, markers));
  Tracks3d tracks;
  Eigen::Matrix3Xd place_m;
  for (int f = 0; f < frames; ++f) {
    if (f < fitted) place_m = shapes->node_m[static_cast<size_t>(f)] * weights.transpose();
    for (size_t k = 0; k < markers.size(); ++k) {
      auto at_m = place_m.col(static_cast<Eigen::Index>(k));
      const auto seen_m = on_rays(sets, f, markers[k], at_m);
      if (!seen_m && f >= fitted) continue;
      if (seen_m) at_m = *seen_m;
      tracks.push_back({.frame = f, .marker = markers[k], .position_m = at_m});
    }
  }
  std::ranges::stable_sort(tracks, {},
                           [](const Position3d& row) { return std::pair(row.frame, row.marker); });
  return tracks;
}

}  // namespace clothfit
