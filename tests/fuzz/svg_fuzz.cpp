// Outlines from SVG drawings. What is read can be measured, and runs counterclockwise.

#include <cstdlib>

#include "data/svg_outline.h"
#include "model/garment/pattern_outline.h"
#include "tests/fuzz/scratch_folder.h"

namespace {

void read_piece(const std::filesystem::path& file, const char* piece,
                std::optional<double> unit_m) {
  using namespace clothfit;
  const PanelOutline outline = read_svg_outline(file, piece, unit_m);
  if (outline.edges.size() != static_cast<size_t>(outline.corner_m.cols()) ||
      outline.begin_at_corner.empty() || outline.begin_at_corner.front() != 0 ||
      outline.begin_at_corner.back() >= static_cast<int>(outline.edges.size()))
    std::abort();
  if (!(twice_outline_area_m2(outline.corner_m, outline.edges) >= -1e-9)) std::abort();
  Pattern pattern;
  pattern.fabrics = {"cloth"};
  pattern.panels.resize(1);
  pattern.panels[0].corner_m = outline.corner_m;
  pattern.panels[0].edges = outline.edges;
  if (outline.edges.size() < 200) check_pattern(pattern);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const auto file = write_scratch("a.svg", text_of(data, size));
  for (const char* piece : {"p", "q"})
    read_or_refuse([&] { read_piece(file, piece, std::nullopt); });
  return 0;
}
