#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

namespace clothfit {

/// Pictures in order, from a folder (.jpg, .jpeg, .png, sorted by name) or a video file, as 8-bit
/// grey. All of one size.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  /// Next picture into `grey`; false after the last one. Throws InputError when a picture cannot
  /// be decoded or has another size than the first.
  virtual bool next(cv::Mat& grey) = 0;
  /// File name, or "frame N" of a video, of the picture last returned.
  virtual std::string current_name() const = 0;
  /// Number of pictures; 0 when the container does not say.
  virtual int count() const = 0;
};

/// Throws InputError when there is nothing at `path`, the folder holds no picture or the video no
/// frame.
std::unique_ptr<ImageSource> open_images(const std::filesystem::path& path);

}  // namespace clothfit
