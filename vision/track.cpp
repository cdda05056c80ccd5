#include "vision/track.h"

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/info.h>
#include <tbb/parallel_pipeline.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <set>

#include "data/input_error.h"
#include "vision/image_source.h"
#include "vision/overlay.h"
#include "vision/rejection.h"
#include "vision/tag_detector.h"

namespace clothfit {
namespace {

constexpr int kNone = -1;

/// Which marker (or reference point) each corner of a tag is; kNone where it is none.
using PointsByTag = std::map<int, std::array<int, 4>>;

template <class Point>
PointsByTag points_by_tag(const std::vector<Point>& points, const std::string& file) {
  PointsByTag by_tag;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& point = points[i];
    if (!point.tag || !point.corner) continue;
    std::array<int, 4>& corners =
        by_tag.try_emplace(*point.tag, std::array{kNone, kNone, kNone, kNone}).first->second;
    int& place = corners.at(static_cast<std::size_t>(*point.corner));
    if (place != kNone) {
      throw InputError(file,
                       fmt::format("'{}' and '{}' are the same corner {} of tag {}",
                                   points[static_cast<std::size_t>(place)].name, point.name,
                                   *point.corner, *point.tag),
                       "each corner of a tag once");
    }
    place = static_cast<int>(i);
  }
  return by_tag;
}

/// One reading of a tag and why it, or single corners of it, are doubted (empty: they are not).
struct Reading {
  int frame = 0;
  TagDetection tag;
  std::array<std::string, 4> rejected;

