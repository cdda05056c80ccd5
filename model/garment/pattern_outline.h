#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/sewing_pattern.h"

namespace clothfit {

/// Throws InputError where an outline has no area, runs clockwise or crosses itself; where a seam
/// names no edge, an edge belongs to two seams or is sewn to itself; and where the sides of a seam
/// differ by more than its easing. Panels and seams are named in the messages.
void check_pattern(const Pattern& pattern);

/// Returns the area inside a panel's outline (m2), < 0 where it runs clockwise; curves count as 16
/// chords.
double panel_area_m2(const Panel& panel);

/// Returns the length of an edge (m).
double edge_length_m(const Panel& panel, int edge);

/// Returns the length of a side of a seam (m).
double side_length_m(const Pattern& pattern, const SeamSide& side);

/// Returns the points of an edge at shares of its length from its first corner: 2 x shares.
Eigen::Matrix2Xd points_of_edge_m(const Panel& panel, int edge, const std::vector<double>& shares);

}  // namespace clothfit
