#include "vision/track/track.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <optional>
#include <set>

#include "data/input_error.h"
#include "data/pipeline.h"
#include "vision/detect/tag_family.h"
#include "vision/detect/tag_layout.h"
#include "vision/ingest/footage.h"
#include "vision/ingest/frame_list.h"
#include "vision/track/missing_markers.h"
#include "vision/track/tag_history.h"
#include "vision/track/tag_tracker.h"
#include "vision/track/track_dots.h"
#include "vision/track/track_rows.h"
#include "vision/track/track_texture.h"
#include "vision/track/what_appears.h"

namespace clothfit {
namespace {

constexpr int kNone = -1;

/// The marker (or reference point) of each corner of a tag; kNone where there is none.
using PointsByTag = std::map<int, std::array<int, 4>>;

template <class Point>
PointsByTag points_by_tag(const std::vector<Point>& points, const std::string& file) {
  PointsByTag by_tag;
  for (size_t i = 0; i < points.size(); ++i) {
    const Point& point = points[i];
    if (!point.tag || !point.corner) continue;
    std::array<int, 4>& corners =
        by_tag.try_emplace(*point.tag, std::array{kNone, kNone, kNone, kNone}).first->second;
    int& place = corners.at(static_cast<size_t>(*point.corner));
    if (place != kNone)
      throw InputError(file,
                       fmt::format("'{}' and '{}' are the same corner {} of tag {}",
                                   points[static_cast<size_t>(place)].name, point.name,
                                   *point.corner, *point.tag),
                       "each corner of a tag once");
    place = static_cast<int>(i);
  }
  return by_tag;
}

/// Readings of all listed tags in all pictures.
struct Readings {
  std::map<int, TagHistory> by_tag;
  std::map<int, std::map<int, const char*>> missing;  ///< why a tag (key) is in no row of a frame
  std::set<int> unlisted;            ///< tags that no marker and no reference point names
  std::vector<FramePicture> frames;  ///< up to the last that has a picture
  int whole = 0;                     ///< pictures that are not damaged
  bool cancelled = false;
  cv::Size size;
  cv::Mat first_picture;
  cv::Mat overlay_picture;
  int overlay_frame = 0;
};

struct Picture {
  int number = 0;  ///< in order
  int frame = 0;
  FramePicture state = FramePicture::whole;
  cv::Mat grey;
  SheetTags tags;

