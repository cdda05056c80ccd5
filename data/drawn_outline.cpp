#include "data/drawn_outline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "data/file_limits.h"
#include "data/input_error.h"
#include "data/nearest_name.h"
#include "data/shown_text.h"

namespace clothfit {
namespace {

constexpr double kWidestOutline_m = 20;

/// Returns the larger side of the box around points.
double box_size(const std::vector<Eigen::Vector2d>& points) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& point : points) box.extend(point);
  return box.isEmpty() ? 0 : box.sizes().maxCoeff();
}

PatternEdge reversed_edge(PatternEdge edge) {
  std::ranges::reverse(edge.control_m);
  edge.bulge = -edge.bulge;
  return edge;
}

/// Returns the direction in which an edge leaves its first vertex; zero where it has none.
Eigen::Vector2d direction_at_begin(const Eigen::Vector2d& from, const PatternEdge& edge,
                                   const Eigen::Vector2d& to) {
  if (edge.bulge != 0)
    return (Eigen::Rotation2Dd(-2 * std::atan(edge.bulge)) * (to - from)).normalized();
  // A control point may lie on the vertex; then the next one decides.
  for (const Eigen::Vector2d& point : edge.control_m)
    if ((point - from).norm() > 1e-9 * (to - from).norm()) return (point - from).normalized();
  return (to - from).normalized();
}

size_t next_vertex(const DrawnOutline& drawn, size_t k) {
  return (k + 1) % drawn.vertex.size();
}

bool turns_into_corner(const DrawnOutline& drawn, size_t k) {
  if (!drawn.is_corner.empty() && drawn.is_corner[k]) return *drawn.is_corner[k];
  const size_t last = (k + drawn.vertex.size() - 1) % drawn.vertex.size();
  const Eigen::Vector2d before = -direction_at_begin(
                            drawn.vertex[k], reversed_edge(drawn.edges[last]), drawn.vertex[last]),
                        after = direction_at_begin(drawn.vertex[k], drawn.edges[k],
                                                   drawn.vertex[next_vertex(drawn, k)]);
  const double sine = before.x() * after.y() - before.y() * after.x();
  return std::abs(std::atan2(sine, before.dot(after))) > kCornerTurn_rad;
}

/// Returns a length that an edge does not exceed: of its chord or control polygon.
double extent_m(const Eigen::Vector2d& from, const PatternEdge& edge, const Eigen::Vector2d& to) {
  double length_m = 0;
  Eigen::Vector2d last = from;
  for (const Eigen::Vector2d& point : edge.control_m) {
    length_m += (point - last).norm();
    last = point;
  }
  return length_m + (to - last).norm();
}

/// Leaves out edges that are too short, with the vertices at their ends.
void leave_out_short_edges(DrawnOutline& drawn) {
  DrawnOutline kept = drawn;
  kept.vertex = {drawn.vertex[0]};
  kept.edges.clear();
  kept.is_corner.resize(drawn.is_corner.empty() ? 0 : 1);
  const auto merge_corner = [&](size_t of, size_t into) {
    if (!drawn.is_corner.empty() && drawn.is_corner[of].value_or(false))
      kept.is_corner[into] = true;
  };
  for (size_t k = 0; k < drawn.edges.size(); ++k) {
    const size_t next = next_vertex(drawn, k);
    if (extent_m(kept.vertex.back(), drawn.edges[k], drawn.vertex[next]) <=
        1.001 * kShortestDrawnEdge_m) {
      if (next != 0) {
        merge_corner(next, kept.vertex.size() - 1);
      } else if (kept.vertex.size() > 1) {
        kept.vertex.pop_back();
        if (!kept.is_corner.empty()) {
          if (kept.is_corner.back().value_or(false)) kept.is_corner[0] = true;
          kept.is_corner.pop_back();
        }
      }
      continue;
    }
    kept.edges.push_back(drawn.edges[k]);
    if (next == 0) continue;
    kept.vertex.push_back(drawn.vertex[next]);
    if (!drawn.is_corner.empty()) kept.is_corner.push_back(drawn.is_corner[next]);
  }
  drawn = std::move(kept);
}

