#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace clothfit {

/// Returns pictures as H.264 leaves them: encoded by libx264 at a constant rate factor `crf` (0 to
/// 51; higher ones lose more) with its own defaults, and decoded again. 8-bit grey pictures of one
/// size are the luma at full range; an odd side is padded for the codec and cut off again. One
/// thread, so that the same pictures give the same bytes. Throws InputError where libavcodec was
/// built without the encoder.
std::vector<cv::Mat> through_h264(const std::vector<cv::Mat>& pictures, int crf);

}  // namespace clothfit
