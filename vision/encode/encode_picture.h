#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>

namespace clothfit {

/// Returns a PNG file of 8 or 16 bits, grey (one channel) or colour (three, in the order blue,
/// green, red). Compressed for speed.
std::string encode_png(const cv::Mat& picture);

/// Writes `encode_png` of a picture. Throws InputError where the file cannot be written.
void write_png(const cv::Mat& picture, const std::filesystem::path& file);

/// Returns a JPEG file of an 8-bit grey picture; `quality` from 1 to 100.
std::string encode_jpeg(const cv::Mat& grey, int quality);

}  // namespace clothfit
