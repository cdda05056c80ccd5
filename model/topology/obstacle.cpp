#include "model/topology/obstacle.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <utility>

namespace clothfit {
namespace {

constexpr int kLeafTriangles = 4;

/// Numbers vertices so that those in the same place share one.
std::vector<int> weld(const Eigen::Matrix3Xd& vertex_m) {
  std::map<std::array<double, 3>, int> places;
  std::vector<int> number;
  for (Eigen::Index v = 0; v < vertex_m.cols(); ++v)
    number.push_back(places
                         .emplace(std::array{vertex_m(0, v), vertex_m(1, v), vertex_m(2, v)},
                                  static_cast<int>(places.size()))
                         .first->second);
  return number;
}

double squared_distance_to_box(const Eigen::Vector3d& point, const Eigen::Vector3d& low,
                               const Eigen::Vector3d& high) {
  return (low - point).cwiseMax(point - high).cwiseMax(0.0).squaredNorm();
}

}  // namespace

Obstacle::Obstacle(const TriangleMesh& mesh, double reach_m) : reach_m_(reach_m) {
  const std::vector<int> welded = weld(mesh.vertex_m);
  std::map<int, int> corner_rims;
  std::map<std::pair<int, int>, int> edge_rims;
  std::vector<int> faces_at;   // of each rim
  std::vector<int> run_along;  // of each rim: faces that run along it, less those that run against
  const auto rim_of = [&](auto& rims, const auto& key) {
    const auto [found, is_new] = rims.emplace(key, static_cast<int>(rims_.size()));
    if (is_new) {
      rims_.emplace_back();
      faces_at.push_back(0);
      run_along.push_back(0);
    }
    return found->second;
  };
  for (Eigen::Index t = 0; t < mesh.triangle.cols(); ++t) {
    Triangle triangle;
    std::array<int, 3> vertex;
    for (size_t n = 0; n < 3; ++n) {
      const int v = mesh.triangle(static_cast<Eigen::Index>(n), t);
      assert(v >= 0 && v < mesh.vertex_m.cols());
      triangle.corner[n] = mesh.vertex_m.col(v);
      vertex[n] = welded[static_cast<size_t>(v)];
    }
    const auto& [a, b, c] = triangle.corner;
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    if (!(normal.norm() > 0)) continue;
    triangle.normal = normal.normalized();
    for (size_t n = 0; n < 3; ++n) {
      const size_t next = (n + 1) % 3, last = (n + 2) % 3;
      const int edge = rim_of(edge_rims, std::minmax({vertex[n], vertex[next]}));
      const int corner = rim_of(corner_rims, vertex[n]);
      triangle.edge_rim[n] = edge;
      triangle.corner_rim[n] = corner;
      rims_[static_cast<size_t>(edge)].normal += triangle.normal;
      ++faces_at[static_cast<size_t>(edge)];
      run_along[static_cast<size_t>(edge)] += vertex[n] < vertex[next] ? 1 : -1;
      // The mean normal is weighted by the angle at the corner. It then tells inside from outside
      // wherever the corner is the nearest point, however its faces are cut into triangles.
      const Eigen::Vector3d to_next = (triangle.corner[next] - triangle.corner[n]).normalized();
      const Eigen::Vector3d to_last = (triangle.corner[last] - triangle.corner[n]).normalized();
      const double angle = std::acos(std::clamp(to_next.dot(to_last), -1.0, 1.0));
      rims_[static_cast<size_t>(corner)].normal += angle * triangle.normal;
    }
    triangles_.push_back(triangle);
  }
  for (const auto& [ends, edge] : edge_rims) {
    open_edges_ += run_along[static_cast<size_t>(edge)] != 0;
    if (faces_at[static_cast<size_t>(edge)] != 1) continue;
    rims_[static_cast<size_t>(edge)].border = true;
    rims_[static_cast<size_t>(corner_rims.at(ends.first))].border = true;
    rims_[static_cast<size_t>(corner_rims.at(ends.second))].border = true;
  }
  if (!triangles_.empty()) build_tree(0, triangles());
}

void Obstacle::build_tree(int first, int last) {
  const size_t here = nodes_.size();
  Node node{.low = Eigen::Vector3d::Constant(INFINITY),
            .high = Eigen::Vector3d::Constant(-INFINITY),
            .first = first,
            .count = last - first};
  for (int t = first; t < last; ++t) {
    for (const Eigen::Vector3d& corner : triangles_[static_cast<size_t>(t)].corner) {
      node.low = node.low.cwiseMin(corner);
      node.high = node.high.cwiseMax(corner);
    }
  }
  nodes_.push_back(node);
  if (node.count <= kLeafTriangles) return;
  // The split is in half, along the longest side. It is stable, so that the tree does not depend on
  // the library.
  Eigen::Index axis = 0;
  (node.high - node.low).maxCoeff(&axis);
  const auto begin = triangles_.begin();
  std::stable_sort(begin + first, begin + last, [axis](const Triangle& a, const Triangle& b) {
    return a.corner[0][axis] + a.corner[1][axis] + a.corner[2][axis] <
           b.corner[0][axis] + b.corner[1][axis] + b.corner[2][axis];
  });
  const int middle = (first + last) / 2;
  build_tree(first, middle);
  const auto second = static_cast<int>(nodes_.size());
  build_tree(middle, last);
  nodes_[here].first = second;
  nodes_[here].count = 0;
}

std::optional<Obstacle::Found> Obstacle::search(const Eigen::Vector3d& point_m,
                                                double within_m) const {
  if (nodes_.empty() || !point_m.allFinite()) return std::nullopt;
  double best = within_m * within_m;
  Nearest nearest;
  const Rim* rim = nullptr;
  bool found = false;

  const auto look_at = [&](const Triangle& triangle) {
    // Inside the triangle's prism the face is nearest, elsewhere one of the edges.
    const double height = triangle.normal.dot(point_m - triangle.corner[0]);
    if (height * height >= best) return;
    const Eigen::Vector3d foot = point_m - height * triangle.normal;
    bool inside = true;
    for (size_t n = 0; n < 3; ++n) {
      const Eigen::Vector3d side = triangle.corner[(n + 1) % 3] - triangle.corner[n];
      inside = inside && side.cross(foot - triangle.corner[n]).dot(triangle.normal) >= 0;
    }
    if (inside) {
      best = height * height;
      nearest = {Nearest::face, foot, triangle.normal};
      rim = nullptr;
      found = true;
      return;
    }
    for (size_t n = 0; n < 3; ++n) {
      const Eigen::Vector3d& from = triangle.corner[n];
      const Eigen::Vector3d side = triangle.corner[(n + 1) % 3] - from;
      const double share = side.dot(point_m - from) / side.squaredNorm();
      const Eigen::Vector3d place = from + std::clamp(share, 0.0, 1.0) * side;
      const double distance = (point_m - place).squaredNorm();
      if (distance >= best) continue;
      best = distance;
      found = true;
      if (share > 0 && share < 1) {
        nearest = {Nearest::edge, place, side.normalized()};
        rim = &rims_[static_cast<size_t>(triangle.edge_rim[n])];
      } else {
        nearest = {Nearest::corner, place, Eigen::Vector3d::Zero()};
        rim = &rims_[static_cast<size_t>(triangle.corner_rim[share > 0 ? (n + 1) % 3 : n])];
      }
    }
  };

  std::array<int, 64> waiting;  // halves of halves: deeper than any tree that fits into memory
  int count = 0;
  waiting[static_cast<size_t>(count++)] = 0;
  while (count > 0) {
    const int here = waiting[static_cast<size_t>(--count)];
    const Node& node = nodes_[static_cast<size_t>(here)];
    if (squared_distance_to_box(point_m, node.low, node.high) >= best) continue;
    if (node.count > 0) {
      for (int t = node.first; t < node.first + node.count; ++t)
        look_at(triangles_[static_cast<size_t>(t)]);
      continue;
    }
    const auto distance = [&](int child) {
      const Node& box = nodes_[static_cast<size_t>(child)];
      return squared_distance_to_box(point_m, box.low, box.high);
    };
    int near = here + 1, far = node.first;
    if (distance(far) < distance(near)) std::swap(near, far);
    waiting[static_cast<size_t>(count++)] = far;
    waiting[static_cast<size_t>(count++)] = near;
  }
  if (!found) return std::nullopt;
  return Found{nearest, rim};
}

std::optional<Obstacle::Nearest> Obstacle::beneath(const Eigen::Vector3d& point_m) const {
  const std::optional<Found> found = search(point_m, reach_m_);
  if (!found) return std::nullopt;
  const bool below = found->outwards().dot(point_m - found->nearest.place_m) < 0;
  if (!below || (found->rim && found->rim->border)) return std::nullopt;
  return found->nearest;
}

std::optional<Obstacle::Distance> Obstacle::distance(const Eigen::Vector3d& point_m,
                                                     double within_m) const {
  const std::optional<Found> found = search(point_m, within_m);
  if (!found) return std::nullopt;
  const Eigen::Vector3d away = point_m - found->nearest.place_m, outwards = found->outwards();
  const double length_m = away.norm(), sign = away.dot(outwards) < 0 ? -1 : 1;
  // On the surface the way out of it has no length; its normal shows it.
  return Distance{.distance_m = sign * length_m,
                  .outwards = length_m > 1e-12 ? Eigen::Vector3d(sign / length_m * away)
                                               : outwards.normalized(),
                  .place_m = found->nearest.place_m};
}

double Obstacle::volume_m3() const {
  double sixfold_m3 = 0;
  for (const Triangle& triangle : triangles_)
    sixfold_m3 += triangle.corner[0].dot(triangle.corner[1].cross(triangle.corner[2]));
  return sixfold_m3 / 6;
}

}  // namespace clothfit
