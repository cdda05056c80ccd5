#include "model/topology/surface_parts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <map>
#include <set>
#include <utility>

namespace clothfit {
namespace {

/// Six times the volume of a tetrahedron in exact arithmetic; its sign.
int exact_side(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
               const Eigen::Vector3d& d) {
  using Exact = boost::multiprecision::cpp_rational;
  const auto from_d = [&](const Eigen::Vector3d& x) {
    return std::array{Exact(x.x()) - Exact(d.x()), Exact(x.y()) - Exact(d.y()),
                      Exact(x.z()) - Exact(d.z())};
  };
  const auto u = from_d(a), v = from_d(b), w = from_d(c);
  const Exact volume = u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
                       u[2] * (v[0] * w[1] - v[1] * w[0]);
  return volume.sign();
}

/// Says on which side of the plane through a, b and c the point d lies: 1, -1, or 0 in it.
int side_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
            const Eigen::Vector3d& d) {
  const Eigen::Vector3d u = a - d, v = b - d, w = c - d;
  const double volume = u.dot(v.cross(w));
  const Eigen::Vector3d bu = u.cwiseAbs(), bv = v.cwiseAbs(), bw = w.cwiseAbs();
  const double largest = bu.x() * (bv.y() * bw.z() + bv.z() * bw.y()) +
                         bu.y() * (bv.z() * bw.x() + bv.x() * bw.z()) +
                         bu.z() * (bv.x() * bw.y() + bv.y() * bw.x());
  // Rounding changes it by less than this [shewchuk1997].
  constexpr double kRounding = 8e-16;
  if (std::abs(volume) > kRounding * largest) return volume > 0 ? 1 : -1;
  return exact_side(a, b, c, d);
}

bool crosses(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Vector3d& a,
             const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  if (side_of(a, b, c, from) * side_of(a, b, c, to) >= 0) return false;
  const int first = side_of(from, to, a, b);
  return first != 0 && side_of(from, to, b, c) == first && side_of(from, to, c, a) == first;
}

}  // namespace

SurfaceParts::SurfaceParts(const Eigen::Matrix3Xi& triangle, const Eigen::Matrix3Xd& centre_m,
                           std::vector<int> joined)
    : joined_(std::move(joined)) {
  std::set<int> owned_points;
  std::map<std::array<int, 2>, int> edges;
  std::vector<Eigen::Index> kept;
  for (Eigen::Index t = 0; t < triangle.cols(); ++t) {
    const std::array<int, 3> corner{triangle(0, t), triangle(1, t), triangle(2, t)};
    if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) continue;
    Owned owned;
    for (size_t k = 0; k < 3; ++k) {
      if (owned_points.insert(corner[k]).second) owned.points.push_back(corner[k]);
      const auto [low, high] = std::minmax({corner[k], corner[(k + 1) % 3]});
      const auto [at, is_new] = edges.try_emplace({low, high}, static_cast<int>(edge_.size()));
      if (!is_new) continue;
      owned.edges.push_back(at->second);
      edge_.push_back({low, high});
    }
    triangle_.push_back(corner);
    owned_.push_back(owned);
    kept.push_back(t);
  }
  tree_ = TriangleTree(centre_m(Eigen::all, kept));
}

template <class A, class B>
bool SurfaceParts::joined(const A& a, const B& b) const {
  for (const int of_a : a)
    for (const int of_b : b)
      if (joined_[static_cast<size_t>(of_a)] == joined_[static_cast<size_t>(of_b)]) return true;
  return false;
}

std::vector<PartPair> SurfaceParts::near(const Eigen::Matrix3Xd& from_m,
                                         const Eigen::Matrix3Xd& move_m, double reach_m) {
  const auto box_of = [&](const auto& points) {
    Box box{from_m.col(points[0]), from_m.col(points[0])};
    for (const int point : points) {
      box.include(from_m.col(point));
      box.include(from_m.col(point) + move_m.col(point));
    }
    box.low.array() -= 0.5 * reach_m;
    box.high.array() += 0.5 * reach_m;
    return box;
  };
  std::vector<Box> of_triangle, of_edge;
  for (const auto& triangle : triangle_) of_triangle.push_back(box_of(triangle));
  for (const auto& edge : edge_) of_edge.push_back(box_of(edge));
  tree_.update(of_triangle);
  std::vector<PartPair> pairs;
  const auto add_points = [&](size_t a, size_t b) {
    for (const int point : owned_[a].points) {
      if (joined(std::array{point}, triangle_[b])) continue;
      if (!box_of(std::array{point}).meets(of_triangle[b])) continue;
      const auto& [i, j, k] = triangle_[b];
      pairs.push_back({PartPair::point_triangle, {point, i, j, k}});
    }
  };
  tree_.for_meetings([&](int first, int second) {
    const auto a = static_cast<size_t>(first), b = static_cast<size_t>(second);
    add_points(a, b);
    add_points(b, a);
    for (const int e : owned_[a].edges)
      for (const int f : owned_[b].edges) {
        const auto &one = edge_[static_cast<size_t>(e)], &other = edge_[static_cast<size_t>(f)];
        if (!of_edge[static_cast<size_t>(e)].meets(of_edge[static_cast<size_t>(f)]) ||
            joined(one, other))
          continue;
        pairs.push_back({PartPair::edge_edge, {one[0], one[1], other[0], other[1]}});
      }
  });
  return pairs;
}

int SurfaceParts::crossings(const Eigen::Matrix3Xd& position_m) {
  std::vector<Box> boxes;
  for (const auto& triangle : triangle_) {
    Box box{position_m.col(triangle[0]), position_m.col(triangle[0])};
    for (const int point : triangle) box.include(position_m.col(point));
    boxes.push_back(box);
  }
  tree_.update(boxes);
  int count = 0;
  const auto count_edges = [&](size_t a, size_t b) {
    const auto& [i, j, k] = triangle_[b];
    for (const int e : owned_[a].edges) {
      const auto& edge = edge_[static_cast<size_t>(e)];
      if (joined(edge, triangle_[b])) continue;
      count += crosses(position_m.col(edge[0]), position_m.col(edge[1]), position_m.col(i),
                       position_m.col(j), position_m.col(k));
    }
  };
  tree_.for_meetings([&](int a, int b) {
    count_edges(static_cast<size_t>(a), static_cast<size_t>(b));
    count_edges(static_cast<size_t>(b), static_cast<size_t>(a));
  });
  return count;
}

}  // namespace clothfit
