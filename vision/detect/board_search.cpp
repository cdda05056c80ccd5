#include "vision/detect/board_search.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace clothfit {
namespace {

constexpr double kSearchedPixels = 1e6;

/// Makes the longer side the rows' one, as boards are described.
void lay_along_rows(SeenBoard& board) {
  if (board.columns >= board.rows) return;
  std::vector<Eigen::Vector2d> turned;
  for (int c = board.columns - 1; c >= 0; --c)
    for (int r = 0; r < board.rows; ++r)
      turned.push_back(board.corner_px[static_cast<size_t>(r * board.columns + c)]);
  board.corner_px = std::move(turned);
  std::swap(board.columns, board.rows);
}

}  // namespace

std::optional<SeenBoard> search_board(const cv::Mat& grey) {
  const double scale =
      std::min(1.0, std::sqrt(kSearchedPixels / static_cast<double>(grey.total())));
  cv::Mat small = grey;
  if (scale < 1) cv::resize(grey, small, {}, scale, scale, cv::INTER_AREA);
  std::vector<cv::Point2f> corners;
  cv::Mat kinds;  // one entry per corner
  const cv::Size least(kFewestFoundCorners, kFewestFoundCorners);
  if (!cv::findChessboardCornersSB(small, least, corners,
                                   cv::CALIB_CB_LARGER | cv::CALIB_CB_NORMALIZE_IMAGE, kinds))
    return std::nullopt;

  for (cv::Point2f& corner : corners) {
    // Pixel centres: (0.5, 0.5) of a cell of 1 / scale.
    corner.x = static_cast<float>((corner.x + 0.5) / scale - 0.5);
    corner.y = static_cast<float>((corner.y + 0.5) / scale - 0.5);
  }
  if (scale < 1) {
    const int half = std::max(2, static_cast<int>(std::ceil(1.5 / scale)));
    cv::cornerSubPix(grey, corners, cv::Size(half, half), cv::Size(-1, -1),
                     cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-3));
  }
  SeenBoard board{.columns = kinds.cols, .rows = kinds.rows, .corner_px = {}};
  for (const cv::Point2f& corner : corners) board.corner_px.emplace_back(corner.x, corner.y);
  lay_along_rows(board);
  return board;
}

}  // namespace clothfit
