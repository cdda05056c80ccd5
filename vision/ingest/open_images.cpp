#include "vision/ingest/open_images.h"

#include "data/input_error.h"
#include "vision/ingest/decode_picture.h"
#include "vision/ingest/picture_folder.h"
#include "vision/ingest/video_file.h"

namespace clothfit {

std::unique_ptr<ImageSource> open_images(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path)) return open_picture_folder(path);
  if (!std::filesystem::exists(path))
    throw InputError(path.string(), "there is nothing at this path",
                     "a folder of pictures, a picture or a video",
                     "check the recording's `images`");
  if (is_picture(path)) return open_picture(path);
  return open_video(path);
}

}  // namespace clothfit
