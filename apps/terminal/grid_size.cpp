#include "apps/terminal/grid_size.h"

#include <fmt/format.h>

#include "data/number_text.h"
#include "data/recording.h"

namespace clothfit {

std::optional<GridSize> parse_grid_size(std::string_view text) {
  const size_t cross = text.find('x');
  if (cross == std::string_view::npos) return std::nullopt;
  const std::optional<int> columns = parse_whole_number(text.substr(0, cross));
  const std::optional<int> rows = parse_whole_number(text.substr(cross + 1));
  if (!columns || !rows) return std::nullopt;
  return GridSize{*columns, *rows};
}

std::optional<GridSize> parse_mesh(std::string_view text) {
  const std::optional<GridSize> mesh = parse_grid_size(text);
  return mesh && is_possible_mesh(mesh->columns, mesh->rows) ? mesh : std::nullopt;
}

std::string check_mesh(const std::string& text) {
  if (parse_mesh(text)) return "";
  return fmt::format("'{}' is not a mesh, such as 17x17 (each at least 2, {} vertices at most)",
                     text, kMostMeshVertices);
}

}  // namespace clothfit
