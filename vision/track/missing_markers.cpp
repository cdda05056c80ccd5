#include "vision/track/missing_markers.h"

#include <algorithm>
#include <array>
#include <iterator>

#include "vision/detect/tag_refine.h"

namespace clothfit {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;

/// Returns the corners at a frame on the line through two readings.
Corners on_line(const TagReading& a, const TagReading& b, int frame) {
  const double share = static_cast<double>(frame - a.frame) / (b.frame - a.frame);
  Corners corners;
  for (size_t c = 0; c < 4; ++c)
    corners[c] = a.tag.corner_px[c] + share * (b.tag.corner_px[c] - a.tag.corner_px[c]);
  return corners;
}

/// Returns where a tag would be in a frame that does not show it; `history` is not empty.
Corners expected(const TagHistory& history, int frame) {
  if (history.size() == 1) return history.front().tag.corner_px;
  const auto after = std::ranges::upper_bound(history, frame, {}, &TagReading::frame);
  if (after == history.begin()) return on_line(history[0], history[1], frame);
  if (after == history.end())
    return on_line(history[history.size() - 2], history[history.size() - 1], frame);
  return on_line(*std::prev(after), *after, frame);
}

bool reaches_outside(const Corners& corners, const cv::Size& size) {
  constexpr double kBorder_px = 2;  // a tag needs some white around it
  return std::ranges::any_of(corners, [&](const Eigen::Vector2d& corner) {
    return corner.x() < kBorder_px || corner.x() > size.width - 1 - kBorder_px ||
           corner.y() < kBorder_px || corner.y() > size.height - 1 - kBorder_px;
  });
}

const char* reason(const TagHistory& history, const std::map<int, const char*>& reasons,
                   FramePicture picture, int frame, const cv::Size& size) {
  switch (picture) {
    case FramePicture::none:
      return missing::kNoPicture;
    case FramePicture::damaged:
      return missing::kDamaged;
    case FramePicture::dark:
      return missing::kDark;
    case FramePicture::whole:
      break;
  }
  if (history.empty()) return missing::kNeverSeen;
  if (const auto said = reasons.find(frame); said != reasons.end()) return said->second;
  return reaches_outside(expected(history, frame), size) ? missing::kOutside : missing::kUnread;
}

}  // namespace

const char* why_unread(const PredictedTag& tag, const cv::Size& size) {
  for (const Eigen::Vector2d& corner : tag.corner_px)
    if (corner.x() < 0 || corner.y() < 0 || corner.x() > size.width - 1 ||
        corner.y() > size.height - 1)
      return missing::kOutside;
  double longest_px = 0;
  for (size_t c = 0; c < 4; ++c)
    longest_px = std::max(longest_px, (tag.corner_px[(c + 1) % 4] - tag.corner_px[c]).norm());
  if (!shows_front(tag.corner_px)) return missing::kHidden;
  constexpr double kFaint = 6;  // standard deviations of noise
  if (tag.picture && tag.picture->contrast_levels < kFaint * tag.picture->most_noise_levels)
    return missing::kDark;
  constexpr double kSmeared = 0.2;  // of the side: cells run into one another
  if (tag.motion_px && tag.motion_px->norm() > kSmeared * longest_px) return missing::kBlurred;
  return missing::kCovered;
}

std::map<std::string, int> missing_frames_of(const TagHistory& history,
                                             const std::map<int, const char*>& reasons,
                                             const std::vector<FramePicture>& frames,
                                             const cv::Size& size) {
  std::map<std::string, int> count;
  for (int frame = 0; frame < static_cast<int>(frames.size()); ++frame)
    if (!std::ranges::binary_search(history, frame, {}, &TagReading::frame))
      ++count[reason(history, reasons, frames[static_cast<size_t>(frame)], frame, size)];
  return count;
}

}  // namespace clothfit
