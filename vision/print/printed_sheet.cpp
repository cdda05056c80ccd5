#include "vision/print/printed_sheet.h"

#include <apriltag/apriltag.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "data/input_error.h"
#include "vision/detect/board_search.h"
#include "vision/detect/dot_pattern.h"
#include "vision/detect/tag_family.h"

namespace clothfit {
namespace {

constexpr double kLargestCloth_m = 10;

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
  require_length("SheetOptions::width_m", options.width_m, kLargestCloth_m);
  require_length("SheetOptions::height_m", options.height_m, kLargestCloth_m);
  if (options.columns < 1 || options.rows < 1)
    throw InputError("TagSheetOptions::columns",
                     fmt::format("{} x {}", options.columns, options.rows),
                     "columns and rows of tags, 1 or more each");
  const TagFamily family = make_tag_family(options.family);
  const std::int64_t count = std::int64_t{options.columns} * options.rows;
  if (options.first_id < 0 || options.first_id + count > family->ncodes)
    throw InputError("TagSheetOptions::first_id",
                     fmt::format("{} tags from {} on", count, options.first_id),
                     fmt::format("ids within 0 to {} of {}", family->ncodes - 1, options.family),
                     "fewer tags, or another family");

  const Eigen::Vector2d share_m(options.width_m / options.columns, options.height_m / options.rows);
  const int border = family->width_at_border, total = family->total_width;
  const double most_m = share_m.minCoeff() * border / total;
  constexpr double kOfMost = 0.9;
  if (options.tag_m != 0) require_length("TagSheetOptions::tag_m", options.tag_m, kLargestCloth_m);
  const double tag_m = options.tag_m > 0 ? options.tag_m : kOfMost * most_m;
  if (tag_m > most_m * (1 + 1e-9))
    throw InputError("TagSheetOptions::tag_m",
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

std::pair<int, int> usual_dot_grid(double width_m, double height_m) {
  constexpr int kLonger = 16, kFewest = 3;
  const double spacing_m = std::max(width_m, height_m) / kLonger;
  const auto along = [&](double length_m) {
    constexpr double kRounding = 1e-9;
    return std::max(kFewest, static_cast<int>(length_m / spacing_m + kRounding));
  };
  return {along(width_m), along(height_m)};
}

PrintedSheet make_dot_sheet(const DotSheetOptions& options) {
  require_length("SheetOptions::width_m", options.width_m, kLargestCloth_m);
  require_length("SheetOptions::height_m", options.height_m, kLargestCloth_m);
  if (std::min(options.columns, options.rows) < kFewestPatternDots ||
      std::max(options.columns, options.rows) > kMostPatternDots)
    throw InputError("DotSheetOptions::columns",
                     fmt::format("{} x {} dots", options.columns, options.rows),
                     fmt::format("{} to {} along each side", kFewestPatternDots, kMostPatternDots));
  const Eigen::Vector2d size_m(options.width_m, options.height_m),
      count(options.columns, options.rows);
  const double spacing_m = size_m.cwiseQuotient(count).minCoeff();
  constexpr double kSmallestDot_m = 1e-3, kRounding = 1e-9;
  const double smallest_m = 2 * spacing_m * dot_radius_over_spacing(0);
  if (smallest_m < kSmallestDot_m)
    throw InputError("DotSheetOptions::columns",
                     fmt::format("the smallest dots would be {:.2g} mm wide", 1e3 * smallest_m),
                     fmt::format("{} mm or more", 1e3 * kSmallestDot_m), "fewer dots");
  const Eigen::Vector2d fits = (size_m / spacing_m).array() + kRounding;
  if (static_cast<int>(fits.x()) > options.columns || static_cast<int>(fits.y()) > options.rows)
    throw InputError(
        "DotSheetOptions::columns",
        fmt::format("{} x {} dots leave a part of {} x {} m bare", options.columns, options.rows,
                    options.width_m, options.height_m),
        "dots as far apart across the cloth as down it",
        fmt::format("such as {}x{}", static_cast<int>(fits.x()), static_cast<int>(fits.y())));
  const DotPattern pattern = make_dot_pattern(options.columns, options.rows);
  PrintedSheet sheet{.name = fmt::format("dots_{}x{}", options.columns, options.rows),
                     .width_m = options.width_m,
                     .height_m = options.height_m,
                     .share_m = {spacing_m, spacing_m},
                     .bare_m = (size_m - spacing_m * count) / 2};
  sheet.markers.kind = MarkerKind::dots;
  for (int row = 0; row < options.rows; ++row)
    for (int column = 0; column < options.columns; ++column) {
      const Eigen::Vector2d place_m =
          sheet.bare_m + spacing_m * Eigen::Vector2d(column + 0.5, row + 0.5);
      sheet.discs.push_back(
          {.centre_m = place_m,
           .radius_m = spacing_m * dot_radius_over_spacing(pattern.symbol(row, column))});
      sheet.markers.markers.push_back({.name = dot_name(row, column),
                                       .s_m = place_m.x(),
                                       .t_m = place_m.y(),
                                       .tag = {},
                                       .corner = {}});
    }
  return sheet;
}

PrintedSheet make_board_sheet(const BoardDescription& board) {
  // Smaller ones are taken for a part of something larger (search_board).
  if (std::min(board.columns, board.rows) < kFewestFoundCorners ||
      std::max(board.columns, board.rows) > kMostBoardCorners)
    throw InputError("BoardSheetOptions::columns",
                     fmt::format("{} x {} inner corners", board.columns, board.rows),
                     fmt::format("{} to {} inner corners along each side, which pictures show "
                                 "for certain",
                                 kFewestFoundCorners, kMostBoardCorners));
  constexpr double kLargest_m = 0.5;
  require_length("BoardSheetOptions::square_m", board.square_m, kLargest_m);
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
