#include "vision/texture/first_places.h"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <optional>

#include "data/camera_parameters.h"
#include "data/input_error.h"
#include "data/tracks.h"
#include "vision/detect/tag_detector.h"
#include "vision/texture/flat_sheet_view.h"

namespace clothfit {
namespace {

using KnownPlaces = std::vector<std::optional<FirstPlace>>;

void take_rows(const Recording& recording, const CameraEntry& camera, const cv::Size& size,
               KnownPlaces& places) {
  const auto file = recording.tracks2d.find(camera.name);
  if (file == recording.tracks2d.end()) return;
  for (const Position2d& row : read_tracks2d(file->second, recording.markers)) {
    if (row.frame != 0 || !row.rejected.empty()) continue;
    const Marker& marker = recording.markers.markers[static_cast<size_t>(row.marker)];
    const Eigen::Vector2d& at = row.position_px;
    if (at.minCoeff() < 0 || at.x() > size.width - 1 || at.y() > size.height - 1)
      throw InputError(file->second.string(),
                       fmt::format("marker '{}' at ({:.2f}, {:.2f}) in frame 0 lies outside the "
                                   "picture",
                                   marker.name, at.x(), at.y()),
                       fmt::format("a place in {} x {} pixels", size.width, size.height),
                       "leave the row out where the picture does not show the marker");
    places[static_cast<size_t>(row.marker)] = FirstPlace{.pixel_px = at, .sigma_px = row.sigma_px};
  }
}

void take_tags(const Recording& recording, const cv::Mat& grey, KnownPlaces& places) {
  const std::vector<Marker>& markers = recording.markers.markers;
  const auto has_tag = [](const Marker& marker) { return marker.tag.has_value(); };
  if (std::ranges::none_of(markers, has_tag)) return;
  if (recording.markers.family.empty())
    throw InputError((recording.folder / "recording.yaml").string(),
                     "markers carry tags of no family", "`family` beside `kind: texture`",
                     "name the family, such as tag36h11");
  std::map<int, std::vector<TagDetection>> by_tag;
  for (TagDetection& tag : TagDetector(recording.markers.family).detect(grey))
    by_tag[tag.id].push_back(std::move(tag));
  for (size_t m = 0; m < markers.size(); ++m) {
    if (!markers[m].tag || !markers[m].corner || places[m]) continue;
    const auto found = by_tag.find(*markers[m].tag);
    if (found == by_tag.end() || found->second.size() != 1 || !found->second[0].refined) continue;
    const auto corner = static_cast<size_t>(*markers[m].corner);
    places[m] = FirstPlace{.pixel_px = found->second[0].corner_px[corner],
                           .sigma_px = found->second[0].sigma_px[corner]};
  }
}

std::string first_without(const Recording& recording, const KnownPlaces& places) {
  for (size_t m = 0; m < places.size(); ++m)
    if (!places[m]) return recording.markers.markers[m].name;
  return "";
}

/// Refuses a known place that the flat sheet through all of them misses.
void refuse_contradicting(const Recording& recording, const std::vector<size_t>& known,
                          const std::vector<SheetSighting>& sightings, const FlatSheetView& view) {
  constexpr double kOff_px = 2, kOffSigmas = 6;
  for (size_t i = 0; i < known.size(); ++i) {
    const std::optional<FirstPlace> expected = view.at(sightings[i].on_sheet_m);
    const double off_px = expected ? (expected->pixel_px - sightings[i].pixel_px).norm() : 1 / 0.0;
    if (off_px < std::max(kOff_px, kOffSigmas * sightings[i].sigma_px)) continue;
    throw InputError(
        recording.markers_file.string(),
        fmt::format("marker '{}' lies {:.1f} px from where the other {} known markers of frame 0 "
                    "place it on a flat sheet",
                    recording.markers.markers[known[i]].name, off_px, known.size() - 1),
        "s and t, and places in frame 0, of one flat sheet",
        "correct s and t or its row of frame 0; where frame 0 shows bent cloth give every marker "
        "a row");
  }
}

/// Places the markers that are not known by the flat sheet through those that are.
void complete_flat(const Recording& recording, const CameraEntry& camera, KnownPlaces& places) {
  constexpr double kUnstated_px = 0.3;  // sigma of a row that states none, as it is read by eye
  std::vector<size_t> known;
  std::vector<SheetSighting> sightings;
  for (size_t m = 0; m < places.size(); ++m) {
    if (!places[m]) continue;
    const Marker& marker = recording.markers.markers[m];
    known.push_back(m);
    sightings.push_back({.on_sheet_m = {marker.s_m, marker.t_m},
                         .pixel_px = places[m]->pixel_px,
                         .sigma_px = places[m]->sigma_px > 0 ? places[m]->sigma_px : kUnstated_px});
  }
  std::optional<CameraParameters> parameters;
  if (camera.file) parameters = read_camera(*camera.file);
  const std::optional<FlatSheetView> view = FlatSheetView::fit(sightings, parameters);
  if (!view)
    throw InputError(recording.markers_file.string(),
                     fmt::format("{} markers have a place in frame 0, and '{}' has none",
                                 known.size(), first_without(recording, places)),
                     "four known markers that are not on a line",
                     "give them rows of frame 0 in tracks2d, or print anchor tags on the sheet");
  refuse_contradicting(recording, known, sightings, *view);
  for (size_t m = 0; m < places.size(); ++m) {
    if (places[m]) continue;
    const Marker& marker = recording.markers.markers[m];
    places[m] = view->at({marker.s_m, marker.t_m});
    if (!places[m])
      throw InputError(recording.markers_file.string(),
                       fmt::format("marker '{}' lies behind the camera", marker.name),
                       "a sheet in view in frame 0");
  }
}

}  // namespace

std::vector<FirstPlace> find_first_places(const Recording& recording, const CameraEntry& camera,
                                          const cv::Mat& grey) {
  KnownPlaces places(recording.markers.markers.size());
  take_rows(recording, camera, grey.size(), places);
  take_tags(recording, grey, places);
  const std::string without = first_without(recording, places);
  if (!without.empty()) {
    if (recording.start != StartKind::released_flat)
      throw InputError(recording.markers_file.string(),
                       fmt::format("nothing says where marker '{}' lies in frame 0", without),
                       "a row of frame 0 in tracks2d for every marker, or `start: released_flat`",
                       "only on a flat sheet do a few markers lead to the others");
    complete_flat(recording, camera, places);
  }
  std::vector<FirstPlace> result;
  for (const std::optional<FirstPlace>& place : places) result.push_back(*place);
  return result;
}

}  // namespace clothfit
