#pragma once

#include <filesystem>

#include "apps/study/vision/tag_score.h"

namespace clothfit {

/// Judges photos of a room by the ids listed in groundtruth.txt. `visible` and `found` count tags
/// here; places are not judged.
TagScore score_room(const std::filesystem::path& folder);

/// Judges shrunk copies of a photo of 40 tags by the places found in the photo itself, whose errors
/// are smaller by the factor that the copies are shrunk by. `side_ratio` is the mean side of the
/// tags in each copy over that in the photo, both in pixels of the photo.
struct SheetScore {
  TagScore score;
  std::vector<double> side_ratio;
};
SheetScore score_sheet(const std::filesystem::path& folder);

/// Counts tags that are accepted in pictures that show none of the family.
TagScore score_false_tags(const std::filesystem::path& folder);

}  // namespace clothfit
