#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <span>
#include <vector>

#include "vision/detect/tag_detector.h"

namespace clothfit {

/// Where tags lie on a sheet: their corners, 0 bottom left, 1 bottom right, 2 top right, 3 top
/// left, in material coordinates (m).
using TagLayout = std::map<int, std::array<Eigen::Vector2d, 4>>;

/// Predicts where the tags of a sheet are that were not refined, from their neighbours that were.
/// Each place is that of a polynomial of degree 2 in material coordinates, fitted to the corners
/// read, with weights that fall with the distance over about two tags. Tags too far from what was
/// read are left out. Good to a cell of a tag between neighbours, and for one row beyond them.
std::vector<PredictedTag> predict_from_neighbours(std::span<const TagDetection> found,
                                                  const TagLayout& layout);

/// Says whether all of a refined tag is seen, by the share of its pixels that is explained.
bool seen_whole(const TagDetection& tag);

/// What a picture shows of the tags of a sheet.
struct SheetTags {
  std::vector<TagDetection> read;    ///< of the sheet and others, sorted by id
  std::vector<PredictedTag> unread;  ///< expected, and not read; sorted by id
};

/// Adds the tags of a sheet that their neighbours predict, then those that these predict, and notes
/// which stay unread.
void read_by_neighbours(TagDetector& detector, const cv::Mat& grey, const TagLayout& layout,
                        SheetTags& tags);

/// Finds the tags of a sheet: those that are read at once, then those that their neighbours
/// predict, then those that these predict.
SheetTags detect_on_sheet(TagDetector& detector, const cv::Mat& grey, const TagLayout& layout);

}  // namespace clothfit
