#include "vision/look/families_shown.h"

#include <algorithm>
#include <map>

#include "vision/detect/tag_detector.h"
#include "vision/detect/tag_family.h"
#include "vision/ingest/open_images.h"

namespace clothfit {

std::vector<std::string> families_shown(const std::filesystem::path& images) {
  // Pictures that are looked at. Raised: tags are found that few pictures show, and it takes
  // longer.
  constexpr int kLooks = 6;
  // Grey levels, and tags in all pictures. Lowered: texture is taken for tags of small codes.
  constexpr double kClearMargin = 30;
  constexpr int kEnough = 2;
  std::vector<TagDetector> detectors;
  for (const std::string& family : tag_families()) detectors.emplace_back(family, 0);

  const auto source = open_images(images);
  const int stride = std::max(1, source->count() / kLooks);
  std::map<std::string, int> seen;
  cv::Mat grey;
  for (int n = 0; source->next(grey); ++n) {
    if (n % stride != stride / 2 || !source->damage().empty()) continue;
    for (size_t f = 0; f < detectors.size(); ++f)
      for (const TagDetection& tag : detectors[f].detect(grey))
        if (tag.decision_margin > kClearMargin && tag.refined && tag.shows_tag)
          ++seen[tag_families()[f]];
  }
  std::vector<std::string> families;
  for (const auto& [family, tags] : seen)
    if (tags >= kEnough || source->count() == 1) families.push_back(family);
  std::stable_sort(families.begin(), families.end(),
                   [&](const auto& a, const auto& b) { return seen.at(a) > seen.at(b); });
  return families;
}

}  // namespace clothfit
