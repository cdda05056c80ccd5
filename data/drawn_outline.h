#pragma once

#include <Eigen/Core>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "data/sewing_pattern.h"

namespace clothfit {

/// A vertex is a corner where the outline turns by more than this (rad) and the file says nothing
/// of it.
inline constexpr double kCornerTurn_rad = 20 * std::numbers::pi / 180;
/// An edge up to this long (m) becomes a point: check_pattern() accepts no shorter ones.
inline constexpr double kShortestDrawnEdge_m = 1e-4;
/// Two ends meet within this share of the outline's size.
inline constexpr double kClosingShare = 1e-6;

/// An outline as a drawing has it: in either direction, its vertices corners or not. Lengths are in
/// the drawing's unit or in metres, as its reader says.
struct DrawnOutline {
  std::string file;  ///< for messages
  int line = 0;      ///< of the drawing's file; 0: not known
  std::string piece;
  std::vector<Eigen::Vector2d> vertex;
  /// Edge k begins at vertex k. It ends at the next, the last one of a closed outline at the first.
  std::vector<PatternEdge> edges;
  /// Whether a vertex is a corner, by vertex; nothing: the turn there decides. Empty: everywhere.
  std::vector<std::optional<bool>> is_corner;

  /// Adds an edge from the last vertex to `to`. An arc of more than half a circle becomes two.
  /// Throws InputError where the outline becomes longer than kMostDrawnEdges.
  void add(const PatternEdge& edge, Eigen::Vector2d to);
  /// Closes an outline whose last vertex is its first one again. Throws InputError where the two
  /// differ by more than kClosingShare of its size.
  void close();
  /// Throws InputError that names the file, the line where it is known, and the piece.
  [[noreturn]] void refuse(const std::string& problem, const std::string& expected,
                           const std::string& remedy = "") const;
};

/// A panel's outline from a drawing.
struct PanelOutline {
  /// The outline's vertices (m), counterclockwise, from the first that is a corner; 2 x vertices.
  /// The origin is the middle of the box around it.
  Eigen::Matrix2Xd corner_m;
  std::vector<PatternEdge> edges;  ///< edge k runs from vertex k to the next
  /// Numbers of the edges that begin at a corner, ascending, the first 0. What runs from there to
  /// the next corner is one edge of the panel for its seams.
  std::vector<int> begin_at_corner;
};

/// Turns a closed outline in metres counterclockwise and finds its corners. Throws InputError where
/// it has no size or more than 20 m, or a number that is not finite.
PanelOutline panel_outline(DrawnOutline drawn);

/// Returns twice the area (m2) inside an outline of vertices and edges, < 0 where it runs
/// clockwise. Curves count as 16 chords.
double twice_outline_area_m2(const Eigen::Matrix2Xd& corner_m,
                             const std::vector<PatternEdge>& edges);

/// Returns a list of a file's pieces for an error message.
std::string known_pieces(const std::string& mistyped, const std::vector<std::string>& pieces);

}  // namespace clothfit
