#include "vision/print/printed_sheet.h"

#include <apriltag/apriltag.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "data/input_error.h"
#include "vision/detect/tag_family.h"

namespace clothfit {
namespace {

void require_length(const char* option, double value_m, double most_m) {
  constexpr double kLeast_m = 1e-3;
  if (!(value_m >= kLeast_m && value_m <= most_m))
    throw InputError(option, fmt::format("{} m", value_m),
                     fmt::format("a length of {} to {} m", kLeast_m, most_m),
                     "lengths are in metres: 20 mm is 0.02, or 20mm where a unit is taken");
}

/// Adds a tag's black cells; neighbours in a row are one rectangle.
void add_tag(const TagPattern& pattern, const Eigen::Vector2d& top_left_m, double cell_m,
             PrintedSheet& sheet) {
  const int cells = pattern.total_cells;
  const auto black = [&](int row, int column) {
    return column < cells && pattern.white[static_cast<size_t>(row * cells + column)] < 0.5F;
  };
  for (int row = 0; row < cells; ++row)
    for (int column = 0; column < cells; ++column) {
      if (!black(row, column)) continue;
      const int first = column;
      while (black(row, column + 1)) ++column;
      sheet.rectangles.push_back({top_left_m + cell_m * Eigen::Vector2d(first, row),
                                  top_left_m + cell_m * Eigen::Vector2d(column + 1, row + 1)});
    }
}

/// Adds the corners of a tag's border, in their order.
void add_markers(int id, const Eigen::Vector2d& low_m, const Eigen::Vector2d& high_m,
                 PrintedSheet& sheet) {
  const Eigen::Vector2d corners_m[4] = {
      {low_m.x(), high_m.y()}, high_m, {high_m.x(), low_m.y()}, low_m};
  for (int corner = 0; corner < 4; ++corner)
    sheet.markers.markers.push_back({.name = fmt::format("t{}_{}", id, corner),
                                     .s_m = corners_m[corner].x(),
                                     .t_m = corners_m[corner].y(),
                                     .tag = id,
                                     .corner = corner});
}

}  // namespace

PrintedSheet make_tag_sheet(const TagSheetOptions& options) {
  constexpr double kLargest_m = 10;
  require_length("width", options.width_m, kLargest_m);
  require_length("height", options.height_m, kLargest_m);
  if (options.columns < 1 || options.rows < 1)
    throw InputError("tags", fmt::format("{} x {}", options.columns, options.rows),
                     "columns and rows of tags, 1 or more each");
  const TagFamily family = make_tag_family(options.family);
  const std::int64_t count = std::int64_t{options.columns} * options.rows;
  if (options.first_id < 0 || options.first_id + count > family->ncodes)
    throw InputError("first_id", fmt::format("{} tags from {} on", count, options.first_id),
                     fmt::format("ids within 0 to {} of {}", family->ncodes - 1, options.family),
                     "fewer tags, or another family");

  const Eigen::Vector2d share_m(options.width_m / options.columns, options.height_m / options.rows);
  const int border = family->width_at_border, total = family->total_width;
  const double most_m = share_m.minCoeff() * border / total;
  constexpr double kOfMost = 0.9;
  if (options.tag_m != 0) require_length("tag", options.tag_m, kLargest_m);
  const double tag_m = options.tag_m > 0 ? options.tag_m : kOfMost * most_m;
  if (tag_m > most_m * (1 + 1e-9))
    throw InputError("tag",
                     fmt::format("tags of {:.4g} m with their white margin do not fit", tag_m),
                     fmt::format("{:.4g} m at most, {} x {} on {} x {} m", most_m, options.columns,
                                 options.rows, options.width_m, options.height_m),
                     "smaller or fewer tags");

  PrintedSheet sheet{.name = fmt::format("tags_{}x{}", options.columns, options.rows),
                     .width_m = options.width_m,
                     .height_m = options.height_m,
                     .share_m = share_m};
  sheet.markers.kind = MarkerKind::apriltag;
  sheet.markers.family = options.family;
  const double cell_m = tag_m / border;
  for (int row = 0; row < options.rows; ++row)
    for (int column = 0; column < options.columns; ++column) {
      const int id = options.first_id + row * options.columns + column;
      const Eigen::Vector2d middle_m =
          share_m.cwiseProduct(Eigen::Vector2d(column + 0.5, row + 0.5));
      const Eigen::Vector2d half = Eigen::Vector2d::Ones() / 2;
      add_tag(printed_tag(*family, id), middle_m - total * cell_m * half, cell_m, sheet);
      add_markers(id, middle_m - tag_m * half, middle_m + tag_m * half, sheet);
    }
  return sheet;
}

PrintedSheet make_board_sheet(const BoardDescription& board) {
  if (!is_possible(board))
    throw InputError("board",
                     fmt::format("{} x {} inner corners, fields of {} m", board.columns, board.rows,
                                 board.square_m),
                     fmt::format("{} to {} inner corners along each side", kFewestBoardCorners,
                                 kMostBoardCorners));
  constexpr double kLargest_m = 0.5;
  require_length("square", board.square_m, kLargest_m);
  constexpr double kMargin = 0.25;  // of a field; the paper around it is white too
  const int across = board.columns + 1, down = board.rows + 1;
  PrintedSheet sheet{.name = fmt::format("board_{}x{}", board.columns, board.rows),
                     .width_m = (across + 2 * kMargin) * board.square_m,
                     .height_m = (down + 2 * kMargin) * board.square_m};
  for (int row = 0; row < down; ++row)
    for (int column = row % 2; column < across; column += 2) {
      const Eigen::Vector2d low_m =
          board.square_m * Eigen::Vector2d(column + kMargin, row + kMargin);
      sheet.rectangles.push_back({low_m, low_m + board.square_m * Eigen::Vector2d::Ones()});
    }
  return sheet;
}

}  // namespace clothfit
