#include "model/topology/cloth_mesh.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "data/input_error.h"
#include "model/topology/delaunay.h"

namespace clothfit {
namespace {

using Points = Eigen::Matrix2Xd;
using Edge = std::array<int, 2>;
using Triangle = std::array<int, 3>;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

double signed_area_m2(const Points& loop_m) {
  double twice = 0;
  for (Eigen::Index k = 0; k < loop_m.cols(); ++k)
    twice += cross(loop_m.col(k), loop_m.col((k + 1) % loop_m.cols()));
  return 0.5 * twice;
}

/// Returns where closed lines cross the level t, rising: the cloth lies between the first and the
/// second, the third and the fourth.
std::vector<double> crossings_s_m(const std::vector<Points>& loops_m, double t_m) {
  std::vector<double> s_m;
  for (const Points& loop : loops_m)
    for (Eigen::Index k = 0; k < loop.cols(); ++k) {
      const Eigen::Vector2d a = loop.col(k), b = loop.col((k + 1) % loop.cols());
      if ((a.y() <= t_m) != (b.y() <= t_m))
        s_m.push_back(a.x() + (t_m - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
    }
  std::ranges::sort(s_m);
  return s_m;
}

/// Says whether a point lies inside an odd number of closed lines.
bool is_inside(const std::vector<Points>& loops_m, const Eigen::Vector2d& point_m) {
  const std::vector<double> s_m = crossings_s_m(loops_m, point_m.y());
  return (std::ranges::upper_bound(s_m, point_m.x()) - s_m.begin()) % 2 == 1;
}

double distance_m(const Eigen::Vector2d& point_m, const Eigen::Vector2d& a,
                  const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double share = std::clamp((point_m - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (a + share * along - point_m).norm();
}

/// Turns borders so that the cloth is on their left.
std::vector<Points> turned(std::vector<Points> border_m) {
  const std::vector<Points> all = border_m;
  for (size_t k = 0; k < all.size(); ++k) {
    std::vector<Points> others = all;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
    const bool is_hole = is_inside(others, all[k].col(0));
    if ((signed_area_m2(all[k]) > 0) == is_hole) border_m[k] = all[k].rowwise().reverse();
  }
  return border_m;
}

/// Vertices, and the edges between them that triangles must have.
struct Skeleton {
  std::vector<Eigen::Vector2d> vertex_m;
  std::vector<Edge> border, line;  ///< a border's edges have the cloth on their left
  std::vector<std::vector<int>> border_vertices, line_vertices;

  void add_border(const Points& loop_m) {
    border_vertices.push_back(add(loop_m));
    const std::vector<int>& of = border_vertices.back();
    for (size_t k = 0; k < of.size(); ++k) border.push_back({of[k], of[(k + 1) % of.size()]});
  }
  /// An open line may end where it begins: that vertex is there once.
  void add_line(const Points& line_m) {
    const bool closed = line_m.cols() > 2 && line_m.col(0) == line_m.rightCols(1);
    std::vector<int> of = add(closed ? Points(line_m.leftCols(line_m.cols() - 1)) : line_m);
    if (closed) of.push_back(of.front());
    for (size_t k = 0; k + 1 < of.size(); ++k) line.push_back({of[k], of[k + 1]});
    line_vertices.push_back(std::move(of));
  }
  Points points() const {
    Points result(2, static_cast<Eigen::Index>(vertex_m.size()));
    for (size_t k = 0; k < vertex_m.size(); ++k)
      result.col(static_cast<Eigen::Index>(k)) = vertex_m[k];
    return result;
  }

 private:
  std::vector<int> add(const Points& points_m) {
    std::vector<int> indices;
    for (const auto& point : points_m.colwise()) {
      indices.push_back(static_cast<int>(vertex_m.size()));
      vertex_m.emplace_back(point);
    }
    return indices;
  }
};

/// Vertices at the lattice's points, by row and column.
using Lattice = std::map<std::array<int, 2>, int>;

/// Adds the vertices of the lattice that are inside and far enough from all lines. Points of lines
/// that lie on the lattice belong to it too.
Lattice add_lattice(const std::vector<Points>& border_m, double spacing_m, Skeleton& skeleton) {
  const Points lines = skeleton.points();
  const Eigen::Vector2d low = lines.rowwise().minCoeff(), high = lines.rowwise().maxCoeff();
  const auto place = [&](int i, int j) -> Eigen::Vector2d {
    return low + spacing_m * Eigen::Vector2d(j, i);
  };
  // Lines clear what is nearer than this; less would make flat triangles beside them.
  const double clearance_m = (0.5 - 1e-9) * spacing_m;
  std::set<std::array<int, 2>> cleared;
  const auto index = [&](double m) { return static_cast<int>(std::floor(m / spacing_m)); };
  for (const std::vector<Edge>* edges : {&skeleton.border, &skeleton.line})
    for (const auto& [from, to] : *edges) {
      const Eigen::Vector2d a = lines.col(from), b = lines.col(to);
      const Eigen::Vector2d least = a.cwiseMin(b) - low, most = a.cwiseMax(b) - low;
      for (int i = index(least.y()) - 1; i <= index(most.y()) + 2; ++i)
        for (int j = index(least.x()) - 1; j <= index(most.x()) + 2; ++j)
          if (distance_m(place(i, j), a, b) < clearance_m) cleared.insert({i, j});
    }
  Lattice lattice;
  for (int k = 0; k < lines.cols(); ++k) {
    const Eigen::Vector2d at = (lines.col(k) - low) / spacing_m, nearest = at.array().round();
    if ((at - nearest).norm() < 1e-6)
      lattice[{static_cast<int>(nearest.y()), static_cast<int>(nearest.x())}] = k;
  }
  for (int i = 0; i <= index(high.y() - low.y()) + 1; ++i) {
    const std::vector<double> s_m = crossings_s_m(border_m, place(i, 0).y());
    for (size_t k = 0; k + 1 < s_m.size(); k += 2)
      for (int j = index(s_m[k] - low.x()); place(i, j).x() <= s_m[k + 1]; ++j)
        if (place(i, j).x() >= s_m[k] && !cleared.contains({i, j})) {
          lattice[{i, j}] = static_cast<int>(skeleton.vertex_m.size());
          skeleton.vertex_m.push_back(place(i, j));
        }
  }
  return lattice;
}

/// Returns the triangles on the left of the border's edges and all that hang together with them.
std::vector<Triangle> inner_triangles(const std::vector<Triangle>& triangles,
                                      const std::vector<Edge>& border) {
  std::map<Edge, int> left_of;  // directed edge to its triangle
  for (size_t n = 0; n < triangles.size(); ++n)
    for (size_t k = 0; k < 3; ++k)
      left_of[{triangles[n][k], triangles[n][(k + 1) % 3]}] = static_cast<int>(n);
  const std::set<Edge> walls(border.begin(), border.end());
  std::vector<bool> inner(triangles.size(), false);
  std::vector<int> open;
  const auto enter = [&](const Edge& edge) {
    const auto at = left_of.find(edge);
    if (at == left_of.end() || inner[static_cast<size_t>(at->second)]) return;
    inner[static_cast<size_t>(at->second)] = true;
    open.push_back(at->second);
  };
  for (const Edge& edge : border) enter(edge);
  while (!open.empty()) {
    const Triangle t = triangles[static_cast<size_t>(open.back())];
    open.pop_back();
    for (size_t k = 0; k < 3; ++k) {
      const Edge edge{t[k], t[(k + 1) % 3]};
      if (!walls.contains(edge)) enter({edge[1], edge[0]});
    }
  }
  std::vector<Triangle> result;
  for (size_t n = 0; n < triangles.size(); ++n)
    if (inner[n]) result.push_back(triangles[n]);
  return result;
}

Edge undirected(int a, int b) {
  return {std::min(a, b), std::max(a, b)};
}

/// Returns a triangle that begins with its lowest corner.
Triangle rotated(Triangle t) {
  std::ranges::rotate(t, std::ranges::min_element(t));
  return t;
}

ClothCell cell_of(const std::vector<int>& corners, const Points& material_m) {
  ClothCell cell{.corners = static_cast<int>(corners.size())};
  std::ranges::copy(corners, cell.vertex.begin());
  // The cell's own coordinates: a triangle's run along two of its sides, a square's through the
  // middles of opposite ones.
  Eigen::Matrix<double, 2, 4> by_own = Eigen::Matrix<double, 2, 4>::Zero();
  if (cell.corners == 3)
    by_own.leftCols<3>() << -1, 1, 0, -1, 0, 1;
  else
    by_own << -0.5, 0.5, 0.5, -0.5, -0.5, -0.5, 0.5, 0.5;
  Eigen::Matrix2d material_by_own = Eigen::Matrix2d::Zero();
  double twice_m2 = 0;
  for (size_t k = 0; k < corners.size(); ++k) {
    const Eigen::Vector2d here = material_m.col(corners[k]),
                          next = material_m.col(corners[(k + 1) % corners.size()]);
    material_by_own += here * by_own.col(static_cast<Eigen::Index>(k)).transpose();
    twice_m2 += cross(here, next);
  }
  cell.gradient_per_m = material_by_own.inverse().transpose() * by_own;
  cell.area_m2 = 0.5 * twice_m2;
  return cell;
}

/// Makes cells of the triangles. Two that fill a square of the lattice become one.
std::vector<ClothCell> cells_of(const std::vector<Triangle>& triangles, const Lattice& lattice,
                                const std::vector<Edge>& lines, const Points& material_m) {
  std::set<Triangle> left;
  for (const Triangle& t : triangles) left.insert(rotated(t));
  std::set<Edge> kept;
  for (const auto& [a, b] : lines) kept.insert(undirected(a, b));
  std::vector<ClothCell> cells;
  for (const auto& [at, corner] : lattice) {
    const auto [i, j] = at;
    const auto find = [&](int row, int column) {
      const auto found = lattice.find({row, column});
      return found == lattice.end() ? -1 : found->second;
    };
    const int right = find(i, j + 1), above = find(i + 1, j + 1), up = find(i + 1, j);
    if (right < 0 || above < 0 || up < 0) continue;
    struct Cut {
      Triangle first, second;
      Edge diagonal;
    };
    for (const auto& [first, second, diagonal] :
         {Cut{{corner, right, above}, {corner, above, up}, undirected(corner, above)},
          Cut{{corner, right, up}, {right, above, up}, undirected(right, up)}})
      if (!kept.contains(diagonal) && left.contains(rotated(first)) &&
          left.contains(rotated(second))) {
        left.erase(rotated(first));
        left.erase(rotated(second));
        cells.push_back(cell_of({corner, right, above, up}, material_m));
        break;
      }
  }
  for (const Triangle& t : left) cells.push_back(cell_of({t[0], t[1], t[2]}, material_m));
  return cells;
}

void check(const ClothOutline& outline, double spacing_m) {
  if (!(spacing_m > 0) || !std::isfinite(spacing_m))
    throw InputError("spacing_m", fmt::format("it is {:g} m", spacing_m), "a length > 0");
  if (outline.border_m.empty())
    throw InputError("outline", "it has no border", "at least one closed line");
  for (const Points& loop : outline.border_m)
    if (loop.cols() < 3 || !loop.allFinite() || signed_area_m2(loop) == 0)
      throw InputError("outline",
                       fmt::format("a border of {} points has no area inside", loop.cols()),
                       "three or more points around an area");
}

}  // namespace

Points sampled_m(const Points& corner_m, double spacing_m) {
  std::vector<Eigen::Vector2d> points;
  for (Eigen::Index k = 0; k < corner_m.cols(); ++k) {
    const Eigen::Vector2d a = corner_m.col(k), b = corner_m.col((k + 1) % corner_m.cols());
    // A length that is a whole number of spacings but for rounding is cut into so many.
    const int parts = std::max(1, static_cast<int>(std::ceil((b - a).norm() / spacing_m - 1e-6)));
    for (int part = 0; part < parts; ++part)
      points.emplace_back(a + static_cast<double>(part) / parts * (b - a));
  }
  Points result(2, static_cast<Eigen::Index>(points.size()));
  for (size_t k = 0; k < points.size(); ++k) result.col(static_cast<Eigen::Index>(k)) = points[k];
  return result;
}

Points circle_m(double radius_m, double spacing_m) {
  const int count =
      std::max(3, static_cast<int>(std::ceil(2 * std::numbers::pi * radius_m / spacing_m - 1e-6)));
  Points result(2, count);
  for (int k = 0; k < count; ++k) {
    const double angle = 2 * std::numbers::pi * k / count;
    result.col(k) = radius_m * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
  return result;
}

Points opened_m(const Points& closed_m) {
  Points result(2, closed_m.cols() + 1);
  result << closed_m, closed_m.col(0);
  return result;
}

Eigen::Matrix3Xi ClothMesh::triangles() const {
  std::vector<Eigen::Vector3i> all;
  for (const ClothCell& cell : cells) {
    all.emplace_back(cell.vertex[0], cell.vertex[1], cell.vertex[2]);
    if (cell.corners == 4) all.emplace_back(cell.vertex[0], cell.vertex[2], cell.vertex[3]);
  }
  Eigen::Matrix3Xi result(3, static_cast<Eigen::Index>(all.size()));
  for (size_t k = 0; k < all.size(); ++k) result.col(static_cast<Eigen::Index>(k)) = all[k];
  return result;
}

ClothMesh mesh_cloth(const ClothOutline& outline, double spacing_m) {
  check(outline, spacing_m);
  const std::vector<Points> border_m = turned(outline.border_m);
  Skeleton skeleton;
  for (const Points& loop : border_m) skeleton.add_border(loop);
  for (const Points& line : outline.line_m) skeleton.add_line(line);
  const Lattice lattice = add_lattice(border_m, spacing_m, skeleton);

  ClothMesh mesh;
  mesh.spacing_m = spacing_m;
  mesh.material_m = skeleton.points();
  mesh.border = skeleton.border_vertices;
  mesh.line = skeleton.line_vertices;
  std::vector<Edge> kept = skeleton.border;
  kept.insert(kept.end(), skeleton.line.begin(), skeleton.line.end());
  const std::vector<Triangle> inner =
      inner_triangles(delaunay_triangles(mesh.material_m, kept), skeleton.border);
  mesh.cells = cells_of(inner, lattice, skeleton.line, mesh.material_m);
  mesh.area_m2 = Eigen::VectorXd::Zero(mesh.vertex_count());
  for (const ClothCell& cell : mesh.cells)
    for (int k = 0; k < cell.corners; ++k)
      mesh.area_m2[cell.vertex[static_cast<size_t>(k)]] += cell.area_m2 / cell.corners;
  return mesh;
}

}  // namespace clothfit
