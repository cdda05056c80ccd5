#include "vision/ingest/image_source.h"

#include <fmt/core.h>

#include "data/input_error.h"

namespace clothfit {

bool ImageSource::next(cv::Mat& grey) {
  if (!read_next(grey)) return false;
  if (!damage().empty()) return true;
  if (size_.empty()) size_ = grey.size();
  if (grey.size() != size_)
    throw InputError(fmt::format("{}, {}", where(), current_name()),
                     fmt::format("the picture is {} x {}", grey.cols, grey.rows),
                     fmt::format("{} x {} as the first one", size_.width, size_.height),
                     "keep pictures of one camera and one size together");
  watch_.see(grey, frame());
  if (watch_.interlaced())
    throw InputError(where(), fmt::format("the pictures are interlaced ({})", watch_.combing()),
                     kProgressive, kDeinterlace);
  return true;
}

int ImageSource::frame() const {
  return frame_of_picture_.empty() ? own_number()
                                   : frame_of_picture_.at(static_cast<size_t>(picture_index()));
}

Findings ImageSource::findings() const {
  Findings findings = own_findings();
  const Findings seen = watch_.findings(where());
  findings.insert(findings.end(), seen.begin(), seen.end());
  return findings;
}

void ImageSource::number_frames(std::vector<int> frame_of_picture) {
  frame_of_picture_ = std::move(frame_of_picture);
}

}  // namespace clothfit