  bool good() const {
    return std::any_of(rejected.begin(), rejected.end(),
                       [](const std::string& reason) { return reason.empty(); });
  }
  void reject(const char* reason) {
    for (std::string& corner : rejected) {
      if (corner.empty()) corner = reason;
    }
  }
  Eigen::Vector2d centre_px() const {
    return (tag.corner_px[0] + tag.corner_px[1] + tag.corner_px[2] + tag.corner_px[3]) / 4;
  }
};

/// The readings of one tag, sorted by frame.
using History = std::vector<Reading>;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// True where two edges meet so flatly, or the quadrilateral is so thin, that corners slide along
/// edges: an angle within `kSmallestAngle` of 0 or 180 degrees.
bool nearly_degenerate(const std::array<Eigen::Vector2d, 4>& corner_px) {
  constexpr double kSmallestAngle = 15 * M_PI / 180;
  for (std::size_t c = 0; c < 4; ++c) {
    const Eigen::Vector2d forward = corner_px[(c + 1) % 4] - corner_px[c];
    const Eigen::Vector2d back = corner_px[(c + 3) % 4] - corner_px[c];
    // Corners run counter-clockwise as seen, which is a negative turn with y pointing down.
    const double sine = -cross(forward, back) / (forward.norm() * back.norm());
    if (!(sine > std::sin(kSmallestAngle))) return true;
  }
  return false;
}

/// Reasons that show in one picture alone.
void judge_alone(Reading& reading, const TrackOptions& options, const cv::Size& size) {
  const TagDetection& tag = reading.tag;
  if (tag.decision_margin < options.min_decision_margin) reading.reject(rejection::kLowMargin);
  if (tag.corrected_bits > options.max_corrected_bits) reading.reject(rejection::kCorrectedBits);
  if (nearly_degenerate(tag.corner_px)) reading.reject(rejection::kTooOblique);
  if (!tag.refined || tag.explained < options.min_explained) {
    reading.reject(rejection::kPatternMismatch);
  }
  constexpr double kBorder = 2;  // px; what an edge's blur reaches
  for (std::size_t c = 0; c < 4; ++c) {
    const Eigen::Vector2d& corner = tag.corner_px[c];
    const bool inside = corner.x() >= kBorder && corner.x() <= size.width - 1 - kBorder &&
                        corner.y() >= kBorder && corner.y() <= size.height - 1 - kBorder;
    if (!inside && reading.rejected[c].empty()) reading.rejected[c] = rejection::kTouchingBorder;
    if (tag.sigma_px[c] > options.max_sigma_px && reading.rejected[c].empty()) {
      reading.rejected[c] = rejection::kUncertain;
    }
  }
}

/// A tag read twice in a picture: no telling which is it. One row per frame stays, that of the
/// clearest reading, rejected.
void judge_duplicates(History& history) {
  std::stable_sort(history.begin(), history.end(), [](const Reading& a, const Reading& b) {
    if (a.frame != b.frame) return a.frame < b.frame;
    if (a.good() != b.good()) return a.good();
    return a.tag.decision_margin > b.tag.decision_margin;
  });
  History kept;
  for (Reading& reading : history) {
    if (kept.empty() || kept.back().frame != reading.frame) {
      kept.push_back(std::move(reading));
    } else if (reading.good()) {
      kept.back().reject(rejection::kDuplicateId);
    }
  }
  history = std::move(kept);
}

/// A tag that is out of reach from where it was before and from where it is after. At the ends of
/// its history the two next readings on the one side stand for both.
void judge_jumps(History& history, double max_speed_px) {
  std::vector<Reading*> good;
  for (Reading& reading : history) {
    if (reading.good()) good.push_back(&reading);
  }
  const auto out_of_reach = [&](std::size_t a, std::size_t b) {
    const double frames = std::abs(good[a]->frame - good[b]->frame);
    return (good[a]->centre_px() - good[b]->centre_px()).norm() > max_speed_px * frames;
  };
  if (good.size() < 3) return;
  std::vector<bool> jumps(good.size());
  const std::size_t last = good.size() - 1;
  for (std::size_t i = 1; i < last; ++i) {
    jumps[i] = out_of_reach(i, i - 1) && out_of_reach(i, i + 1);
  }
  jumps[0] = out_of_reach(0, 1) && out_of_reach(0, 2);
  jumps[last] = out_of_reach(last, last - 1) && out_of_reach(last, last - 2);
  for (std::size_t i = 0; i < good.size(); ++i) {
    if (jumps[i]) good[i]->reject(rejection::kJump);
  }
}

/// Readings of all listed tags in all pictures.
struct Readings {
  std::map<int, History> by_tag;
  std::set<int> unlisted;  ///< tags that no marker and no reference point names
  int frames = 0;
  bool cancelled = false;
  cv::Size size;
  cv::Mat first_picture;
  cv::Mat overlay_picture;
  int overlay_frame = 0;
};

struct Picture {
  int frame = 0;
  cv::Mat grey;
  std::vector<TagDetection> tags;
};

/// The picture to draw on is the middle one; where a video does not say how long it is, one between
/// its half and its end or, at worst, its quarter.
bool is_overlay_frame(int frame, int count) {
  if (count > 0) return frame == count / 2;
  return frame == 0 || std::has_single_bit(static_cast<unsigned>(frame));
}

Readings read_all(ImageSource& images, const std::string& family, const PointsByTag& markers,
                  const PointsByTag& reference, const ProgressCallback& progress) {
  Readings readings;
  std::atomic<bool> cancelled = false;
  tbb::enumerable_thread_specific<TagDetector> detectors([&] { return TagDetector(family); });

  int next_frame = 0;
  const auto load = [&](tbb::flow_control& control) {
    Picture picture{.frame = next_frame++, .grey = {}, .tags = {}};
    if (cancelled || !images.next(picture.grey)) control.stop();
    return picture;
  };
  const auto detect = [&](Picture picture) {
    picture.tags = detectors.local().detect(picture.grey);
    return picture;
  };
  const auto collect = [&](const Picture& picture) {
    if (cancelled) return;
    if (picture.frame == 0) readings.first_picture = picture.grey;
    readings.size = picture.grey.size();
    if (is_overlay_frame(picture.frame, images.count())) {
      readings.overlay_picture = picture.grey;
      readings.overlay_frame = picture.frame;
    }
    for (const TagDetection& tag : picture.tags) {
      if (markers.contains(tag.id) || reference.contains(tag.id)) {
        readings.by_tag[tag.id].push_back({.frame = picture.frame, .tag = tag, .rejected = {}});
      } else {
        readings.unlisted.insert(tag.id);
      }
    }
    readings.frames = picture.frame + 1;
    const Progress report{.stage = "track",
                          .done = static_cast<double>(readings.frames),
                          .total = static_cast<double>(images.count()),
                          .unit = "frames",
                          .note = fmt::format("{} tags", picture.tags.size())};
    if (progress && !progress(report)) cancelled = true;
  };

  const std::size_t in_flight = 2 * static_cast<std::size_t>(tbb::info::default_concurrency());
  tbb::parallel_pipeline(
      in_flight, tbb::make_filter<void, Picture>(tbb::filter_mode::serial_in_order, load) &
                     tbb::make_filter<Picture, Picture>(tbb::filter_mode::parallel, detect) &
                     tbb::make_filter<Picture, void>(tbb::filter_mode::serial_in_order, collect));
  readings.cancelled = cancelled;
  return readings;
}

/// "0 to 63" or "0, 4, 7": the numbers as a person would list them.
std::string list_ids(const std::set<int>& ids) {
  std::vector<std::string> parts;
  for (auto it = ids.begin(); it != ids.end();) {
    const int first = *it;
    int last = first;
    for (++it; it != ids.end() && *it == last + 1; ++it) last = *it;
    parts.push_back(first == last ? fmt::format("{}", first)
                                  : fmt::format("{} to {}", first, last));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

/// What the first picture shows instead of the tags that were looked for, as a remedy.
std::string what_appears_instead(const Readings& readings, const std::string& family) {
  if (!readings.unlisted.empty()) {
    return fmt::format("tags {} of that family do appear: check markers.csv",
                       list_ids(readings.unlisted));
  }
  constexpr std::size_t kEnough = 3;   // fewer may be chance readings of a small code
  constexpr double kClearMargin = 30;  // grey levels
  for (const std::string& other : tag_families()) {
    if (other == family) continue;
    std::set<int> ids;
    for (const TagDetection& tag : TagDetector(other, 0).detect(readings.first_picture)) {
      if (tag.decision_margin > kClearMargin) ids.insert(tag.id);
    }
    if (ids.size() >= kEnough) {
      return fmt::format("the first picture shows tags {} of {}: set that family in recording.yaml",
                         list_ids(ids), other);
    }
  }
  return "check the camera's `images`, the light, and that a tag is 30 pixels wide or more";
}

/// The mean place of a corner that does not move. Only the scatter from frame to frame averages
/// out: ragged edges and the pixel grid are the same in every picture of a fixed tag, so that the
/// detections' own sigma stays.
ReferencePixel average(int point, const std::vector<Eigen::Vector2d>& pixels,
                       const std::vector<double>& sigmas) {
  const auto median = [](std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  std::vector<double> u, v, distance;
  for (const Eigen::Vector2d& pixel : pixels) {
    u.push_back(pixel.x());
    v.push_back(pixel.y());
  }
  const Eigen::Vector2d centre(median(u), median(v));
  for (const Eigen::Vector2d& pixel : pixels) distance.push_back((pixel - centre).norm());

  // Something that passes in front bends a corner off its place for a few frames: detections
  // further off than 5 sigma are left out. The median distance of a normal scatter is 1.18 sigma.
  const double reach = 5 * std::max(median(distance) / 1.18, median(sigmas));
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double square_sigma_sum = 0;
  int used = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (distance[i] > reach) continue;
    sum += pixels[i];
    square_sigma_sum += sigmas[i] * sigmas[i];
    ++used;
  }
  const Eigen::Vector2d mean = sum / used;
  double scatter = 0;  // variance per coordinate
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (distance[i] <= reach) scatter += (pixels[i] - mean).squaredNorm() / 2;
  }
  const double stated = square_sigma_sum / used;
  scatter = used > 1 ? scatter / (used - 1) : stated;
  return {.point = point,
          .pixel_px = mean,
          .sigma_px = std::sqrt(stated + scatter / used),
          .frames = used};
}

std::vector<ReferencePixel> average_reference(const Readings& readings,
                                              const PointsByTag& reference) {
  std::vector<ReferencePixel> result;
  for (const auto& [id, points] : reference) {
    const auto history = readings.by_tag.find(id);
    if (history == readings.by_tag.end()) continue;
    for (std::size_t c = 0; c < 4; ++c) {
      std::vector<Eigen::Vector2d> pixels;
      std::vector<double> sigmas;
      for (const Reading& reading : history->second) {
        if (!reading.rejected[c].empty()) continue;
        pixels.push_back(reading.tag.corner_px[c]);
        sigmas.push_back(reading.tag.sigma_px[c]);
      }
      if (points[c] == kNone || pixels.empty()) continue;
      result.push_back(average(points[c], pixels, sigmas));
    }
  }
  std::sort(result.begin(), result.end(),
            [](const ReferencePixel& a, const ReferencePixel& b) { return a.point < b.point; });
  return result;
}

Tracks2d collect_tracks(const Readings& readings, const PointsByTag& markers) {
  Tracks2d tracks;
  for (const auto& [id, points] : markers) {
    const auto history = readings.by_tag.find(id);
    if (history == readings.by_tag.end()) continue;
    for (const Reading& reading : history->second) {
      for (std::size_t c = 0; c < 4; ++c) {
        if (points[c] == kNone) continue;
        tracks.push_back({.frame = reading.frame,
                          .marker = points[c],
                          .position_px = reading.tag.corner_px[c],
                          .sigma_px = reading.tag.sigma_px[c],
                          .rejected = reading.rejected[c]});
      }
    }
  }
  std::sort(tracks.begin(), tracks.end(), [](const Position2d& a, const Position2d& b) {
    return a.frame != b.frame ? a.frame < b.frame : a.marker < b.marker;
  });
  return tracks;
}

cv::Mat draw(const Readings& readings, const TrackResult& result) {
  std::vector<OverlayPoint> points;
  for (const ReferencePixel& pixel : result.reference) {
    points.push_back(
        {.kind = OverlayPoint::Kind::reference, .pixel_px = pixel.pixel_px, .label = ""});
  }
  for (const Position2d& row : result.tracks) {
    if (row.frame != readings.overlay_frame) continue;
    points.push_back(
        {.kind = row.rejected.empty() ? OverlayPoint::Kind::good : OverlayPoint::Kind::rejected,
         .pixel_px = row.position_px,
         .label = row.rejected});
  }
  return draw_overlay(readings.overlay_picture, points);
}

}  // namespace

void TrackOptions::validate() const {
  if (!(max_speed_px > 0)) {
    throw InputError("max_speed_px", fmt::format("{}", max_speed_px), "pixels per frame, > 0");
  }
  if (!(min_decision_margin >= 0)) {
    throw InputError("min_decision_margin", fmt::format("{}", min_decision_margin),
                     "grey levels, >= 0");
  }
  if (!(min_explained >= 0 && min_explained <= 1)) {
    throw InputError("min_explained", fmt::format("{}", min_explained), "a share, 0 to 1");
  }
  if (!(max_sigma_px > 0)) {
    throw InputError("max_sigma_px", fmt::format("{}", max_sigma_px), "pixels, > 0");
  }
  if (max_corrected_bits < 0 || max_corrected_bits > 2) {
    throw InputError("max_corrected_bits", fmt::format("{}", max_corrected_bits), "0, 1 or 2");
  }
}

TrackResult track(const Recording& recording, const CameraEntry& camera,
                  const TrackOptions& options, const ProgressCallback& progress) {
  options.validate();
  const std::string yaml = (recording.folder / "recording.yaml").string();
  if (!camera.images) {
    throw InputError(yaml, fmt::format("camera '{}' has no images", camera.name),
                     "`images` with a folder or a video to track in");
  }
  const PointsByTag markers =
      points_by_tag(recording.markers.markers, recording.markers_file.string());
  if (markers.empty()) {
    throw InputError(recording.markers_file.string(), "no marker is a corner of a tag",
                     "markers with `tag` and `corner`", "tracking finds AprilTags");
  }
  const PointsByTag reference =
      points_by_tag(recording.reference, recording.reference_file.value_or("reference").string());

  const std::unique_ptr<ImageSource> images = open_images(*camera.images);
  Readings readings = read_all(*images, recording.markers.family, markers, reference, progress);

  TrackResult result;
  result.frames = readings.frames;
  result.image_width = readings.size.width;
  result.image_height = readings.size.height;
  if (readings.cancelled) {
    result.cancelled = true;
    result.message = fmt::format("cancelled after {} frames", readings.frames);
    return result;
  }

  for (auto& [id, history] : readings.by_tag) {
    for (Reading& reading : history) judge_alone(reading, options, readings.size);
    judge_duplicates(history);
    judge_jumps(history, options.max_speed_px);
  }
  result.tracks = collect_tracks(readings, markers);
  if (result.tracks.empty()) {
    std::set<int> ids;
    for (const auto& [id, points] : markers) ids.insert(id);
    throw InputError(camera.images->string(),
                     fmt::format("no tag of the cloth appears in {} pictures", readings.frames),
                     fmt::format("tags {} of {}", list_ids(ids), recording.markers.family),
                     what_appears_instead(readings, recording.markers.family));
  }
  result.reference = average_reference(readings, reference);

  int good = 0;
  for (const Position2d& row : result.tracks) {
    if (row.rejected.empty()) {
      ++good;
    } else {
      ++result.rejected[row.rejected];
    }
  }
  result.overlay = draw(readings, result);
  result.overlay_frame = readings.overlay_frame;
  result.usable = good > 0;
  result.message = fmt::format("{} corners in {} frames, {} rejected, {} of {} reference points",
                               good, result.frames, static_cast<int>(result.tracks.size()) - good,
                               result.reference.size(), recording.reference.size());
  return result;
}

}  // namespace clothfit
