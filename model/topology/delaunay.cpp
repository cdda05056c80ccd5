#include "model/topology/delaunay.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/polygon/voronoi.hpp>
#include <cmath>
#include <cstdint>
#include <deque>
#include <map>
#include <utility>

#include "data/input_error.h"

namespace clothfit {
namespace {

using GridPoint = boost::polygon::point_data<std::int32_t>;
using Edge = std::array<int, 2>;
using Triangle = std::array<int, 3>;

Edge sorted(int a, int b) {
  return a < b ? Edge{a, b} : Edge{b, a};
}

/// Returns the places of the points on a grid fine enough that rounding moves none by more than a
/// billionth of their extent.
std::vector<GridPoint> on_grid(const Eigen::Matrix2Xd& point_m) {
  const Eigen::Vector2d low = point_m.rowwise().minCoeff();
  const double extent = (point_m.rowwise().maxCoeff() - low).maxCoeff();
  const double steps_per_m = extent > 0 ? 0x1p29 / extent : 0;
  std::vector<GridPoint> points;
  for (const auto& p : point_m.colwise()) {
    const auto on_axis = [&](int axis) {
      return static_cast<std::int32_t>(std::lround((p[axis] - low[axis]) * steps_per_m));
    };
    points.emplace_back(on_axis(0), on_axis(1));
  }
  return points;
}

/// Triangles that share edges, and the means to flip an edge between two.
class Triangulation {
 public:
  Triangulation(const Eigen::Matrix2Xd& point_m, std::vector<GridPoint> points)
      : point_m_(point_m), points_(std::move(points)) {
    refuse_same_places();
    boost::polygon::voronoi_diagram<double> diagram;
    boost::polygon::construct_voronoi(points_.begin(), points_.end(), &diagram);
    // A Voronoi vertex with more than three cells around it is the centre of a polygon of points on
    // one circle.
    for (const auto& vertex : diagram.vertices()) {
      std::vector<int> around;
      const auto* edge = vertex.incident_edge();
      do {
        around.push_back(static_cast<int>(edge->cell()->source_index()));
        edge = edge->rot_next();
      } while (edge != vertex.incident_edge());
      for (size_t k = 1; k + 1 < around.size(); ++k) add(around[0], around[k], around[k + 1]);
    }
    if (triangles_.empty())
      throw InputError("outline", "its points lie on one line", "points around an area");
  }

  /// Flips edges that cross `kept` until it is an edge itself [sloan1993].
  void keep(const Edge& kept) {
    if (sides_.contains(sorted(kept[0], kept[1]))) return;
    std::deque<Edge> crossing = edges_across(kept);
    // Each round through the queue flips at least one edge; more rounds would be an endless loop.
    size_t flips_left = 4 * crossing.size() * crossing.size() + 16;
    while (!crossing.empty()) {
      if (flips_left-- == 0) refuse_crossing(kept);
      const Edge edge = crossing.front();
      crossing.pop_front();
      const auto [left, right] = opposite(edge);
      if (!(turn(left, right, edge[0]) * turn(left, right, edge[1]) < 0)) {
        crossing.push_back(edge);  // the quadrilateral is not convex yet
        continue;
      }
      flip(edge);
      if (crosses(sorted(left, right), kept)) crossing.push_back(sorted(left, right));
    }
    check_kept(kept);
  }

  /// Refuses a kept edge that is none: another took its place.
  void check_kept(const Edge& kept) const {
    if (!sides_.contains(sorted(kept[0], kept[1]))) refuse_crossing(kept);
  }

  std::vector<Triangle> take() && { return std::move(triangles_); }

 private:
  /// Returns the sign of the area of a triangle, counterclockwise > 0.
  int turn(int a, int b, int c) const {
    const auto at = [&](int k) { return points_[static_cast<size_t>(k)]; };
    const std::int64_t ux = at(b).x() - at(a).x(), uy = at(b).y() - at(a).y(),
                       vx = at(c).x() - at(a).x(), vy = at(c).y() - at(a).y(),
                       area = ux * vy - uy * vx;
    return (area > 0) - (area < 0);
  }
  bool crosses(const Edge& a, const Edge& b) const {
    if (a[0] == b[0] || a[0] == b[1] || a[1] == b[0] || a[1] == b[1]) return false;
    return turn(a[0], a[1], b[0]) * turn(a[0], a[1], b[1]) < 0 &&
           turn(b[0], b[1], a[0]) * turn(b[0], b[1], a[1]) < 0;
  }

