#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "data/recording.h"
#include "vision/texture/texture_layout.h"

namespace clothfit {

/// Finds where the markers of a textured sheet lie in the picture of frame 0, one place a marker.
///
/// A marker with a row of frame 0 in the camera's table of `observations: tracks2d` lies there. One
/// that is the corner of a tag lies where the picture shows the corner. The others lie where the
/// homography of a flat sheet through these leads, with the camera's distortion where it has a
/// file; that needs `start: released_flat`. Sigma of a row that states none is 0: its pixel defines
/// the marker.
///
/// Throws InputError where markers are left without a place, where fewer than four lead to them, or
/// where these contradict a flat sheet.
std::vector<FirstPlace> find_first_places(const Recording& recording, const CameraEntry& camera,
                                          const cv::Mat& grey);

}  // namespace clothfit