/// Divides the one curve of an outline in two, for a panel has two corners at least.
void divide_lone_curve(DrawnOutline& drawn) {
  const Eigen::Vector2d at = drawn.vertex[0];
  const std::vector<Eigen::Vector2d> control = drawn.edges[0].control_m;
  const Eigen::Vector2d middle = edge_point_m(at, drawn.edges[0], at, 0.5);
  const Eigen::Vector2d first = 0.5 * (at + control.front()), last = 0.5 * (control.back() + at);
  drawn.edges.assign(2, {});
  if (control.size() == 1) {
    drawn.edges[0].control_m = {first};
    drawn.edges[1].control_m = {last};
  } else {
    const Eigen::Vector2d between = 0.5 * (control[0] + control[1]);
    drawn.edges[0].control_m = {first, 0.5 * (first + between)};
    drawn.edges[1].control_m = {0.5 * (between + last), last};
  }
  drawn.vertex.push_back(middle);
  if (!drawn.is_corner.empty()) drawn.is_corner.emplace_back(false);
}

/// Turns the direction of an outline round; its first vertex stays the first.
void reverse_outline(DrawnOutline& drawn) {
  std::reverse(drawn.vertex.begin() + 1, drawn.vertex.end());
  if (!drawn.is_corner.empty()) std::reverse(drawn.is_corner.begin() + 1, drawn.is_corner.end());
  std::ranges::reverse(drawn.edges);
  for (PatternEdge& edge : drawn.edges) edge = reversed_edge(edge);
}

Eigen::Matrix2Xd matrix_of(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Matrix2Xd matrix(2, static_cast<Eigen::Index>(points.size()));
  for (size_t k = 0; k < points.size(); ++k) matrix.col(static_cast<Eigen::Index>(k)) = points[k];
  return matrix;
}

/// Moves an outline so that the middle of its box is the origin.
void move_to_middle(DrawnOutline& drawn) {
  constexpr int kParts = 64;  // by which the box of a curve is found
  Eigen::AlignedBox2d box;
  for (size_t k = 0; k < drawn.edges.size(); ++k) {
    const PatternEdge& edge = drawn.edges[k];
    const int parts = edge.control_m.empty() && edge.bulge == 0 ? 1 : kParts;
    for (int n = 0; n < parts; ++n)
      box.extend(edge_point_m(drawn.vertex[k], edge, drawn.vertex[next_vertex(drawn, k)],
                              static_cast<double>(n) / parts));
  }
  const Eigen::Vector2d middle = box.center();
  for (Eigen::Vector2d& point : drawn.vertex) point -= middle;
  for (PatternEdge& edge : drawn.edges)
    for (Eigen::Vector2d& point : edge.control_m) point -= middle;
}

void check_numbers(const DrawnOutline& drawn) {
  bool finite = true;
  std::vector<Eigen::Vector2d> points = drawn.vertex;
  for (const PatternEdge& edge : drawn.edges) {
    finite = finite && std::isfinite(edge.bulge);
    points.insert(points.end(), edge.control_m.begin(), edge.control_m.end());
  }
  for (const Eigen::Vector2d& point : points)
    finite = finite && point.allFinite() && point.cwiseAbs().maxCoeff() < 1e100;
  if (!finite) drawn.refuse("a coordinate that is no number", "finite coordinates");
  if (const double size_m = box_size(points); size_m > kWidestOutline_m)
    drawn.refuse(fmt::format("its outline is {:.4g} m wide", size_m),
                 fmt::format("{:g} m at most", kWidestOutline_m),
                 "give the drawing's unit: `unit: mm` beside `piece`");
}

}  // namespace

