#include "vision/ingest/image_source.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <vector>

#include "data/input_error.h"

namespace clothfit {
namespace {

namespace fs = std::filesystem;

void refuse_other_size(const cv::Mat& grey, const cv::Size& expected, const std::string& where) {
  if (grey.size() == expected) return;
  throw InputError(where, fmt::format("the picture is {} x {}", grey.cols, grey.rows),
                   fmt::format("{} x {} as the first one", expected.width, expected.height),
                   "keep pictures of one camera and one size in a folder");
}

bool is_picture(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".jpg" || extension == ".jpeg" || extension == ".png";
}

class PictureFolder : public ImageSource {
 public:
  explicit PictureFolder(const fs::path& folder) {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder))
      if (entry.is_regular_file() && is_picture(entry.path())) files_.push_back(entry.path());
    if (files_.empty())
      throw InputError(folder.string(), "the folder holds no picture", ".jpg, .jpeg or .png files",
                       "name the folder that holds the frames themselves");
    std::sort(files_.begin(), files_.end());
  }

  bool next(cv::Mat& grey) override {
    if (next_ == files_.size()) return false;
    const fs::path& file = files_[next_];
    // A turn noted in the file's metadata is not applied. The camera file describes the sensor as
    // it is read out, and stills and video of one camera must agree.
    grey = cv::imread(file.string(), cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
    if (grey.empty())
      throw InputError(file.string(), "the picture cannot be decoded", "a whole JPEG or PNG file",
                       "copy it again or remove it");
    if (next_ == 0) size_ = grey.size();
    refuse_other_size(grey, size_, file.string());
    ++next_;
    return true;
  }

  std::string current_name() const override {
    return next_ == 0 ? std::string() : files_[next_ - 1].filename().string();
  }

  int count() const override { return static_cast<int>(files_.size()); }

 private:
  std::vector<fs::path> files_;
  size_t next_ = 0;
  cv::Size size_;
};

class VideoFile : public ImageSource {
 public:
  // The backend is named, because the others that OpenCV would try, and their output, depend on the
  // machine.
  explicit VideoFile(const fs::path& file) : file_(file.string()), capture_(file_, cv::CAP_FFMPEG) {
    capture_.set(cv::CAP_PROP_ORIENTATION_AUTO, 0);  // as for pictures
    if (!capture_.isOpened() || !capture_.read(picture_) || picture_.empty())
      throw InputError(file_, "no picture can be read from it", "a folder of pictures or a video",
                       "check that the file is whole and that a video player shows it");
    size_ = picture_.size();
    const double stated = capture_.get(cv::CAP_PROP_FRAME_COUNT);
    count_ = stated > 0 && stated < 1e9 ? static_cast<int>(stated) : 0;
  }

  bool next(cv::Mat& grey) override {
    if (frames_ > 0 && !capture_.read(picture_)) {
      // Containers round their count, so one missing picture is no sign of damage.
      if (frames_ + 1 < count_)
        throw InputError(file_, fmt::format("the video breaks off after {} frames", frames_),
                         fmt::format("{} frames as it states itself", count_), "copy it again");
      return false;
    }
    if (picture_.channels() == 1)
      picture_.copyTo(grey);
    else
      cv::cvtColor(picture_, grey, cv::COLOR_BGR2GRAY);
    ++frames_;
    refuse_other_size(grey, size_, fmt::format("{}, {}", file_, current_name()));
    return true;
  }

  std::string current_name() const override {
    return frames_ == 0 ? std::string() : fmt::format("frame {}", frames_ - 1);
  }

  int count() const override { return count_; }

 private:
  std::string file_;
  cv::VideoCapture capture_;
  cv::Mat picture_;
  cv::Size size_;
  int count_ = 0;
  int frames_ = 0;
};

}  // namespace

std::unique_ptr<ImageSource> open_images(const fs::path& path) {
  if (fs::is_directory(path)) return std::make_unique<PictureFolder>(path);
  if (!fs::exists(path))
    throw InputError(path.string(), "there is nothing at this path",
                     "a folder of pictures or a video file", "check the recording's `images`");
  return std::make_unique<VideoFile>(path);
}

}  // namespace clothfit
