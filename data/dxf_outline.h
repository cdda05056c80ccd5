#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "data/drawn_outline.h"

namespace clothfit {

/// Reads the outline of a panel from a DXF drawing in text. `piece` is the name of a block, of
/// which AAMA's format (ASTM D6673) has one for each piece, or `*` for the drawing's own entities.
///
/// The outline is the closed polyline on layer 1, or the only closed one where that layer has none;
/// otherwise the loop that lines and arcs of layer 1 join into, or all lines and arcs where that
/// layer has none. Points on layer 2 mark vertices as corners, those on layer 3 as none.
///
/// `unit_m` is the length of the drawing's unit (m). Nothing: $INSUNITS says it.
///
/// Throws InputError where the file is no DXF drawing in text, has no such piece, names no unit, or
/// the piece does not have one closed outline.
PanelOutline read_dxf_outline(const std::filesystem::path& file, const std::string& piece,
                              std::optional<double> unit_m);

}  // namespace clothfit
