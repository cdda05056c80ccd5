#include "apps/steps/picture_size.h"

#include <fmt/format.h>

#include <opencv2/core.hpp>

#include "data/input_error.h"
#include "vision/ingest/open_images.h"

namespace clothfit {

PictureSize picture_size(const std::filesystem::path& images) {
  const std::unique_ptr<ImageSource> source = open_images(images);
  cv::Mat grey;
  while (source->next(grey))
    if (source->damage().empty()) return {grey.cols, grey.rows};
  throw InputError(images.string(), "holds no whole picture", "a folder of pictures or a video",
                   "copy it again");
}

std::string to_string(const PictureSize& size) {
  return fmt::format("{} x {} px", size.width, size.height);
}

}  // namespace clothfit
