#include "tests/vision/dot_sheet.h"

#include <fmt/core.h>

#include <array>

namespace clothfit {
namespace {

void add_marker(MarkerSet& set, Marker marker) {
  set.index[marker.name] = static_cast<int>(set.markers.size());
  set.markers.push_back(std::move(marker));
}

}  // namespace

MarkerSet dot_markers(int columns, int rows, double spacing_m, double margin_m) {
  MarkerSet set{.kind = MarkerKind::dots, .family = "tag36h11", .markers = {}, .index = {}};
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      add_marker(set, {.name = fmt::format("d{:02}_{:02}", row, column),
                       .s_m = margin_m + column * spacing_m,
                       .t_m = margin_m + row * spacing_m,
                       .tag = {},
                       .corner = {}});
  return set;
}

MarkerSet anchored_dot_markers(int columns, int rows, double spacing_m, double margin_m) {
  const MarkerSet all = dot_markers(columns, rows, spacing_m, margin_m);
  MarkerSet set{.kind = MarkerKind::dots, .family = "tag36h11", .markers = {}, .index = {}};
  const auto is_anchor = [](int place, int count) { return place == 2 || place == count - 3; };
  constexpr std::array<std::array<double, 2>, 4> kCorners{{{-1, 1}, {1, 1}, {1, -1}, {-1, -1}}};
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Marker& dot = all.markers[static_cast<size_t>(row * columns + column)];
      if (!is_anchor(row, rows) || !is_anchor(column, columns)) {
        add_marker(set, dot);
        continue;
      }
      const int tag = (row == 2 ? 0 : 2) + (column == 2 ? 0 : 1);
      for (int corner = 0; corner < 4; ++corner) {
        const auto [right, down] = kCorners[static_cast<size_t>(corner)];
        add_marker(set, {.name = fmt::format("t{}_{}", tag, corner),
                         .s_m = dot.s_m + right * 0.6 * spacing_m,
                         .t_m = dot.t_m + down * 0.6 * spacing_m,
                         .tag = tag,
                         .corner = corner});
      }
    }
  return set;
}

std::vector<double> pattern_radii_m(const DotPattern& pattern, double spacing_m) {
  std::vector<double> radii_m;
  for (const std::uint8_t symbol : pattern.symbols)
    radii_m.push_back(spacing_m * dot_radius_over_spacing(symbol));
  return radii_m;
}

}  // namespace clothfit
