#include "model/garment/pattern_outline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "data/input_error.h"

namespace clothfit {
namespace {

/// Chords by which a curve's length is measured: they miss 1e-5 of a half circle's.
constexpr int kChords = 256;

bool is_straight(const PatternEdge& edge) {
  return edge.control_m.empty() && edge.bulge == 0;
}

/// The chords of an edge and how far along it each ends.
struct Chords {
  Eigen::Matrix2Xd point_m;
  std::vector<double> along_m;

  Chords(const Panel& panel, int edge) {
    const Eigen::Vector2d from = panel.corner_m.col(edge),
                          to = panel.corner_m.col((edge + 1) % panel.corner_m.cols());
    const PatternEdge& curve = panel.edges[static_cast<size_t>(edge)];
    const int count = is_straight(curve) ? 1 : kChords;
    point_m.resize(2, count + 1);
    for (int k = 0; k <= count; ++k) {
      point_m.col(k) = edge_point_m(from, curve, to, static_cast<double>(k) / count);
      along_m.push_back(k == 0 ? 0 : along_m.back() + (point_m.col(k) - point_m.col(k - 1)).norm());
    }
  }
};

/// Returns an outline as a polygon, curves as chords.
Eigen::Matrix2Xd polygon_m(const Panel& panel) {
  constexpr int kParts = 16;
  std::vector<Eigen::Vector2d> points;
  for (int edge = 0; edge < panel.edge_count(); ++edge) {
    const int parts = is_straight(panel.edges[static_cast<size_t>(edge)]) ? 1 : kParts;
    std::vector<double> shares;
    for (int k = 0; k < parts; ++k) shares.push_back(static_cast<double>(k) / parts);
    const Eigen::Matrix2Xd points_m = points_of_edge_m(panel, edge, shares);
    for (const auto& point : points_m.colwise()) points.emplace_back(point);
  }
  Eigen::Matrix2Xd polygon(2, static_cast<Eigen::Index>(points.size()));
  for (size_t k = 0; k < points.size(); ++k) polygon.col(static_cast<Eigen::Index>(k)) = points[k];
  return polygon;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

bool cross_each_other(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                      const Eigen::Vector2d& d) {
  return cross(b - a, c - a) * cross(b - a, d - a) < 0 &&
         cross(d - c, a - c) * cross(d - c, b - c) < 0;
}

/// Refuses what stands in a line of the pattern's file.
[[noreturn]] void refuse(const Pattern& pattern, int line, const std::string& problem,
                         const std::string& expected, const std::string& remedy = "") {
  if (line > 0) throw InputError(pattern.file, line, problem, expected, remedy);
  throw InputError(pattern.file.empty() ? "pattern" : pattern.file, problem, expected, remedy);
}

bool is_finite(const Panel& panel) {
  bool finite = panel.corner_m.allFinite() && panel.placement.matrix().allFinite() &&
                std::isfinite(panel.grain_rad);
  for (const PatternEdge& edge : panel.edges) {
    finite = finite && std::isfinite(edge.bulge);
    for (const Eigen::Vector2d& point : edge.control_m) finite = finite && point.allFinite();
  }
  return finite;
}

void check_outline(const Pattern& pattern, const Panel& panel) {
  const auto fail = [&](const std::string& problem, const std::string& expected,
                        const std::string& remedy = "") {
    refuse(pattern, panel.line, fmt::format("panel {}: {}", panel.name, problem), expected, remedy);
  };
  if (panel.corner_m.cols() < 2 || panel.edges.size() != static_cast<size_t>(panel.corner_m.cols()))
    fail(fmt::format("{} corners and {} edges", panel.corner_m.cols(), panel.edges.size()),
         "an outline of two or more corners with an edge from each to the next");
  if (!is_finite(panel)) fail("a number that is none", "finite numbers");
  for (const PatternEdge& edge : panel.edges)
    if (edge.control_m.size() > 2 || (edge.bulge != 0 && !edge.control_m.empty()))
      fail(fmt::format("an edge of {} control points and a bulge of {:g}", edge.control_m.size(),
                       edge.bulge),
           "up to two control points, or a bulge");
  for (int edge = 0; edge < panel.edge_count(); ++edge)
    if (const double length_m = edge_length_m(panel, edge); !(length_m > 1e-4))
      fail(fmt::format("edge {} is {:.3g} mm long", edge, 1e3 * length_m),
           "edges of a tenth of a millimetre or more",
           "leave out corners that fall together; an outline closes by itself");
  const Eigen::Matrix2Xd polygon = polygon_m(panel);
  const Eigen::Index count = polygon.cols();
  for (Eigen::Index k = 0; k < count; ++k)
    for (Eigen::Index n = k + 2; n < count; ++n)
      if ((n + 1) % count != k && cross_each_other(polygon.col(k), polygon.col(k + 1),
                                                   polygon.col(n), polygon.col((n + 1) % count)))
        fail(fmt::format("its outline crosses itself near ({:.4g}, {:.4g}) m", polygon(0, k),
                         polygon(1, k)),
             "an outline that does not meet itself");
  if (const double area_m2 = panel_area_m2(panel); !(area_m2 > 0))
    fail(fmt::format("its outline runs clockwise ({:.4g} m2)", area_m2),
         "corners counterclockwise, as seen from the garment's outside",
         "turn their order round, or mirror the panel");
}

void check_side(const Pattern& pattern, const Seam& seam, const SeamSide& side) {
  if (side.panel < 0 || side.panel >= static_cast<int>(pattern.panels.size()))
    refuse(pattern, seam.line, fmt::format("a seam of panel {}", side.panel),
           fmt::format("one of the {} panels", pattern.panels.size()));
  const Panel& panel = pattern.panels[static_cast<size_t>(side.panel)];
  if (side.edges.empty())
    refuse(pattern, seam.line, "a seam's side has no edge", "one or more edges");
  for (const int edge : side.edges)
    if (edge < 0 || edge >= panel.edge_count())
      refuse(pattern, seam.line, fmt::format("a seam of edge {} of panel {}", edge, panel.name),
             fmt::format("edges 0 to {}", panel.edge_count() - 1));
  int backwards = 0;  // once where the side passes the outline's first corner
  for (size_t k = 0; k + 1 < side.edges.size(); ++k)
    backwards += side.edges[k + 1] <= side.edges[k];
  if (backwards > 1 || (backwards == 1 && side.edges.back() >= side.edges.front()))
    refuse(pattern, seam.line,
           fmt::format("a seam's edges of panel {} are out of order", panel.name),
           "edges in their order along the outline");
}

void check_lengths(const Pattern& pattern, const Seam& seam) {
  const double one_m = side_length_m(pattern, seam.sides[0]),
               other_m = side_length_m(pattern, seam.sides[1]);
  const double excess = std::max(one_m, other_m) / std::min(one_m, other_m) - 1;
  if (excess > seam.easing)
    refuse(pattern, seam.line,
           fmt::format("the seam's sides are {:.1f} mm and {:.1f} mm long, {:.1f} % apart",
                       1e3 * one_m, 1e3 * other_m, 100 * excess),
           fmt::format("sides that differ by {:.3g} % at most", 100 * seam.easing),
           "if the longer one is to be gathered, give the seam an easing");
}

}  // namespace

double panel_area_m2(const Panel& panel) {
  const Eigen::Matrix2Xd polygon = polygon_m(panel);
  double twice_m2 = 0;
  for (Eigen::Index k = 0; k < polygon.cols(); ++k)
    twice_m2 += cross(polygon.col(k), polygon.col((k + 1) % polygon.cols()));
  return 0.5 * twice_m2;
}

double edge_length_m(const Panel& panel, int edge) {
  return Chords(panel, edge).along_m.back();
}

double side_length_m(const Pattern& pattern, const SeamSide& side) {
  const Panel& panel = pattern.panels[static_cast<size_t>(side.panel)];
  double length_m = 0;
  for (const int edge : side.edges) length_m += edge_length_m(panel, edge);
  return length_m;
}

Eigen::Matrix2Xd points_of_edge_m(const Panel& panel, int edge, const std::vector<double>& shares) {
  const Chords chords(panel, edge);
  Eigen::Matrix2Xd points(2, static_cast<Eigen::Index>(shares.size()));
  for (size_t k = 0; k < shares.size(); ++k) {
    const double along_m = shares[k] * chords.along_m.back();
    const auto end = std::ranges::upper_bound(chords.along_m, along_m);
    const auto n = std::clamp<std::ptrdiff_t>(
        end - chords.along_m.begin(), 1, static_cast<std::ptrdiff_t>(chords.along_m.size()) - 1);
    const double before_m = chords.along_m[static_cast<size_t>(n) - 1],
                 after_m = chords.along_m[static_cast<size_t>(n)];
    const double part = (along_m - before_m) / (after_m - before_m);
    points.col(static_cast<Eigen::Index>(k)) =
        (1 - part) * chords.point_m.col(n - 1) + part * chords.point_m.col(n);
  }
  return points;
}

void check_pattern(const Pattern& pattern) {
  if (pattern.panels.empty()) refuse(pattern, 0, "it has no panel", "one or more");
  // Every edge is held against every other of its panel.
  constexpr size_t kMostEdges = 2000;
  size_t edges = 0;
  for (const Panel& panel : pattern.panels) edges += panel.edges.size();
  if (edges > kMostEdges)
    refuse(pattern, 0, fmt::format("its panels have {} edges, darts counted", edges),
           fmt::format("{} at most", kMostEdges), "draw curves as curves");
  for (const Panel& panel : pattern.panels) {
    check_outline(pattern, panel);
    if (panel.fabric < 0 || panel.fabric >= static_cast<int>(pattern.fabrics.size()))
      refuse(pattern, panel.line, fmt::format("panel {}: fabric {}", panel.name, panel.fabric),
             fmt::format("one of the {} fabrics", pattern.fabrics.size()));
  }
  std::map<std::array<int, 2>, size_t> seam_of;  // panel and edge
  for (size_t n = 0; n < pattern.seams.size(); ++n) {
    const Seam& seam = pattern.seams[n];
    for (const SeamSide& side : seam.sides) {
      check_side(pattern, seam, side);
      for (const int edge : side.edges) {
        const auto [at, is_new] = seam_of.emplace(std::array{side.panel, edge}, n);
        if (is_new) continue;
        const std::string name = fmt::format("edge {} of panel {}", edge,
                                             pattern.panels[static_cast<size_t>(side.panel)].name);
        if (at->second == n)
          refuse(pattern, seam.line, name + " is sewn to itself", "two sides that share no edge");
        refuse(pattern, seam.line, name + " belongs to an earlier seam", "an edge in one seam",
               "cut the edge in two with a corner");
      }
    }
    check_lengths(pattern, seam);
  }
}

}  // namespace clothfit
