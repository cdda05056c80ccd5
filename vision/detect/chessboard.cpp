#include "vision/detect/chessboard.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "data/input_error.h"

namespace clothfit {
namespace {

/// Returns the smallest distance of neighbours in the grid.
double smallest_spacing_px(const std::vector<cv::Point2f>& corners, int columns, int rows) {
  double smallest = INFINITY;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const cv::Point2f& here = corners[static_cast<size_t>(r * columns + c)];
      if (c + 1 < columns)
        smallest =
            std::min(smallest, cv::norm(corners[static_cast<size_t>(r * columns + c + 1)] - here));
      if (r + 1 < rows)
        smallest = std::min(smallest,
                            cv::norm(corners[static_cast<size_t>((r + 1) * columns + c)] - here));
    }
  }
  return smallest;
}

/// Says whether columns (right) and rows (down) turn as on a board seen from its front. y of the
/// picture points down.
bool turns_like_the_board(const std::vector<cv::Point2f>& corners, int columns, int rows) {
  const auto at = [&](int r, int c) { return corners[static_cast<size_t>(r * columns + c)]; };
  const cv::Point2f along_row = at(0, columns - 1) - at(0, 0);
  const cv::Point2f along_column = at(rows - 1, 0) - at(0, 0);
  return along_row.cross(along_column) > 0;
}

}  // namespace

std::optional<std::vector<Eigen::Vector2d>> find_chessboard(const cv::Mat& grey,
                                                            const BoardDescription& board) {
  if (!is_possible(board))
    throw InputError(
        "board", fmt::format("{} x {} inner corners", board.columns, board.rows),
        fmt::format("{} to {} along each side", kFewestBoardCorners, kMostBoardCorners),
        "count where four squares meet");
  std::vector<cv::Point2f> corners;
  const cv::Size pattern(board.columns, board.rows);
  const int flags = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE;
  if (!cv::findChessboardCorners(grey, pattern, corners, flags)) return std::nullopt;

  // The window takes in as much of the four edges as it can without touching the next corner.
  const double spacing_px = smallest_spacing_px(corners, board.columns, board.rows);
  const int half = std::clamp(static_cast<int>(std::floor(0.35 * spacing_px)), 2, 15);
  cv::cornerSubPix(grey, corners, cv::Size(half, half), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-3));

  // Seen from the front the grid cannot be mirrored, so a mirrored one has each row reversed.
  if (!turns_like_the_board(corners, board.columns, board.rows)) {
    for (int r = 0; r < board.rows; ++r) {
      const auto begin = corners.begin() + r * board.columns;
      std::reverse(begin, begin + board.columns);
    }
  }
  // Two readings differ by half a turn: the one that starts nearer the top left is taken.
  const cv::Point2f across = corners.back() - corners.front();
  if (across.x + across.y < 0) std::reverse(corners.begin(), corners.end());

  std::vector<Eigen::Vector2d> result;
  result.reserve(corners.size());
  for (const cv::Point2f& corner : corners) result.emplace_back(corner.x, corner.y);
  return result;
}

}  // namespace clothfit
