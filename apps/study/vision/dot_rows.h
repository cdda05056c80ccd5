#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "apps/study/vision/tag_score.h"
#include "vision/degrade/displacement_field.h"

namespace clothfit {

/// Changes a picture, given how its dots move from frame to frame.
using PictureSpoil = std::function<cv::Mat(
    const cv::Mat& grey, const std::vector<PointMotion>& motions, std::uint64_t seed)>;

/// Ways to spoil: none, noise of that standard deviation, and blur along the motion, scaled so that
/// its median is `length_px`, with the sensor's noise on top.
PictureSpoil untouched();
PictureSpoil with_noise(double noise_levels);
PictureSpoil blurred_by(double length_px);

/// Tracks all pictures of one camera of a recording of dots, spoiled, and judges every row of a dot
/// by truth_tracks2d_CAMERA.csv.gz. A row that is 3 px off or more counts as a false identity, in
/// `false_tags`. Throws InputError where a file is not there.
TagScore score_dots(const std::filesystem::path& folder, const std::string& camera,
                    const PictureSpoil& spoil, std::uint64_t seed);

}  // namespace clothfit
