#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

namespace clothfit {

/// A smaller copy of a picture with steeper edges, to search for tags besides the picture.
struct SharpenedCopy {
  cv::Mat grey;                   ///< CV_8UC1
  Eigen::Vector2d pixels_across;  ///< pixels of the copy for one of the picture, along x and y
};

/// Makes the copies of a picture (CV_8UC1) in which blurred tags are found. AprilTag looks for an
/// unbroken dark border against its surroundings of some pixels. Blur of a cell or more greys that
/// border and the bits beside it. Unsharp masking, g + 2 (g - blurred g), gives them back, and
/// averaging over pixels first keeps the noise down. What the copies suggest has to be confirmed in
/// the picture: they show edges of their own. Very small pictures have none.
std::vector<SharpenedCopy> sharpened_copies(const cv::Mat& grey);

}  // namespace clothfit
