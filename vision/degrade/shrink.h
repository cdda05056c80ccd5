#pragma once

#include <opencv2/core.hpp>

namespace clothfit {

/// Shrinks a picture by averaging over areas. `factor` is in (0, 1]; the sides are rounded to whole
/// pixels. A place p of the picture lies at shrunk_place(p) of the shrunk one.
cv::Mat shrunk(const cv::Mat& grey, double factor);

/// Returns where a place along one side of `before` px lies once the side has `after` px.
inline double shrunk_place(double place_px, int before, int after) {
  return (place_px + 0.5) * after / before - 0.5;
}

}  // namespace clothfit
