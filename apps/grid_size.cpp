#include "apps/grid_size.h"

#include "data/number_text.h"

namespace clothfit {

std::optional<GridSize> parse_grid_size(std::string_view text) {
  const std::size_t cross = text.find('x');
  if (cross == std::string_view::npos) return std::nullopt;
  const std::optional<int> columns = parse_whole_number(text.substr(0, cross));
  const std::optional<int> rows = parse_whole_number(text.substr(cross + 1));
  if (!columns || !rows) return std::nullopt;
  return GridSize{*columns, *rows};
}

}  // namespace clothfit
