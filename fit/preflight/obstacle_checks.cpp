#include "fit/preflight/obstacle_checks.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "fit/preflight/checks.h"
#include "fit/preflight/criteria.h"

namespace clothfit {
namespace {

/// Numbers vertices so that those in the same place share one.
std::vector<int> places_of(const SurfaceMesh& surface) {
  std::map<std::array<double, 3>, int> numbers;
  std::vector<int> result;
  for (const auto& vertex : surface.vertex_m.colwise())
    result.push_back(numbers
                         .emplace(std::array{vertex.x(), vertex.y(), vertex.z()},
                                  static_cast<int>(numbers.size()))
                         .first->second);
  return result;
}

/// The edges of a surface, each with how often faces run along it one way less the other.
std::map<std::pair<int, int>, int> edges_of(const SurfaceMesh& surface,
                                            const std::vector<int>& place) {
  std::map<std::pair<int, int>, int> balance;
  for (const auto& face : surface.triangle.colwise())
    for (Eigen::Index n = 0; n < 3; ++n) {
      const int from = place[static_cast<size_t>(face[n])],
                to = place[static_cast<size_t>(face[(n + 1) % 3])];
      if (from != to) balance[std::minmax(from, to)] += from < to ? 1 : -1;
    }
  return balance;
}

double volume_m3(const SurfaceMesh& surface) {
  double volume = 0;
  for (const auto& face : surface.triangle.colwise())
    volume += surface.vertex_m.col(face[0])
                  .cross(Eigen::Vector3d(surface.vertex_m.col(face[1])))
                  .dot(surface.vertex_m.col(face[2])) /
              6;
  return volume;
}

int root_of(std::vector<int>& parent, int n) {
  while (parent[static_cast<size_t>(n)] != n) {
    parent[static_cast<size_t>(n)] = parent[static_cast<size_t>(parent[static_cast<size_t>(n)])];
    n = parent[static_cast<size_t>(n)];
  }
  return n;
}

/// Says whether a segment crosses a triangle.
bool crosses(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Vector3d& a,
             const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double above = normal.dot(from - a), below = normal.dot(to - a);
  if (!(above * below < 0)) return false;
  const Eigen::Vector3d at = from + above / (above - below) * (to - from);
  return normal.dot((b - a).cross(at - a)) > 0 && normal.dot((c - b).cross(at - b)) > 0 &&
         normal.dot((a - c).cross(at - c)) > 0;
}

Finding inside_out(double volume_m3, const std::string& where) {
  return {.check = "obstacle",
          .state = FindingState::refused,
          .found = fmt::format("its faces point inwards (it encloses {:.3g} m3)", volume_m3),
          .where = where,
          .expected = "corners counterclockwise as seen from outside",
          .remedy = "turn its faces round"};
}

/// A few may touch it; a cloth that starts inside is thrown out.
Finding inside_at_start(size_t count, size_t of, const char* what, const std::string& where) {
  const bool most = static_cast<double>(count) > kPreflight.inside_share * static_cast<double>(of);
  return {
      .check = "obstacle",
      .state = most ? FindingState::refused : FindingState::warning,
      .found = fmt::format("{} of {} {} of the cloth lie inside it at the start", count, of, what),
      .where = where,
      .expected = "a cloth that starts outside",
      .remedy = "are both in metres and in the world's axes?"};
}

bool boxes_meet(const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                const Eigen::Vector3d& other_low, const Eigen::Vector3d& other_high) {
  return (low.array() <= other_high.array()).all() && (other_low.array() <= high.array()).all();
}

bool is_pierced(const SurfaceMesh& surface, const std::vector<std::pair<int, int>>& edges,
                const Mesh& mesh, const Eigen::Matrix3Xd& position_m) {
  for (const auto& [one, other] : edges) {
    const Eigen::Vector3d from = surface.vertex_m.col(one), to = surface.vertex_m.col(other);
    const Eigen::Vector3d low = from.cwiseMin(to), high = from.cwiseMax(to);
    for (int i = 0; i + 1 < mesh.rows; ++i)
      for (int j = 0; j + 1 < mesh.columns; ++j) {
        const Eigen::Vector3d a = position_m.col(mesh.vertex(i, j)),
                              b = position_m.col(mesh.vertex(i, j + 1)),
                              c = position_m.col(mesh.vertex(i + 1, j)),
                              d = position_m.col(mesh.vertex(i + 1, j + 1));
        if (!boxes_meet(low, high, a.cwiseMin(b).cwiseMin(c).cwiseMin(d),
                        a.cwiseMax(b).cwiseMax(c).cwiseMax(d)))
          continue;
        if (crosses(from, to, a, b, c) || crosses(from, to, b, d, c)) return true;
      }
  }
  return false;
}

}  // namespace

std::optional<double> enclosed_volume_m3(const SurfaceMesh& surface) {
  const auto edges = edges_of(surface, places_of(surface));
  const bool closed = !edges.empty() &&
                      std::ranges::all_of(edges, [](const auto& edge) { return edge.second == 0; });
  if (!closed) return std::nullopt;
  return volume_m3(surface);
}

std::vector<bool> inside(const SurfaceMesh& surface, const Eigen::Matrix3Xd& point_m) {
  // The solid angle of the surface, seen from inside, is that of the whole sphere.
  std::vector<bool> result;
  for (const auto& point : point_m.colwise()) {
    double angle = 0;
    for (const auto& face : surface.triangle.colwise()) {
      const Eigen::Vector3d a = surface.vertex_m.col(face[0]) - point,
                            b = surface.vertex_m.col(face[1]) - point,
                            c = surface.vertex_m.col(face[2]) - point;
      const double la = a.norm(), lb = b.norm(), lc = c.norm();
      angle += 2 * std::atan2(a.cross(b).dot(c),
                              la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    result.push_back(std::abs(angle) > 2 * std::numbers::pi);
  }
  return result;
}

double share_behind(const SurfaceMesh& surface, const Eigen::Matrix3Xd& point_m) {
  int behind = 0, told = 0;
  for (const auto& point : point_m.colwise()) {
    double nearest_m = INFINITY, height_m = 0;
    for (const auto& face : surface.triangle.colwise()) {
      const Eigen::Vector3d a = surface.vertex_m.col(face[0]), b = surface.vertex_m.col(face[1]),
                            c = surface.vertex_m.col(face[2]);
      const Eigen::Vector3d normal = (b - a).cross(c - a).stableNormalized();
      const double height = normal.dot(point - a);
      const Eigen::Vector3d foot = point - height * normal;
      const bool over = normal.dot((b - a).cross(foot - a)) >= 0 &&
                        normal.dot((c - b).cross(foot - b)) >= 0 &&
                        normal.dot((a - c).cross(foot - c)) >= 0;
      if (!over || std::abs(height) >= nearest_m) continue;
      nearest_m = std::abs(height);
      height_m = height;
    }
    if (!std::isfinite(nearest_m)) continue;
    ++told;
    if (height_m < 0) ++behind;
  }
  return told > 0 ? static_cast<double>(behind) / told : 0;
}

std::optional<double> narrowest_part_m(const SurfaceMesh& surface) {
  const std::vector<int> place = places_of(surface);
  std::vector<int> parent(place.size());
  std::iota(parent.begin(), parent.end(), 0);
  for (const auto& face : surface.triangle.colwise())
    for (Eigen::Index n = 1; n < 3; ++n)
      parent[static_cast<size_t>(root_of(parent, place[static_cast<size_t>(face[n])]))] =
          root_of(parent, place[static_cast<size_t>(face[0])]);
  std::map<int, std::vector<Eigen::Index>> parts;
  for (const auto& face : surface.triangle.colwise())
    for (const int vertex : face)
      parts[root_of(parent, place[static_cast<size_t>(vertex)])].push_back(vertex);
  std::optional<double> narrowest;
  for (const auto& [root, vertices] : parts) {
    const Eigen::Matrix3Xd corner = surface.vertex_m(Eigen::all, vertices);
    Eigen::Vector3d sides = corner.rowwise().maxCoeff() - corner.rowwise().minCoeff();
    std::ranges::sort(sides);
    narrowest = std::min(narrowest.value_or(INFINITY), sides[1]);
  }
  return narrowest;
}

std::optional<int> frame_pierced(const SurfaceMesh& surface, const Mesh& mesh,
                                 const std::vector<Eigen::Matrix3Xd>& position_m) {
  const std::vector<int> place = places_of(surface);
  std::map<int, int> vertex_at;
  for (size_t v = 0; v < place.size(); ++v) vertex_at.emplace(place[v], static_cast<int>(v));
  std::vector<std::pair<int, int>> edges;
  for (const auto& [ends, balance] : edges_of(surface, place))
    edges.emplace_back(vertex_at.at(ends.first), vertex_at.at(ends.second));
  for (size_t f = 0; f < position_m.size(); ++f)
    if (is_pierced(surface, edges, mesh, position_m[f])) return static_cast<int>(f);
  return std::nullopt;
}

Findings check_obstacle(const SurfaceMesh& surface, const std::string& where, const Mesh& mesh,
                        const Eigen::Matrix3Xd& start_m) {
  if (const auto volume_m3 = enclosed_volume_m3(surface)) {
    if (*volume_m3 < 0) return {inside_out(*volume_m3, where)};
    const std::vector<bool> is_inside = inside(surface, start_m);
    if (const auto count = std::ranges::count(is_inside, true); count > 0)
      return {inside_at_start(static_cast<size_t>(count), is_inside.size(), "vertices", where)};
  } else if (const double share = share_behind(surface, start_m); share > kPreflight.behind_share) {
    return {{.check = "obstacle",
             .state = FindingState::warning,
             .found = fmt::format("{:.0f} % of the cloth starts behind its faces", 100 * share),
             .where = where,
             .expected = "corners counterclockwise as seen from the side of the cloth",
             .remedy = "turn its faces round"}};
  }
  const double cell_m =
      std::max(mesh.width_m / (mesh.columns - 1), mesh.height_m / (mesh.rows - 1));
  const auto narrow_m = narrowest_part_m(surface);
  if (!narrow_m || *narrow_m >= cell_m) return {};
  return {
      {.check = "obstacle",
       .state = FindingState::warning,
       .found = fmt::format("it has parts {:.3g} mm wide, and cells of the cloth are {:.3g} mm",
                            1e3 * *narrow_m, 1e3 * cell_m),
       .where = where,
       .expected = "parts wider than a cell: vertices alone touch it, and cloth may fall through",
       .remedy = fmt::format("a finer mesh, of {} columns or more",
                             static_cast<int>(std::ceil(mesh.width_m / *narrow_m)) + 1)}};
}

std::optional<Finding> check_pierced(const SurfaceMesh& surface, const std::string& where,
                                     const Mesh& mesh,
                                     const std::vector<Eigen::Matrix3Xd>& position_m) {
  const auto frame = frame_pierced(surface, mesh, position_m);
  if (!frame) return std::nullopt;
  return Finding{.check = "obstacle",
                 .state = FindingState::warning,
                 .found = fmt::format("the cloth goes through it, in frame {} first", *frame),
                 .where = where,
                 .expected = "a cloth that stays outside: vertices alone touch an obstacle",
                 .remedy = "a finer mesh, or a stiffer contact"};
}

void check_obstacle(const RecordedMotion& motion, CheckList& list) {
  const Recording& recording = motion.recording();
  if (!recording.obstacle) return;
  const SurfaceMesh& surface = *recording.obstacle;
  const std::string file =
      recording.obstacle_file ? recording.obstacle_file->string() : list.file();
  const auto volume_m3 = enclosed_volume_m3(surface);
  if (volume_m3 && *volume_m3 < 0) return list.add(inside_out(*volume_m3, file));
  if (motion.set(0).camera || motion.first_frame(0) < 0) return;
  // Whether the cloth comes near it is seen in 3D tracks alone.
  double nearest_m = INFINITY;
  const Eigen::Vector3d low = surface.vertex_m.rowwise().minCoeff(),
                        high = surface.vertex_m.rowwise().maxCoeff();
  for (const int f : motion.sampled_frames(60)) {
    const Eigen::MatrixXd place = motion.places(0, f);
    for (int m = 0; m < motion.markers(); ++m) {
      if (!place.col(m).allFinite()) continue;
      const Eigen::Vector3d at = place.col(m);
      nearest_m = std::min(nearest_m, (low - at).cwiseMax(at - high).cwiseMax(0.0).norm());
    }
  }
  if (nearest_m > 0.25 * motion.size_m())
    list.add("obstacle", FindingState::warning, file,
             fmt::format("no marker comes nearer to it than {:.3g} mm", 1e3 * nearest_m),
             "an obstacle that the cloth meets",
             "metres and the world's axes, as the tracks have?");
  if (!volume_m3) return;
  const Eigen::MatrixXd first = motion.places(0, motion.first_frame(0));
  std::vector<Eigen::Index> seen;
  for (Eigen::Index m = 0; m < first.cols(); ++m)
    if (first.col(m).allFinite()) seen.push_back(m);
  const std::vector<bool> is_inside = inside(surface, first(Eigen::all, seen));
  const auto count = static_cast<size_t>(std::ranges::count(is_inside, true));
  if (static_cast<double>(count) > kPreflight.inside_share * static_cast<double>(seen.size()))
    list.add(inside_at_start(count, seen.size(), "markers", file));
}

}  // namespace clothfit
