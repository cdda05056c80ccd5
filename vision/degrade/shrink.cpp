#include "vision/degrade/shrink.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace clothfit {

cv::Mat shrunk(const cv::Mat& grey, double factor) {
  assert(factor > 0 && factor <= 1);
  const auto side = [&](int before) {
    return std::max(1, static_cast<int>(std::lround(factor * before)));
  };
  cv::Mat result;
  cv::resize(grey, result, cv::Size(side(grey.cols), side(grey.rows)), 0, 0, cv::INTER_AREA);
  return result;
}

}  // namespace clothfit
