// A sewing pattern, in our format or GarmentCode's. What passes its checks can be meshed.

#include <cmath>
#include <cstdlib>
#include <string_view>

#include "data/pattern_file.h"
#include "model/garment/garment_mesh.h"
#include "model/garment/pattern_outline.h"
#include "tests/fuzz/scratch_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, size_t size) {
  using namespace clothfit;
  const std::string_view text = text_of(data, size);
  const auto file = write_scratch(text.starts_with("{") ? "pattern.json" : "pattern.yaml", text);
  try {
    const Pattern pattern = read_pattern(file);
    check_pattern(pattern);
    double area_m2 = 0, length_m = 0;
    for (const Panel& panel : pattern.panels) {
      area_m2 += panel_area_m2(panel);
      for (int edge = 0; edge < panel.edge_count(); ++edge) length_m += edge_length_m(panel, edge);
    }
    const double spacing_m = std::max(std::sqrt(area_m2 / 500), length_m / 500);
    const GarmentMesh mesh = mesh_garment(pattern, spacing_m);
    if (!mesh.placed_m.allFinite() || mesh.particles < 3) std::abort();
  } catch (const InputError&) {
  }
  return 0;
}
