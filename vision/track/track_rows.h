#pragma once

#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "data/markers.h"
#include "vision/track/tag_history.h"
#include "vision/track/track_result.h"

namespace clothfit {

/// Sorts rows by frame, then by marker.
void sort_rows(Tracks2d& tracks);

/// Averages the readings of a fixed tag's corner that are not rejected, for reference point
/// `point`; nothing where there are none.
std::optional<ReferencePixel> average_corner(const TagHistory& history, size_t corner, int point);

/// Averages the corners of fixed tags that reference points name, by their place in `points`.
/// `by_tag` has the readings of each tag.
std::vector<ReferencePixel> average_reference(const std::map<int, TagHistory>& by_tag,
                                              const std::vector<ReferencePoint>& points);

/// Draws the reference points and the rows of a frame on its picture (8-bit grey).
cv::Mat draw_rows(const cv::Mat& grey, int frame, const TrackResult& result);

}  // namespace clothfit