  void add(int a, int b, int c) {
    const int area = turn(a, b, c);
    if (area == 0) return;
    const int triangle = static_cast<int>(triangles_.size());
    triangles_.push_back(area > 0 ? Triangle{a, b, c} : Triangle{a, c, b});
    join(triangle);
  }
  void join(int triangle) {
    const Triangle& t = triangles_[static_cast<size_t>(triangle)];
    for (size_t k = 0; k < 3; ++k) {
      // The triangle on the left of an edge from the lower to the higher index comes first.
      const int a = t[k], b = t[(k + 1) % 3];
      sides_.try_emplace(sorted(a, b), Edge{-1, -1}).first->second[a < b ? 0 : 1] = triangle;
    }
  }
  void part(int triangle) {
    const Triangle& t = triangles_[static_cast<size_t>(triangle)];
    for (size_t k = 0; k < 3; ++k) {
      const auto at = sides_.find(sorted(t[k], t[(k + 1) % 3]));
      std::ranges::replace(at->second, triangle, -1);
      if (at->second == Edge{-1, -1}) sides_.erase(at);
    }
  }
  /// Returns the corners of the two triangles beside an edge that are not on it.
  Edge opposite(const Edge& edge) const {
    const auto corner = [&](int triangle) {
      const Triangle& t = triangles_[static_cast<size_t>(triangle)];
      return *std::ranges::find_if(t, [&](int v) { return v != edge[0] && v != edge[1]; });
    };
    const Edge& beside = sides_.at(edge);
    return {corner(beside[0]), corner(beside[1])};
  }
  void flip(const Edge& edge) {
    const auto [left, right] = opposite(edge);
    const Edge beside = sides_.at(edge);
    for (const int triangle : beside) part(triangle);
    triangles_[static_cast<size_t>(beside[0])] = {left, right, edge[1]};
    triangles_[static_cast<size_t>(beside[1])] = {right, left, edge[0]};
    for (const int triangle : beside) {
      Triangle& t = triangles_[static_cast<size_t>(triangle)];
      if (turn(t[0], t[1], t[2]) < 0) std::swap(t[0], t[1]);
      join(triangle);
    }
  }
  std::deque<Edge> edges_across(const Edge& kept) const {
    std::deque<Edge> across;
    for (const auto& [edge, beside] : sides_)
      if (crosses(edge, kept)) across.push_back(edge);
    return across;
  }

  std::string place_of(int k) const {
    return fmt::format("({:.4g}, {:.4g}) m", point_m_(0, k), point_m_(1, k));
  }
  void refuse_same_places() const {
    std::map<std::pair<std::int32_t, std::int32_t>, int> first;
    for (int k = 0; k < point_m_.cols(); ++k) {
      const GridPoint& p = points_[static_cast<size_t>(k)];
      const auto [at, is_new] = first.try_emplace({p.x(), p.y()}, k);
      if (!is_new)
        throw InputError("outline", "two of its points lie at " + place_of(k),
                         "every point once, at least a billionth of the cloth from the next");
    }
  }
  [[noreturn]] void refuse_crossing(const Edge& kept) const {
    throw InputError("outline",
                     "the line from " + place_of(kept[0]) + " to " + place_of(kept[1]) +
                         " crosses another line or passes through a point",
                     "lines that meet at their ends only");
  }

  const Eigen::Matrix2Xd& point_m_;
  std::vector<GridPoint> points_;
  std::vector<Triangle> triangles_;
  std::map<Edge, Edge> sides_;  ///< the triangles beside every edge; -1: none
};

}  // namespace

std::vector<std::array<int, 3>> delaunay_triangles(const Eigen::Matrix2Xd& point_m,
                                                   const std::vector<std::array<int, 2>>& kept) {
  if (point_m.cols() < 3)
    throw InputError("outline", fmt::format("it has {} points", point_m.cols()), "three or more");
  Triangulation triangulation(point_m, on_grid(point_m));
  for (const Edge& edge : kept) triangulation.keep(edge);
  for (const Edge& edge : kept) triangulation.check_kept(edge);
  return std::move(triangulation).take();
}

}  // namespace clothfit
