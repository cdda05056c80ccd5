#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

namespace clothfit {

/// Scales the grey levels of an 8-bit picture and adds normal noise of that standard deviation, as
/// a sensor with too little light does. Values end at 0 and 255. A factor of 1 adds noise alone.
cv::Mat with_brightness(const cv::Mat& grey, double factor, double noise_levels,
                        std::uint64_t seed);

}  // namespace clothfit
