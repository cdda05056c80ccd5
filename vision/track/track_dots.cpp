#include "vision/track/track_dots.h"

#include <fmt/core.h>

#include <algorithm>
#include <optional>

#include "data/input_error.h"
#include "vision/detect/tag_detector.h"
#include "vision/track/dot_tracks.h"
#include "vision/track/missing_markers.h"
#include "vision/track/tag_history.h"
#include "vision/track/track_rows.h"

namespace clothfit {
namespace {

/// What the pictures of one camera show, by kind.
struct DotReadings {
  Tracks2d dots;
  std::map<int, TagHistory> tags;
  std::map<std::string, int> missing;
  cv::Mat overlay_picture;
  int overlay_frame = 0;
  cv::Size size;
  int frames = 0;  ///< up to the last that has a picture
  int pictures = 0;
  bool cancelled = false;
};

void add_frame(const DotFrame& frame, int number, DotReadings& readings) {
  for (const DotRow& row : frame.dots)
    readings.dots.push_back({.frame = number,
                             .marker = row.marker,
                             .position_px = row.pixel_px,
                             .sigma_px = row.sigma_px,
                             .rejected = ""});
  for (const TagDetection& tag : frame.tags)
    readings.tags[tag.id].push_back({.frame = number, .tag = tag, .rejected = {}});
  for (const auto& [reason, count] : frame.missing_counts()) readings.missing[reason] += count;
}

/// Counts all dots as missing in the frames that lie between two pictures.
void add_gap(int from, int to, int dots, DotReadings& readings) {
  if (to > from) readings.missing[missing::kNoPicture] += dots * (to - from);
}

/// Reads the tags of a scene whose cloth carries none. They are fixed, so that some pictures do.
class BesideTags {
 public:
  explicit BesideTags(const Recording& recording) {
    const auto has_tag = [](const auto& point) { return point.tag.has_value(); };
    if (std::ranges::none_of(recording.markers.markers, has_tag) &&
        std::ranges::any_of(recording.reference, has_tag) && !recording.markers.family.empty())
      detector_.emplace(recording.markers.family);
  }

  void read(const cv::Mat& grey, int number, int pictures, DotReadings& readings) {
    constexpr int kLooks = 25;
    if (!detector_ || count_++ % std::max(1, pictures / kLooks) != 0) return;
    for (const TagDetection& tag : detector_->detect(grey))
      readings.tags[tag.id].push_back({.frame = number, .tag = tag, .rejected = {}});
  }

 private:
  std::optional<TagDetector> detector_;
  int count_ = 0;
};

DotReadings read_dots(DotTracker& tracker, BesideTags& beside, int dots, ImageSource& pictures,
                      const ProgressCallback& progress) {
  DotReadings readings;
  cv::Mat grey;
  while (!readings.cancelled && pictures.next(grey)) {
    const int number = pictures.frame();
    add_gap(readings.frames, number, dots, readings);
    readings.frames = number + 1;
    ++readings.pictures;
    size_t found = 0;
    if (pictures.damage().empty()) {
      readings.size = grey.size();
      const DotFrame frame = tracker.next(grey);
      add_frame(frame, number, readings);
      beside.read(grey, number, pictures.count(), readings);
      found = frame.dots.size();
      if (readings.pictures <= pictures.count() / 2 + 1) {
        readings.overlay_picture = grey.clone();
        readings.overlay_frame = number;
      }
    } else {
      readings.missing[missing::kDamaged] += dots;
    }
    const Progress report{.stage = "track",
                          .done = static_cast<double>(readings.pictures),
                          .total = static_cast<double>(pictures.count()),
                          .unit = "frames",
                          .note = fmt::format("{} dots", found)};
    if (progress && !progress(report)) readings.cancelled = true;
  }
  return readings;
}

/// Adds the corners of anchor tags to the rows.
void add_tag_rows(const DotReadings& readings, const std::vector<Marker>& markers,
                  Tracks2d& tracks) {
  for (size_t i = 0; i < markers.size(); ++i) {
    if (!markers[i].tag || !markers[i].corner) continue;
    const auto history = readings.tags.find(*markers[i].tag);
    if (history == readings.tags.end()) continue;
    const auto corner = static_cast<size_t>(*markers[i].corner);
    for (const TagReading& reading : history->second)
      tracks.push_back({.frame = reading.frame,
                        .marker = static_cast<int>(i),
                        .position_px = reading.tag.corner_px[corner],
                        .sigma_px = reading.tag.sigma_px[corner],
                        .rejected = reading.rejected[corner]});
  }
  sort_rows(tracks);
}

}  // namespace

TrackResult track_dots(const Recording& recording, ImageSource& pictures, const std::string& where,
                       const TrackOptions& options, const ProgressCallback& progress) {
  DotTracker tracker(recording.markers, recording.markers_file.string());
  const auto sheet_dots = static_cast<int>(std::ranges::count_if(
      recording.markers.markers, [](const Marker& marker) { return !marker.tag; }));
  BesideTags beside(recording);
  DotReadings readings = read_dots(tracker, beside, sheet_dots, pictures, progress);
  TrackResult result;
  result.footage = pictures.findings();
  result.frames = readings.frames;
  result.image_width = readings.size.width;
  result.image_height = readings.size.height;
  if (readings.cancelled) {
    result.cancelled = true;
    result.message = fmt::format("cancelled after {} frames", readings.frames);
    return result;
  }
  if (readings.dots.empty())
    throw InputError(where,
                     fmt::format("no dot of the cloth is named in {} pictures", readings.pictures),
                     "dots 4 px wide or more, and an anchor tag or the printed pattern among them");
  for (auto& [id, history] : readings.tags) judge(history, options, readings.size);
  result.tracks = std::move(readings.dots);
  const size_t dots = result.tracks.size();
  add_tag_rows(readings, recording.markers.markers, result.tracks);
  result.reference = average_reference(readings.tags, recording.reference);
  for (const Position2d& row : result.tracks)
    if (!row.rejected.empty()) ++result.rejected[row.rejected];
  int missing = 0;
  for (const auto& [reason, count] : readings.missing) missing += count;
  result.missing = std::move(readings.missing);
  result.overlay = draw_rows(readings.overlay_picture, readings.overlay_frame, result);
  result.overlay_frame = readings.overlay_frame;
  result.usable = true;
  result.message = fmt::format("{} dots and {} corners in {} frames, {} dots not found", dots,
                               result.tracks.size() - dots, result.frames, missing);
  return result;
}

}  // namespace clothfit
