#include "vision/degrade/brightness.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <random>

namespace clothfit {

cv::Mat with_brightness(const cv::Mat& grey, double factor, double noise_levels,
                        std::uint64_t seed) {
  assert(grey.type() == CV_8UC1);
  std::mt19937_64 rng(seed);
  std::normal_distribution<float> noise(0, 1);
  cv::Mat result(grey.size(), CV_8UC1);
  for (int v = 0; v < grey.rows; ++v) {
    const std::uint8_t* from = grey.ptr<std::uint8_t>(v);
    std::uint8_t* to = result.ptr<std::uint8_t>(v);
    for (int u = 0; u < grey.cols; ++u) {
      const double level = factor * from[u] + noise_levels * noise(rng);
      to[u] = static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L));
    }
  }
  return result;
}

}  // namespace clothfit
