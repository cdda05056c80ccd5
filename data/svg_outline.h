#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "data/drawn_outline.h"

namespace clothfit {

/// Reads the outline of a panel from an SVG drawing. `piece` is the id of a path of one closed
/// subpath, a polygon, a closed polyline or a rect. Transforms of the element and of those around
/// it count; its y axis, which points down there, points up here.
///
/// `unit_m` is the length of a user unit (m). Nothing: it follows from the drawing's width or
/// height and its viewBox, and is 1/96 inch where they do not say.
///
/// Arcs become arcs where they are of circles that no transform skews, otherwise cubic Bezier
/// curves of up to a quarter turn, 3e-4 of the radius off.
///
/// Throws InputError where the file is no SVG drawing, has no such piece, or its outline is not
/// closed. Entities are not resolved, and no other file is read.
PanelOutline read_svg_outline(const std::filesystem::path& file, const std::string& piece,
                              std::optional<double> unit_m);

}  // namespace clothfit
