#pragma once

#include <optional>
#include <string_view>

namespace clothfit {

struct GridSize {
  int columns = 0;
  int rows = 0;
  bool operator==(const GridSize&) const = default;
};

/// "17x13": columns and rows. Nothing where the text is not two whole numbers with an x between.
std::optional<GridSize> parse_grid_size(std::string_view text);

}  // namespace clothfit
