#include "vision/ingest/open_images.h"

#include <system_error>

#include "data/input_error.h"
#include "vision/ingest/picture_content.h"
#include "vision/ingest/picture_folder.h"
#include "vision/ingest/video_file.h"

namespace clothfit {

std::unique_ptr<ImageSource> open_images(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return open_picture_folder(path);
  if (error && error != std::errc::no_such_file_or_directory)
    throw InputError(path.string(), "cannot be looked at: " + error.message(),
                     "a folder of pictures, a picture or a video",
                     "give yourself the right to read it, or copy it");
  if (!std::filesystem::exists(path, error))
    throw InputError(path.string(), "there is nothing at this path",
                     "a folder of pictures, a picture or a video",
                     "check the recording's `images`");
  const PictureContent::Kind kind = content_of_file(path).kind;
  using Kind = PictureContent::Kind;
  const bool picture = kind == Kind::picture || kind == Kind::foreign;
  const bool named = has_picture_name(path) || has_foreign_picture_name(path);
  if (picture || (named && kind != Kind::video)) return open_picture(path);
  return open_video(path);
}

}  // namespace clothfit
