#include "vision/track/what_appears.h"

#include <fmt/core.h>

#include <algorithm>

#include "vision/detect/tag_detector.h"
#include "vision/detect/tag_family.h"
#include "vision/ingest/frame_list.h"

namespace clothfit {
namespace {

/// Fewer tags may be chance readings of a small code, and so may be weaker ones (grey levels).
constexpr size_t kEnough = 3;
constexpr double kClearMargin = 30;

std::string list(const std::set<int>& ids) {
  return list_numbers({ids.begin(), ids.end()});
}

std::set<int> clear_tags(const cv::Mat& grey, const std::string& family) {
  std::set<int> ids;
  for (const TagDetection& tag : TagDetector(family, 0).detect(grey))
    if (tag.decision_margin > kClearMargin && tag.shows_tag) ids.insert(tag.id);
  return ids;
}

}  // namespace

std::string turned_picture_shows(const cv::Mat& grey, const std::string& family,
                                 const std::set<int>& listed) {
  const auto shows_listed = [&](const cv::Mat& picture, std::set<int>& ids) {
    ids = clear_tags(picture, family);
    if (listed.empty()) return ids.size() >= kEnough;
    size_t known = 0;
    for (const int id : ids) known += listed.count(id);
    return known >= std::min(kEnough, listed.size()) && 2 * known > ids.size();
  };
  std::set<int> ids;
  cv::Mat turned;
  cv::flip(grey, turned, 1);
  if (shows_listed(turned, ids))
    return fmt::format(
        "the mirrored picture shows tags {}: switch mirroring off in the camera, or "
        "mirror the footage back",
        list(ids));
  if (shows_listed(255 - grey, ids))
    return fmt::format(
        "with black and white exchanged the picture shows tags {}: give the "
        "footage as the camera sees it, or print the tags black on white",
        list(ids));
  return "";
}

std::string what_appears_instead(const cv::Mat& grey, const std::string& family,
                                 const std::set<int>& listed, const std::set<int>& unlisted) {
  if (!unlisted.empty())
    return fmt::format("tags {} of that family do appear: check markers.csv", list(unlisted));
  if (const std::string turned = turned_picture_shows(grey, family, listed); !turned.empty())
    return turned;
  for (const std::string& other : tag_families()) {
    if (other == family) continue;
    const std::set<int> ids = clear_tags(grey, other);
    if (ids.size() >= kEnough)
      return fmt::format("the first picture shows tags {} of {}: set that family in recording.yaml",
                         list(ids), other);
  }
  return "check the camera's `images`, the light, and that a tag is 30 pixels wide or more";
}

}  // namespace clothfit
