#include "vision/look/look.h"

#include <fmt/core.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/info.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include <set>
#include <utility>

#include "data/input_error.h"
#include "data/pipeline.h"
#include "vision/detect/tag_detector.h"
#include "vision/ingest/open_images.h"
#include "vision/look/families_shown.h"
#include "vision/track/dot_tracks.h"
#include "vision/track/overlay.h"
#include "vision/track/track_options.h"
#include "vision/track/what_appears.h"

namespace clothfit {
namespace {

struct LookedAt {
  int number = 0;
  bool wanted = true;
  cv::Mat grey;
  SeenPicture seen;
};

using Detectors = std::vector<TagDetector>;

/// What is looked for.
struct LookFor {
  const LookOptions& options;
  std::vector<std::string> families;
  DotsShown dots;
  std::string turned;  ///< as in LookResult
};

/// Finds what one picture shows.
void look_at(LookedAt& picture, Detectors& detectors, const LookFor& wanted) {
  const LookOptions& options = wanted.options;
  const std::vector<std::string>& families = wanted.families;
  const DotsShown& dots = wanted.dots;
  for (size_t f = 0; f < families.size(); ++f)
    for (const TagDetection& tag : detectors[f].detect(picture.grey)) {
      TagReading reading{.frame = picture.seen.frame, .tag = tag, .rejected = {}};
      judge_alone(reading, TrackOptions(), picture.grey.size());
      picture.seen.tags.push_back({families[f], std::move(reading)});
    }
  if (dots.any) picture.seen.dots = find_seen_dots(picture.grey, dots.pattern);
  // What was looked at before may be long ago, so that nothing is followed from it.
  if (options.sheet != nullptr)
    for (const DotRow& row : DotTracker(*options.sheet, "markers").next(picture.grey).dots)
      picture.seen.markers.push_back({row.marker, row.pixel_px});
  constexpr size_t kFewTags = 3;  // where there are more, a grid of corners is a tag's
  if (options.boards && picture.seen.tags.size() < kFewTags && picture.seen.dots.empty())
    picture.seen.board = search_board(picture.grey);
}

/// Says how the first whole picture would show tags of some families, mirrored or inverted.
std::string turned(const std::filesystem::path& images, const std::vector<std::string>& families) {
  const auto source = open_images(images);
  cv::Mat grey;
  while (source->next(grey)) {
    if (!source->damage().empty()) continue;
    for (const std::string& family : families)
      if (const std::string shown = turned_picture_shows(grey, family, {}); !shown.empty())
        return shown;
    return "";
  }
  return "";
}

/// The family that most people print.
constexpr const char* kUsualFamily = "tag36h11";

LookFor what_to_look_for(const std::filesystem::path& images, const LookOptions& options) {
  LookFor wanted{.options = options, .families = options.families, .dots = {}, .turned = {}};
  if (options.sheet == nullptr && options.dots) wanted.dots = dots_shown(images);
  if (options.sheet != nullptr || !options.families.empty()) return wanted;
  wanted.families = families_shown(images);
  if (std::ranges::find(wanted.families, kUsualFamily) == wanted.families.end())
    wanted.turned = turned(images, {kUsualFamily});
  // What else seems to appear in mirrored tags of the usual family is chance.
  if (!wanted.turned.empty()) wanted.families.clear();
  return wanted;
}

bool shows_no_tag(const LookResult& result) {
  return std::ranges::all_of(result.pictures,
                             [](const SeenPicture& picture) { return picture.tags.empty(); });
}

/// Leaves out tags that no picture shows well: weak families find such ids in any texture.
void leave_out_invented(std::vector<SeenPicture>& pictures) {
  std::set<std::pair<std::string, int>> good;
  for (const SeenPicture& picture : pictures)
    for (const SeenTag& tag : picture.tags)
      if (tag.reading.good()) good.emplace(tag.family, tag.reading.tag.id);
  for (SeenPicture& picture : pictures)
    std::erase_if(picture.tags, [&](const SeenTag& tag) {
      return !good.contains({tag.family, tag.reading.tag.id});
    });
}

cv::Mat draw_seen(const cv::Mat& grey, const SeenPicture& seen) {
  std::vector<OverlayPoint> points;
  for (const SeenTag& tag : seen.tags)
    for (size_t c = 0; c < 4; ++c) {
      const std::string& reason = tag.reading.rejected[c];
      constexpr size_t kTopLeft = 3;
      points.push_back(
          {.kind = reason.empty() ? OverlayPoint::Kind::good : OverlayPoint::Kind::rejected,
           .pixel_px = tag.reading.tag.corner_px[c],
           .label = c == kTopLeft ? fmt::format("{}", tag.reading.tag.id) : ""});
    }
  for (const SeenDot& dot : seen.dots)
    points.push_back(
        {.kind = OverlayPoint::Kind::good,
         .pixel_px = dot.pixel_px,
         .label = dot.named() && dot.column == 0 ? dot_name(dot.row, dot.column) : ""});
  if (seen.board)
    for (const Eigen::Vector2d& corner : seen.board->corner_px)
      points.push_back({.kind = OverlayPoint::Kind::reference, .pixel_px = corner, .label = ""});
  return draw_overlay(grey, points);
}

/// Says whether the picture of that number is drawn: the first, the middle, or the last looked at.
bool is_drawn(int number, int count, int every) {
  const int last = (count - 1) / every;
  return number % every == 0 &&
         (number == 0 || number / every == last / 2 || number / every == last);
}

Progress looked_report(int number, int count, size_t tags) {
  return {.stage = "look",
          .done = static_cast<double>(number + 1),
          .total = static_cast<double>(count),
          .unit = "pictures",
          .note = fmt::format("{} tags", tags)};
}

}  // namespace

void LookOptions::validate() const {
  if (every < 1)
    throw InputError("LookOptions::every", fmt::format("{}", every), "a whole number, 1 or more");
}

LookResult look(const std::filesystem::path& images, const LookOptions& options,
                const ProgressCallback& progress) {
  options.validate();
  LookResult result;
  const LookFor wanted = what_to_look_for(images, options);
  result.families = wanted.families;
  result.turned = wanted.turned;
  result.pattern = wanted.dots.pattern;
  const auto source = open_images(images);
  result.count = source->count();
  result.times_s = source->times_s();
  const int every = options.looks > 0 ? std::max(1, result.count / options.looks) : options.every;
  std::atomic<bool> cancelled = false;
  cv::Mat first;
  tbb::enumerable_thread_specific<Detectors> detectors([&] {
    Detectors all;
    for (const std::string& family : result.families) all.emplace_back(family);
    return all;
  });
  int next = 0;
  const auto load = [&]() -> std::optional<LookedAt> {
    LookedAt picture{.number = next++, .grey = {}, .seen = {}};
    if (cancelled || !source->next(picture.grey)) return std::nullopt;
    const bool due = picture.number % every == 0 || picture.number < options.head;
    picture.wanted = due && source->damage().empty();
    picture.seen.name = source->current_name();
    picture.seen.frame = source->frame();
    return picture;
  };
  const auto detect = [&](LookedAt picture) {
    if (picture.wanted) look_at(picture, detectors.local(), wanted);
    return picture;
  };
  const auto collect = [&](const LookedAt& picture) {
    if (!picture.wanted || cancelled) return;
    if (first.empty()) first = picture.grey;
    if (is_drawn(picture.number, result.count, every))
      result.overlays.push_back({picture.seen.frame, draw_seen(picture.grey, picture.seen)});
    result.pictures.push_back(picture.seen);
    const Progress report = looked_report(picture.number, result.count, picture.seen.tags.size());
    if (progress && !progress(report)) cancelled = true;
  };
  const size_t in_flight = 2 * static_cast<size_t>(tbb::info::default_concurrency());
  run_pipeline<LookedAt>(in_flight, MiddleStep::several_at_once, load, detect, collect);

  leave_out_invented(result.pictures);
  if (!options.families.empty() && shows_no_tag(result))
    result.turned = turned(images, options.families);
  result.cancelled = cancelled;
  result.width = first.cols;
  result.height = first.rows;
  result.footage = source->findings();
  return result;
}

}  // namespace clothfit
