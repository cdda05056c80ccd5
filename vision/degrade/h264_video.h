#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

namespace clothfit {

/// Writes pictures as a video of H.264, encoded as by through_h264 (vision/degrade/h264.h). The
/// ending of the file's name says its container, .mp4 or .mkv; .mp4 keeps times to 1/90000 s.
/// `times_s` has a time (s, >= 0, rising) for each picture; their distances may differ. Pictures
/// are 8-bit grey, of one size; an odd side is padded by a pixel. Throws InputError where
/// libavcodec lacks the encoder or the file cannot be written.
void write_h264_video(const std::vector<cv::Mat>& pictures, const std::vector<double>& times_s,
                      int crf, const std::filesystem::path& file);

}  // namespace clothfit
