#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "vision/ingest/image_source.h"

namespace clothfit {

/// Pictures that a study drew or changed, one frame after the other. They must outlive it.
class PicturesInMemory : public ImageSource {
 public:
  explicit PicturesInMemory(const std::vector<cv::Mat>& pictures) : pictures_(pictures) {}
  std::string current_name() const override { return fmt::format("picture {}", next_ - 1); }
  int count() const override { return static_cast<int>(pictures_.size()); }

 protected:
  bool read_next(cv::Mat& grey) override {
    if (next_ == count()) return false;
    grey = pictures_[static_cast<size_t>(next_++)];
    return true;
  }
  int own_number() const override { return next_ - 1; }
  std::string where() const override { return "pictures in memory"; }

 private:
  const std::vector<cv::Mat>& pictures_;
  int next_ = 0;
};

}  // namespace clothfit
