#pragma once

#include <cstdlib>

#include "data/drawn_outline.h"
#include "model/garment/pattern_outline.h"

namespace clothfit {

/// Ends the program unless an outline that was read is whole and runs counterclockwise. What a
/// pattern of it refuses is thrown.
inline void check_outline(const PanelOutline& outline) {
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

}  // namespace clothfit