  bool readable() const { return state != FramePicture::damaged; }
};

/// Keeps what is needed of a whole picture. The middle one is drawn on, or the
/// last before it, or the first after.
void keep_pictures(const Picture& picture, int count, Readings& readings) {
  if (readings.first_picture.empty()) {
    readings.first_picture = picture.grey;
    readings.size = picture.grey.size();
  }
  if (picture.number > count / 2 && !readings.overlay_picture.empty()) return;
  readings.overlay_picture = picture.grey;
  readings.overlay_frame = picture.frame;
}

std::string list_of(const std::set<int>& ids) {
  return list_numbers({ids.begin(), ids.end()});
}

std::set<int> tags_of(const PointsByTag& points) {
  std::set<int> ids;
  for (const auto& [id, corners] : points) ids.insert(id);
  return ids;
}

/// Returns the tags of the cloth and of reference points.
std::set<int> listed_tags(const PointsByTag& markers, const PointsByTag& reference) {
  std::set<int> ids = tags_of(markers);
  ids.merge(tags_of(reference));
  return ids;
}

/// Returns where tags lie on the sheet, of those with four markers.
TagLayout layout_of(const MarkerSet& sheet, const PointsByTag& markers) {
  TagLayout layout;
  for (const auto& [id, corners] : markers) {
    if (std::ranges::count(corners, kNone) > 0) continue;
    for (size_t c = 0; c < 4; ++c) {
      const Marker& marker = sheet.markers[static_cast<size_t>(corners[c])];
      layout[id][c] = {marker.s_m, marker.t_m};
    }
  }
  return layout;
}

/// Throws InputError where a picture shows the listed tags once it is turned, and not as it is.
void refuse_turned(const cv::Mat& grey, const std::string& where, const std::string& family,
                   const std::set<int>& listed) {
  const std::string shows = turned_picture_shows(grey, family, listed);
  if (shows.empty()) return;
  throw InputError(where, "no tag of the cloth appears in the first picture",
                   fmt::format("tags {} of {}", list_of(listed), family), shows);
}

Readings read_all(ImageSource& images, const std::string& where, const MarkerSet& sheet,
                  const PointsByTag& markers, const PointsByTag& reference,
                  const ProgressCallback& progress) {
  Readings readings;
  std::atomic<bool> cancelled = false;
  TagTracker tracker(sheet.family, layout_of(sheet, markers), listed_tags(markers, reference));

  int next = 0;
  const auto load = [&]() -> std::optional<Picture> {
    Picture picture{.number = next++, .grey = {}, .tags = {}};
    if (cancelled || !images.next(picture.grey)) return std::nullopt;
    picture.frame = images.frame();
    picture.state = !images.damage().empty() ? FramePicture::damaged
                    : images.dark()          ? FramePicture::dark
                                             : FramePicture::whole;
    return picture;
  };
  const auto read = [&](Picture picture) {
    if (picture.readable()) picture.tags = tracker.next(picture.grey, picture.frame);
    return picture;
  };
  const auto collect = [&](const Picture& picture) {
    if (cancelled) return;
    if (picture.readable()) keep_pictures(picture, images.count(), readings);
    for (const TagDetection& tag : picture.tags.read) {
      if (markers.contains(tag.id) || reference.contains(tag.id)) {
        readings.by_tag[tag.id].push_back({.frame = picture.frame, .tag = tag, .rejected = {}});
      } else {
        readings.unlisted.insert(tag.id);
      }
    }
    for (const PredictedTag& tag : picture.tags.unread)
      readings.missing[tag.id][picture.frame] = why_unread(tag, readings.size);
    const bool first = picture.readable() && readings.whole++ == 0;
    if (first && readings.by_tag.empty())
      refuse_turned(picture.grey, where, sheet.family, listed_tags(markers, reference));
    readings.frames.resize(static_cast<size_t>(picture.frame) + 1, FramePicture::none);
    readings.frames.back() = picture.state;
    const Progress report{.stage = "track",
                          .done = static_cast<double>(picture.number + 1),
                          .total = static_cast<double>(images.count()),
                          .unit = "frames",
                          .note = fmt::format("{} tags", picture.tags.read.size())};
    if (progress && !progress(report)) cancelled = true;
  };

  // The next picture is decoded while the tags of one are read.
  constexpr size_t kInFlight = 3;
  run_pipeline<Picture>(kInFlight, MiddleStep::in_order, load, read, collect);
  readings.cancelled = cancelled;
  return readings;
}

Tracks2d collect_tracks(const Readings& readings, const PointsByTag& markers) {
  Tracks2d tracks;
  for (const auto& [id, points] : markers) {
    const auto history = readings.by_tag.find(id);
    if (history == readings.by_tag.end()) continue;
    for (const TagReading& reading : history->second) {
      for (size_t c = 0; c < 4; ++c) {
        if (points[c] == kNone) continue;
        tracks.push_back({.frame = reading.frame,
                          .marker = points[c],
                          .position_px = reading.tag.corner_px[c],
                          .sigma_px = reading.tag.sigma_px[c],
                          .rejected = reading.rejected[c]});
      }
    }
  }
  sort_rows(tracks);
  return tracks;
}

/// Counts markers that no row of a frame shows, by reason.
std::map<std::string, int> count_missing(const Readings& readings, const PointsByTag& markers) {
  std::map<std::string, int> missing;
  for (const auto& [id, points] : markers) {
    const auto found = readings.by_tag.find(id);
    static const TagHistory kNever;
    const TagHistory& history = found != readings.by_tag.end() ? found->second : kNever;
    static const std::map<int, const char*> kNothing;
    const auto said = readings.missing.find(id);
    const auto& reasons = said != readings.missing.end() ? said->second : kNothing;
    const auto corners = static_cast<int>(4 - std::ranges::count(points, kNone));
    for (const auto& [reason, frames] :
         missing_frames_of(history, reasons, readings.frames, readings.size))
      missing[reason] += frames * corners;
  }
  return missing;
}

}  // namespace

void TrackOptions::validate() const {
  if (!(max_speed_px > 0))
    throw InputError("max_speed_px", fmt::format("{}", max_speed_px), "pixels per frame, > 0");
  if (!(min_decision_margin >= 0))
    throw InputError("min_decision_margin", fmt::format("{}", min_decision_margin),
                     "grey levels, >= 0");
  if (!(min_explained >= 0 && min_explained <= 1))
    throw InputError("min_explained", fmt::format("{}", min_explained), "a share, 0 to 1");
  if (!(max_sigma_px > 0))
    throw InputError("max_sigma_px", fmt::format("{}", max_sigma_px), "pixels, > 0");
  if (max_corrected_bits < 0 || max_corrected_bits > 2)
    throw InputError("max_corrected_bits", fmt::format("{}", max_corrected_bits), "0, 1 or 2");
}

TrackResult track(const Recording& recording, const CameraEntry& camera,
                  const TrackOptions& options, const ProgressCallback& progress) {
  options.validate();
  const std::string yaml = (recording.folder / "recording.yaml").string();
  if (!camera.images)
    throw InputError(yaml, fmt::format("camera '{}' has no images", camera.name),
                     "`images` with a folder or a video to track in");
  const Footage footage = open_footage(recording, {camera.name});
  TrackResult result =
      track(recording, camera, *footage.cameras.at(camera.name), options, progress);
  result.footage.insert(result.footage.begin(), footage.findings.begin(), footage.findings.end());
  return result;
}

TrackResult track(const Recording& recording, const CameraEntry& camera, ImageSource& pictures,
                  const TrackOptions& options, const ProgressCallback& progress) {
  options.validate();
  if (recording.markers.kind == MarkerKind::texture)
    return track_texture(recording, camera, pictures, options, progress);
  return track(recording, pictures, camera.images->string(), options, progress);
}

TrackResult track(const Recording& recording, ImageSource& pictures, const std::string& where,
                  const TrackOptions& options, const ProgressCallback& progress) {
  options.validate();
  if (recording.markers.kind == MarkerKind::dots)
    return track_dots(recording, pictures, where, options, progress);
  const PointsByTag markers =
      points_by_tag(recording.markers.markers, recording.markers_file.string());
  if (markers.empty())
    throw InputError(recording.markers_file.string(), "no marker is a corner of a tag",
                     "markers with `tag` and `corner`", "tracking finds AprilTags");
  require_tags(recording.markers.family, listed_tags(markers, {}), recording.markers_file.string());
  const PointsByTag reference =
      points_by_tag(recording.reference, recording.reference_file.value_or("reference").string());
  require_tags(recording.markers.family, listed_tags(reference, {}),
               recording.reference_file.value_or("reference").string());

  Readings readings = read_all(pictures, where, recording.markers, markers, reference, progress);

  TrackResult result;
  result.footage = pictures.findings();
  result.frames = static_cast<int>(readings.frames.size());
  result.image_width = readings.size.width;
  result.image_height = readings.size.height;
  if (readings.cancelled) {
    result.cancelled = true;
    result.message = fmt::format("cancelled after {} frames", result.frames);
    return result;
  }

  for (auto& [id, history] : readings.by_tag) judge(history, options, readings.size);
  result.tracks = collect_tracks(readings, markers);
  if (readings.whole == 0)
    throw InputError(where, fmt::format("none of its {} pictures is whole", pictures.count()),
                     "pictures that can be decoded", "copy it again");
  if (result.tracks.empty())
    throw InputError(
        where, fmt::format("no tag of the cloth appears in {} pictures", readings.whole),
        fmt::format("tags {} of {}", list_of(listed_tags(markers, {})), recording.markers.family),
        what_appears_instead(readings.first_picture, recording.markers.family,
                             listed_tags(markers, reference), readings.unlisted));
  result.missing = count_missing(readings, markers);
  result.reference = average_reference(readings.by_tag, recording.reference);

  int good = 0;
  for (const Position2d& row : result.tracks)
    if (row.rejected.empty())
      ++good;
    else
      ++result.rejected[row.rejected];
  result.overlay = draw_rows(readings.overlay_picture, readings.overlay_frame, result);
  result.overlay_frame = readings.overlay_frame;
  result.usable = good > 0;
  result.message = fmt::format("{} corners in {} frames, {} rejected, {} of {} reference points",
                               good, result.frames, static_cast<int>(result.tracks.size()) - good,
                               result.reference.size(), recording.reference.size());
  return result;
}

}  // namespace clothfit
