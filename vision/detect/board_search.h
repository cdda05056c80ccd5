#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace clothfit {

/// Number of inner corners along a side from which a board is found.
inline constexpr int kFewestFoundCorners = 4;

/// A chessboard that a picture shows, of a size that was not told.
struct SeenBoard {
  int columns = 0, rows = 0;               ///< inner corners that are seen; columns >= rows
  std::vector<Eigen::Vector2d> corner_px;  ///< row by row
};

/// Looks for a chessboard of any size from 4 x 4 inner corners on in an 8-bit grey picture. A board
/// that is seen in part counts with the largest grid that is; one whose fields are not of one shade
/// each, dark and bright in turn, is none. Pictures of more than a megapixel are
/// searched at a smaller size; corners are placed in the picture itself.
std::optional<SeenBoard> search_board(const cv::Mat& grey);

}  // namespace clothfit
