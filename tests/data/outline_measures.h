#pragma once

#include <cmath>

#include "data/drawn_outline.h"

namespace clothfit {

/// Returns the length of an outline (m): arcs by their angle, curves by chords.
inline double outline_length_m(const PanelOutline& outline) {
  constexpr int kChords = 1000;
  double length_m = 0;
  for (size_t k = 0; k < outline.edges.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    const PatternEdge& edge = outline.edges[k];
    const Eigen::Vector2d from = outline.corner_m.col(column),
                          to = outline.corner_m.col((column + 1) % outline.corner_m.cols());
    if (edge.bulge != 0) {
      const double half_angle = 2 * std::atan(std::abs(edge.bulge));
      length_m += (to - from).norm() * half_angle / std::sin(half_angle);
      continue;
    }
    Eigen::Vector2d last = from;
    for (int n = 1; n <= kChords; ++n) {
      const Eigen::Vector2d next = edge_point_m(from, edge, to, static_cast<double>(n) / kChords);
      length_m += (next - last).norm();
      last = next;
    }
  }
  return length_m;
}

inline double outline_area_m2(const PanelOutline& outline) {
  return 0.5 * twice_outline_area_m2(outline.corner_m, outline.edges);
}

/// Returns how far two outlines are apart in their vertices; those of different sizes, infinity.
inline double distance_m(const PanelOutline& one, const PanelOutline& other) {
  if (one.corner_m.cols() != other.corner_m.cols()) return INFINITY;
  return (one.corner_m - other.corner_m).cwiseAbs().maxCoeff();
}

}  // namespace clothfit
