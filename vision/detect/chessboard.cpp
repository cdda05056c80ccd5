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

/// Quadrilaterals beside the board's that a search takes in. It compares each with each, a hundred
/// times: a thousand cost a second.
constexpr int kMostOthers = 1000;

/// Says whether an outline is a quadrilateral to within some pixels, as the search takes it.
bool is_quadrilateral(const std::vector<cv::Point>& outline) {
  constexpr int kLeastArea_px2 = 25;
  constexpr int kCoarsest_px = 7;
  if (cv::boundingRect(outline).area() < kLeastArea_px2) return false;
  std::vector<cv::Point> polygon;
  for (int tolerance_px = 1; tolerance_px <= kCoarsest_px; ++tolerance_px) {
    cv::approxPolyDP(outline, polygon, tolerance_px, true);
    if (polygon.size() == 4) return cv::isContourConvex(polygon);
  }
  return false;
}

/// Says whether a picture of black and white has more dark quadrilaterals than the search can take
/// in.
bool has_too_many_quadrilaterals(cv::Mat light, int most) {
  constexpr int kMostDilations = 2;  // further ones leave fewer
  for (int dilations = 0; dilations <= kMostDilations; ++dilations) {
    if (dilations > 0) cv::dilate(light, light, cv::Mat());
    std::vector<std::vector<cv::Point>> outlines;
    std::vector<cv::Vec4i> relations;
    cv::findContours(light, outlines, relations, cv::RETR_CCOMP, cv::CHAIN_APPROX_SIMPLE);
    int count = 0;
    for (size_t i = 0; i < outlines.size(); ++i) {
      const bool is_dark = relations[i][3] >= 0;  // a hole in what is light
      if (is_dark && is_quadrilateral(outlines[i]) && ++count > most) return true;
    }
  }
  return false;
}

/// Returns a picture's pixels that are lighter than their neighbourhood.
cv::Mat lighter_than_around(const cv::Mat& grey) {
  constexpr double kNeighbourhood = 0.2;  // of the shorter side
  const int window =
      std::max(3, static_cast<int>(kNeighbourhood * std::min(grey.cols, grey.rows)) | 1);
  cv::Mat light;
  cv::adaptiveThreshold(grey, light, 255, cv::ADAPTIVE_THRESH_MEAN_C, cv::THRESH_BINARY, window, 0);
  return light;
}

/// Returns a picture's pixels that are lighter than one level for all of it.
cv::Mat lighter_than_most(const cv::Mat& grey) {
  cv::Mat light;
  cv::threshold(grey, light, 0, 255, cv::THRESH_BINARY | cv::THRESH_OTSU);
  return light;
}

/// Finds the corners to about a pixel. Against a neighbourhood, the noise of a plain wall is full
/// of quadrilaterals; one level for all has none there. Fine texture and noise of all levels are
/// searched in smaller copies, which average them out.
std::optional<std::vector<cv::Point2f>> search_corners(const cv::Mat& grey, cv::Size pattern) {
  constexpr int kSmallestSquare_px = 4;
  cv::Mat copy = grey;
  float scale = 1;
  const int most = kMostOthers + ((pattern.width + 1) * (pattern.height + 1) + 1) / 2;
  std::vector<cv::Point2f> corners;
  const auto finds = [&](int flags) {
    return cv::findChessboardCorners(copy, pattern, corners, flags | cv::CALIB_CB_NORMALIZE_IMAGE);
  };
  while (true) {
    const bool is_plain = !has_too_many_quadrilaterals(lighter_than_around(copy), most);
    if (is_plain && !finds(cv::CALIB_CB_ADAPTIVE_THRESH)) return std::nullopt;
    if (is_plain || (!has_too_many_quadrilaterals(lighter_than_most(copy), most) && finds(0)))
      break;
    cv::Mat smaller;
    cv::pyrDown(copy, smaller);
    copy = smaller;
    scale *= 2;
    if (std::min(copy.cols, copy.rows) <
        kSmallestSquare_px * std::min(pattern.width, pattern.height))
      return std::nullopt;
  }
  // The middle of a pixel of the copy is the middle of a pixel of the picture.
  for (cv::Point2f& corner : corners) corner *= scale;
  return corners;
}

}  // namespace

std::optional<std::vector<Eigen::Vector2d>> find_chessboard(const cv::Mat& grey,
                                                            const BoardDescription& board) {
  if (!is_possible(board))
    throw InputError(
        "board", fmt::format("{} x {} inner corners", board.columns, board.rows),
        fmt::format("{} to {} along each side", kFewestBoardCorners, kMostBoardCorners),
        "count where four squares meet");
  std::optional<std::vector<cv::Point2f>> found =
      search_corners(grey, cv::Size(board.columns, board.rows));
  if (!found) return std::nullopt;
  std::vector<cv::Point2f>& corners = *found;

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
