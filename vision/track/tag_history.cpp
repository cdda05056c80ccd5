#include "vision/track/tag_history.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "vision/track/rejection.h"
#include "vision/track/track_options.h"

namespace clothfit {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Says whether corners may slide along edges: where two edges meet flatly, or the quadrilateral is
/// thin. An angle is then within `kSmallestAngle` of 0 or 180 degrees.
bool nearly_degenerate(const std::array<Eigen::Vector2d, 4>& corner_px) {
  constexpr double kSmallestAngle = 15 * M_PI / 180;
  for (size_t c = 0; c < 4; ++c) {
    const Eigen::Vector2d forward = corner_px[(c + 1) % 4] - corner_px[c];
    const Eigen::Vector2d back = corner_px[(c + 3) % 4] - corner_px[c];
    // Corners run counter-clockwise as seen, which is a negative turn with y pointing down.
    const double sine = -cross(forward, back) / (forward.norm() * back.norm());
    if (!(sine > std::sin(kSmallestAngle))) return true;
  }
  return false;
}

/// Rejects a tag read twice in a picture, as nothing tells which reading is it. One row per frame
/// stays, that of the clearest reading, rejected.
void judge_duplicates(TagHistory& history) {
  std::stable_sort(history.begin(), history.end(), [](const TagReading& a, const TagReading& b) {
    if (a.frame != b.frame) return a.frame < b.frame;
    if (a.good() != b.good()) return a.good();
    return a.tag.decision_margin > b.tag.decision_margin;
  });
  TagHistory kept;
  for (TagReading& reading : history)
    if (kept.empty() || kept.back().frame != reading.frame)
      kept.push_back(std::move(reading));
    else if (reading.good())
      kept.back().reject(rejection::kDuplicateId);
  history = std::move(kept);
}

/// Rejects a tag that is out of reach both from its place before and from its place after. At the
/// ends of its history the two next readings on the one side stand for both.
void judge_jumps(TagHistory& history, double max_speed_px) {
  std::vector<TagReading*> good;
  for (TagReading& reading : history)
    if (reading.good()) good.push_back(&reading);
  const auto out_of_reach = [&](size_t a, size_t b) {
    const double frames = std::abs(good[a]->frame - good[b]->frame);
    return (good[a]->centre_px() - good[b]->centre_px()).norm() > max_speed_px * frames;
  };
  if (good.size() < 3) return;
  std::vector<bool> jumps(good.size());
  const size_t last = good.size() - 1;
  for (size_t i = 1; i < last; ++i) jumps[i] = out_of_reach(i, i - 1) && out_of_reach(i, i + 1);
  jumps[0] = out_of_reach(0, 1) && out_of_reach(0, 2);
  jumps[last] = out_of_reach(last, last - 1) && out_of_reach(last, last - 2);
  for (size_t i = 0; i < good.size(); ++i)
    if (jumps[i]) good[i]->reject(rejection::kJump);
}

}  // namespace

bool TagReading::good() const {
  return std::ranges::any_of(rejected, [](const std::string& reason) { return reason.empty(); });
}

void TagReading::reject(const char* reason) {
  for (std::string& corner : rejected)
    if (corner.empty()) corner = reason;
}

Eigen::Vector2d TagReading::centre_px() const {
  return (tag.corner_px[0] + tag.corner_px[1] + tag.corner_px[2] + tag.corner_px[3]) / 4;
}

void judge_alone(TagReading& reading, const TrackOptions& options, const cv::Size& size) {
  const TagDetection& tag = reading.tag;
  // The margin counts on a tag of full contrast, so that a dark picture is no worse by itself.
  constexpr double kFullContrast = 160;  // grey levels
  const double of_full =
      tag.contrast_levels > 0 ? std::min(tag.contrast_levels / kFullContrast, 1.0) : 1;
  if (tag.decision_margin < of_full * options.min_decision_margin)
    reading.reject(rejection::kLowMargin);
  if (tag.corrected_bits > options.max_corrected_bits) reading.reject(rejection::kCorrectedBits);
  if (nearly_degenerate(tag.corner_px)) reading.reject(rejection::kTooOblique);
  if (!tag.shows_tag || (!tag.predicted && tag.explained < options.min_explained))
    reading.reject(rejection::kPatternMismatch);
  constexpr double kBorder = 2;  // px; reach of an edge's blur
  for (size_t c = 0; c < 4; ++c) {
    const Eigen::Vector2d& corner = tag.corner_px[c];
    const bool inside = corner.x() >= kBorder && corner.x() <= size.width - 1 - kBorder &&
                        corner.y() >= kBorder && corner.y() <= size.height - 1 - kBorder;
    if (!inside && reading.rejected[c].empty()) reading.rejected[c] = rejection::kTouchingBorder;
    constexpr double kSeen = 0.7;  // higher loses ragged corners, lower lets half hidden ones pass
    if (tag.corner_seen[c] < kSeen && reading.rejected[c].empty())
      reading.rejected[c] = rejection::kCovered;
    if (tag.sigma_px[c] > options.max_sigma_px && reading.rejected[c].empty())
      reading.rejected[c] = rejection::kUncertain;
  }
}

void judge(TagHistory& history, const TrackOptions& options, const cv::Size& size) {
  for (TagReading& reading : history) judge_alone(reading, options, size);
  judge_duplicates(history);
  judge_jumps(history, options.max_speed_px);
}

}  // namespace clothfit
