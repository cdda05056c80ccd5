#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "data/recording.h"

namespace clothfit {

/// Finds the inner corners of a chessboard in a grey picture, row by row, to a fraction of a pixel.
/// Nothing when the whole board is not seen. Pictures of noise or fine texture cost seconds, not
/// minutes: they are searched in smaller copies, where squares of a few pixels are lost.
std::optional<std::vector<Eigen::Vector2d>> find_chessboard(const cv::Mat& grey,
                                                            const BoardDescription& board);

}  // namespace clothfit
