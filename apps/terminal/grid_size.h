#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace clothfit {

struct GridSize {
  int columns = 0;
  int rows = 0;
  bool operator==(const GridSize&) const = default;
};

/// Reads columns and rows from "17x13". Nothing where the text is not two whole numbers with an x
/// between.
std::optional<GridSize> parse_grid_size(std::string_view text);

/// Returns the mesh that --mesh names; nothing where the text is not one that a fit takes.
std::optional<GridSize> parse_mesh(std::string_view text);

/// Returns nothing, or what is wrong with the text of --mesh.
std::string check_mesh(const std::string& text);

}  // namespace clothfit
