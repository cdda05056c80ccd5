#include "apps/study/vision/photo_sets.h"

#include <fmt/format.h>

#include <set>
#include <sstream>

#include "data/input_error.h"
#include "data/text_file.h"
#include "vision/track/tag_history.h"
#include "vision/track/track_options.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFamily = "tag36h11";
constexpr int kSheetTags = 40;

/// Returns the ids of tags of which a corner would be accepted.
std::set<int> accepted_tags(const cv::Mat& grey) {
  std::set<int> ids;
  for (const TagDetection& tag : TagDetector(kFamily).detect(grey)) {
    TagHistory alone{{.frame = 0, .tag = tag, .rejected = {}}};
    judge(alone, TrackOptions(), grey.size());
    if (alone.front().good()) ids.insert(tag.id);
  }
  return ids;
}

double mean_side(const std::vector<JudgedCorner>& corners) {
  // Four corners of a tag follow each other.
  double sum = 0;
  for (size_t i = 0; i < corners.size(); ++i) {
    const size_t next = i % 4 == 3 ? i - 3 : i + 1;
    sum += (corners[next].truth.pixel_px - corners[i].truth.pixel_px).norm();
  }
  return sum / static_cast<double>(corners.size());
}

std::vector<JudgedCorner> corners_of(const std::vector<TagDetection>& tags) {
  std::vector<JudgedCorner> corners;
  for (const TagDetection& tag : tags)
    for (int c = 0; c < 4; ++c)
      corners.push_back({.truth = {.tag = tag.id,
                                   .corner = c,
                                   .pixel_px = tag.corner_px[static_cast<size_t>(c)],
                                   .visible = true}});
  return corners;
}

}  // namespace

TagScore score_room(const fs::path& folder) {
  TagScore score;
  std::istringstream lines(read_text(folder / "groundtruth.txt"));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name;
    if (!(words >> name)) continue;
    const std::set<int> found = accepted_tags(read_grey(folder / name));
    std::set<int> shown;
    for (int id = 0; words >> id;) shown.insert(id);
    score.visible += static_cast<int>(shown.size());
    for (const int id : found) (shown.contains(id) ? score.found : score.false_tags) += 1;
  }
  return score;
}

SheetScore score_sheet(const fs::path& folder) {
  const cv::Mat photo = read_grey(folder / "taggridphoto.jpg");
  TagDetector detector(kFamily);
  const std::vector<TagDetection> in_photo = detector.detect(photo);
  if (in_photo.size() != kSheetTags)
    throw InputError(folder.string(),
                     fmt::format("{} tags are found in the photo", in_photo.size()), "40");
  const std::vector<JudgedCorner> corners = corners_of(in_photo);
  const double side = mean_side(corners);
  SheetScore result;
  struct Copy {
    const char* name;
    double factor;
  };
  for (const auto& [name, factor] :
       {Copy{"down_1_8.png", 1.0 / 8}, {"down_1_16.png", 1.0 / 16}, {"down_1_20.png", 1.0 / 20}}) {
    const cv::Mat copy = read_grey(folder / name);
    std::vector<JudgedCorner> truth = corners;
    // Of shrunk_place, whose sides are whole pixels, this is the exact form.
    for (JudgedCorner& corner : truth)
      corner.truth.pixel_px = factor * (corner.truth.pixel_px.array() + 0.5) - 0.5;
    const std::vector<TagDetection> tags = detector.detect(copy);
    result.score.add(score_tags(tags, truth, {}, copy.size()));
    if (!tags.empty()) result.side_ratio.push_back(mean_side(corners_of(tags)) / factor / side);
  }
  return result;
}

TagScore score_false_tags(const fs::path& folder) {
  TagScore score;
  for (const fs::path& file : picture_files(folder))
    score.false_tags += static_cast<int>(accepted_tags(read_grey(file)).size());
  return score;
}

}  // namespace clothfit