void DrawnOutline::add(const PatternEdge& edge, Eigen::Vector2d to) {
  if (edges.size() >= kMostDrawnEdges)
    refuse(fmt::format("its outline has more than {} edges", kMostDrawnEdges),
           fmt::format("{} at most", kMostDrawnEdges), "draw curves as curves");
  if (std::abs(edge.bulge) > 1 + 1e-9) {
    // The bulge is the arc's height over half its chord, to the right.
    const Eigen::Vector2d from = vertex.back(), chord = to - from;
    const Eigen::Vector2d middle =
        0.5 * (from + to + edge.bulge * Eigen::Vector2d(chord.y(), -chord.x()));
    PatternEdge half;
    half.bulge = std::tan(0.5 * std::atan(edge.bulge));
    edges.insert(edges.end(), 2, half);
    vertex.push_back(middle);
  } else {
    edges.push_back(edge);
  }
  vertex.push_back(to);
}

void DrawnOutline::close() {
  if (edges.empty()) refuse("its outline is a point", "a closed outline");
  const double gap = (vertex.back() - vertex.front()).norm(), size = box_size(vertex);
  if (!(gap <= kClosingShare * size))
    refuse(fmt::format("its outline is not closed: it ends {:.4g} from where it begins, {:.4g} % "
                       "of its size",
                       gap, 100 * gap / size),
           "an outline that ends where it begins", "close it in the program that drew it");
  vertex.pop_back();
}

void DrawnOutline::refuse(const std::string& problem, const std::string& expected,
                          const std::string& remedy) const {
  const std::string told = fmt::format("piece {}: {}", shown_text(piece), problem);
  if (line > 0) throw InputError(file, line, told, expected, remedy);
  throw InputError(file, told, expected, remedy);
}

PanelOutline panel_outline(DrawnOutline drawn) {
  check_numbers(drawn);
  leave_out_short_edges(drawn);
  if (drawn.edges.size() == 1 && !drawn.edges[0].control_m.empty()) divide_lone_curve(drawn);
  if (drawn.edges.size() < 2)
    drawn.refuse("its outline is a point or a line", "an outline around an area",
                 "if it is tiny by its unit, give another: `unit: mm` beside `piece`");
  move_to_middle(drawn);
  if (twice_outline_area_m2(matrix_of(drawn.vertex), drawn.edges) < 0) reverse_outline(drawn);
  std::vector<size_t> corners;
  for (size_t k = 0; k < drawn.vertex.size(); ++k)
    if (turns_into_corner(drawn, k)) corners.push_back(k);
  if (corners.empty()) corners.push_back(0);  // a smooth outline is one edge
  const auto first = static_cast<std::ptrdiff_t>(corners[0]);
  std::rotate(drawn.vertex.begin(), drawn.vertex.begin() + first, drawn.vertex.end());
  std::rotate(drawn.edges.begin(), drawn.edges.begin() + first, drawn.edges.end());
  PanelOutline outline{
      .corner_m = matrix_of(drawn.vertex), .edges = drawn.edges, .begin_at_corner = {}};
  for (const size_t corner : corners)
    outline.begin_at_corner.push_back(static_cast<int>(corner - corners[0]));
  return outline;
}

double twice_outline_area_m2(const Eigen::Matrix2Xd& corner_m,
                             const std::vector<PatternEdge>& edges) {
  constexpr int kChords = 16;
  double twice_m2 = 0;
  Eigen::Vector2d last = corner_m.col(0);
  for (size_t k = 0; k < edges.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    const Eigen::Vector2d from = corner_m.col(column),
                          to = corner_m.col((column + 1) % corner_m.cols());
    for (int n = 1; n <= kChords; ++n) {
      const Eigen::Vector2d next =
          edge_point_m(from, edges[k], to, static_cast<double>(n) / kChords);
      twice_m2 += last.x() * next.y() - last.y() * next.x();
      last = next;
    }
  }
  return twice_m2;
}

std::string known_pieces(const std::string& mistyped, const std::vector<std::string>& pieces) {
  constexpr size_t kMostListed = 40;
  std::vector<std::string> names;
  for (const std::string& piece : pieces) {
    if (names.size() == kMostListed) break;
    names.push_back(shown_text(piece));
  }
  std::string text = known_names(mistyped, names);
  if (pieces.size() > kMostListed) text += fmt::format(" and {} more", pieces.size() - kMostListed);
  return text;
}

}  // namespace clothfit
