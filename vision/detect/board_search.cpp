#include "vision/detect/board_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "data/median.h"

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

/// Returns the grey levels at places spread over a field between four corners, without its rim.
std::vector<double> field_levels(const cv::Mat& grey, const SeenBoard& board, int row, int column) {
  constexpr int kPlaces = 5;
  constexpr double kRim = 0.2;
  const auto corner = [&](int r, int c) {
    return board.corner_px[static_cast<size_t>(r * board.columns + c)];
  };
  std::vector<double> levels;
  for (int i = 0; i < kPlaces; ++i)
    for (int j = 0; j < kPlaces; ++j) {
      const double down = kRim + (1 - 2 * kRim) * i / (kPlaces - 1),
                   right = kRim + (1 - 2 * kRim) * j / (kPlaces - 1);
      const Eigen::Vector2d at =
          (1 - down) * ((1 - right) * corner(row, column) + right * corner(row, column + 1)) +
          down * ((1 - right) * corner(row + 1, column) + right * corner(row + 1, column + 1));
      const int u = std::clamp(static_cast<int>(std::lround(at.x())), 0, grey.cols - 1),
                v = std::clamp(static_cast<int>(std::lround(at.y())), 0, grey.rows - 1);
      levels.push_back(grey.at<std::uint8_t>(v, u));
    }
  return levels;
}

/// Says whether the fields between corners are dark and bright in turn, each of one shade. Grids of
/// tags have corners like a board's, and prints between them.
bool is_chessboard(const cv::Mat& grey, const SeenBoard& board) {
  constexpr double kOneShade = 0.85;  // share of a field on its side of the middle level
  constexpr double kFields = 0.8;     // share of the fields; a hand or a highlight may hide some
  constexpr double kContrast = 8;     // grey levels
  const int columns = board.columns - 1, rows = board.rows - 1;
  std::vector<std::vector<double>> levels;
  std::vector<double> middle;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      levels.push_back(field_levels(grey, board, r, c));
      middle.push_back(median(levels.back()));
    }
  const auto at = [&](int r, int c) { return static_cast<size_t>(r * columns + c); };
  std::array<int, 2> good{};  // by the colour of the first field
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      double around = 0;
      int count = 0;
      for (const auto& [dr, dc] :
           {std::pair(0, 1), std::pair(0, -1), std::pair(1, 0), std::pair(-1, 0)})
        if (r + dr >= 0 && r + dr < rows && c + dc >= 0 && c + dc < columns) {
          around += middle[at(r + dr, c + dc)];
          ++count;
        }
      around /= count;
      const double own = middle[at(r, c)], limit = 0.5 * (own + around);
      if (std::abs(own - around) < kContrast) continue;
      const auto same = std::ranges::count_if(
          levels[at(r, c)], [&](double level) { return (level > limit) == (own > limit); });
      if (static_cast<double>(same) < kOneShade * static_cast<double>(levels[at(r, c)].size()))
        continue;
      ++good[static_cast<size_t>((r + c + (own > around ? 1 : 0)) % 2)];
    }
  return std::max(good[0], good[1]) > kFields * rows * columns;
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
  if (!is_chessboard(grey, board)) return std::nullopt;
  return board;
}

}  // namespace clothfit
