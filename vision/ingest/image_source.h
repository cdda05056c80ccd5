#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

namespace clothfit {

/// Gives pictures of one size in order, as 8-bit grey, from a folder or a video file. A folder's
/// pictures are .jpg, .jpeg or .png, sorted by name.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  /// Reads the next picture into `grey`; false after the last one. Throws InputError when a picture
  /// cannot be decoded or has another size than the first.
  virtual bool next(cv::Mat& grey) = 0;
  /// Returns the file name, or "frame N" of a video, of the picture last returned.
  virtual std::string current_name() const = 0;
  /// Returns the number of pictures; 0 when the container does not say.
  virtual int count() const = 0;
};

/// Opens a folder or a video. Throws InputError when there is nothing at `path`, the folder holds
/// no picture or the video no frame.
std::unique_ptr<ImageSource> open_images(const std::filesystem::path& path);

}  // namespace clothfit
