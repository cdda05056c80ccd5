#include "vision/track/track_texture.h"

#include <fmt/core.h>

#include <algorithm>
#include <optional>

#include "data/input_error.h"
#include "vision/detect/tag_detector.h"
#include "vision/texture/first_places.h"
#include "vision/texture/texture_tracker.h"
#include "vision/track/missing_markers.h"
#include "vision/track/rejection.h"
#include "vision/track/tag_history.h"
#include "vision/track/track_rows.h"

namespace clothfit {
namespace {

/// What the pictures of one camera show.
struct TextureReadings {
  Tracks2d rows;
  std::map<std::string, int> missing;
  std::map<int, TagHistory> reference_tags;
  cv::Mat overlay_picture;
  int overlay_frame = 0;
  cv::Size size;
  int frames = 0;  ///< up to the last that has a picture
  int pictures = 0;
  bool cancelled = false;
};

void add_texture_frame(const TextureFrame& frame, int number, TextureReadings& readings) {
  for (const TextureRow& row : frame.rows)
    readings.rows.push_back({.frame = number,
                             .marker = row.marker,
                             .position_px = row.pixel_px,
                             .sigma_px = row.sigma_px,
                             .rejected = ""});
  for (const auto& [marker, reason] : frame.missing) ++readings.missing[reason];
}

/// Reads the tags of fixed reference points.
class ReferenceTags {
 public:
  explicit ReferenceTags(const Recording& recording) {
    for (const ReferencePoint& point : recording.reference)
      if (point.tag) ids_.insert(*point.tag);
    if (ids_.empty()) return;
    if (recording.markers.family.empty())
      throw InputError((recording.folder / "recording.yaml").string(),
                       "reference points carry tags of no family",
                       "`family` beside `kind: texture`", "name the family, such as tag36h11");
    detector_.emplace(recording.markers.family);
  }
  void read(const cv::Mat& grey, int frame, std::map<int, TagHistory>& histories) {
    if (!detector_) return;
    for (const TagDetection& tag : detector_->detect(grey))
      if (ids_.contains(tag.id))
        histories[tag.id].push_back({.frame = frame, .tag = tag, .rejected = {}});
  }

 private:
  std::set<int> ids_;
  std::optional<TagDetector> detector_;
};

void require_frame_0(int frame, const std::string& damage, const std::string& where) {
  if (frame == 0 && damage.empty()) return;
  throw InputError(where,
                   frame == 0 ? "the picture of frame 0 is damaged: " + damage
                              : fmt::format("the first picture is that of frame {}", frame),
                   "a whole picture of frame 0, which textured markers are aligned with",
                   "begin the recording with a whole picture");
}

TextureReadings read_texture(const Recording& recording, const CameraEntry& camera,
                             ImageSource& pictures, const ProgressCallback& progress) {
  const auto markers = static_cast<int>(recording.markers.markers.size());
  TextureReadings readings;
  ReferenceTags reference(recording);
  std::optional<TextureTracker> tracker;
  cv::Mat grey;
  while (!readings.cancelled && pictures.next(grey)) {
    const int number = pictures.frame();
    if (!tracker) require_frame_0(number, pictures.damage(), camera.images->string());
    if (number > readings.frames)
      readings.missing[missing::kNoPicture] += markers * (number - readings.frames);
    readings.frames = number + 1;
    ++readings.pictures;
    size_t found = 0;
    if (!pictures.damage().empty()) {
      readings.missing[missing::kDamaged] += markers;
    } else if (pictures.dark() && tracker) {
      readings.missing[texture_missing::kDark] += markers;
    } else {
      readings.size = grey.size();
      TextureFrame frame;
      if (tracker) {
        frame = tracker->next(grey);
      } else {
        const TextureLayout layout(recording.markers.markers,
                                   find_first_places(recording, camera, grey),
                                   recording.cloth.width_m, recording.cloth.height_m);
        frame = tracker.emplace(layout, grey).first();
      }
      add_texture_frame(frame, number, readings);
      reference.read(grey, number, readings.reference_tags);
      found = frame.rows.size();
      if (readings.pictures <= pictures.count() / 2 + 1) {
        readings.overlay_picture = grey.clone();
        readings.overlay_frame = number;
      }
    }
    const Progress report{.stage = "track",
                          .done = static_cast<double>(readings.pictures),
                          .total = static_cast<double>(pictures.count()),
                          .unit = "frames",
                          .note = fmt::format("{} markers", found)};
    if (progress && !progress(report)) readings.cancelled = true;
  }
  return readings;
}

}  // namespace

TrackResult track_texture(const Recording& recording, const CameraEntry& camera,
                          ImageSource& pictures, const TrackOptions& options,
                          const ProgressCallback& progress) {
  TextureReadings readings = read_texture(recording, camera, pictures, progress);
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
  if (readings.rows.empty())
    throw InputError(camera.images->string(),
                     "no marker has enough texture around it in the picture of frame 0",
                     "a print or weave that the picture shows", "film nearer, or print a pattern");
  for (auto& [id, history] : readings.reference_tags) judge(history, options, readings.size);
  result.tracks = std::move(readings.rows);
  sort_rows(result.tracks);
  int good = 0;
  for (Position2d& row : result.tracks) {
    if (row.sigma_px > options.max_sigma_px) row.rejected = rejection::kUncertain;
    if (row.rejected.empty())
      ++good;
    else
      ++result.rejected[row.rejected];
  }
  result.reference = average_reference(readings.reference_tags, recording.reference);
  int missing = 0;
  for (const auto& [reason, count] : readings.missing) missing += count;
  result.missing = std::move(readings.missing);
  result.overlay = draw_rows(readings.overlay_picture, readings.overlay_frame, result);
  result.overlay_frame = readings.overlay_frame;
  result.usable = good > 0;
  result.message =
      fmt::format("{} markers in {} frames, {} rejected, {} not found", good, result.frames,
                  static_cast<int>(result.tracks.size()) - good, missing);
  return result;
}

}  // namespace clothfit
