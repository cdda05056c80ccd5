#include "fit/preflight/obstacle_checks.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "fit/preflight/checks.h"
#include "fit/preflight/criteria.h"
#include "model/topology/obstacle.h"

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

/// How much of a cloth starts behind a surface, by more than touching it and noise make.
struct Behind {
  size_t count = 0, of = 0;
  double share() const { return of > 0 ? static_cast<double>(count) / static_cast<double>(of) : 0; }
};

Behind behind(const SurfaceMesh& surface, const Eigen::Matrix3Xd& start_m, double touches_m) {
  const auto deep = [&](const SurfaceMesh& of) {
    const std::vector<double> depth_m = depth_behind_m(of, start_m);
    return static_cast<size_t>(
        std::ranges::count_if(depth_m, [&](double depth) { return depth > touches_m; }));
  };
  Behind result{.count = deep(surface), .of = static_cast<size_t>(start_m.cols())};
  if (enclosed_volume_m3(surface)) return result;
  // Of an open one, points beyond its border lie on neither side.
  SurfaceMesh turned = surface;
  turned.triangle.row(1).swap(turned.triangle.row(2));
  result.of = result.count + deep(turned);
  return result;
}

/// Says that faces look away from the cloth, or that it starts inside; nothing where neither is so.
/// A closed surface may hold the cloth in it, as a box does, where its faces point inwards.
std::optional<Finding> wrong_side(const std::optional<double>& volume_m3, const Behind& start,
                                  const std::string& where) {
  Finding finding{.check = "obstacle",
                  .state = FindingState::refused,
                  .found = "",
                  .where = where,
                  .expected = "",
                  .remedy = "turn its faces round"};
  const bool most = start.share() > kPreflight.inside_share;
  if (volume_m3 && *volume_m3 < 0) {
    if (start.of > 0 && !most) return std::nullopt;
    if (start.of == 0) finding.state = FindingState::warning;
    finding.found = fmt::format("its faces point inwards (it encloses {:.3g} m3)", *volume_m3);
    finding.expected = "corners counterclockwise as seen from the side of the cloth";
  } else if (volume_m3) {
    if (start.count == 0) return std::nullopt;
    if (!most) finding.state = FindingState::warning;
    finding.found = fmt::format("{} of {} points of the cloth lie inside it at the start",
                                start.count, start.of);
    finding.expected = "a cloth that starts outside";
    finding.remedy =
        "are both in metres and in the world's axes? a container's faces point inwards";
  } else {
    if (start.share() <= kPreflight.behind_share) return std::nullopt;
    finding.state = FindingState::warning;
    finding.found =
        fmt::format("{:.0f} % of the cloth starts behind its faces", 100 * start.share());
    finding.expected = "corners counterclockwise as seen from the side of the cloth";
  }
  return finding;
}

std::optional<Finding> too_narrow(const SurfaceMesh& surface, const std::string& where,
                                  const Mesh& mesh) {
  const double cell_m = std::max(mesh.spacing_s_m(), mesh.spacing_t_m());
  const auto narrow_m = narrowest_part_m(surface);
  if (!narrow_m || *narrow_m >= cell_m) return std::nullopt;
  return Finding{
      .check = "obstacle",
      .state = FindingState::warning,
      .found = fmt::format("it has parts {:.3g} mm wide, and cells of the cloth are {:.3g} mm",
                           1e3 * *narrow_m, 1e3 * cell_m),
      .where = where,
      .expected = "parts wider than a cell: vertices alone touch it, and cloth may fall through",
      .remedy = fmt::format("a finer mesh, of {} columns or more",
                            static_cast<int>(std::ceil(mesh.width_m / *narrow_m)) + 1)};
}

/// Returns where a recorded cloth starts, at most a few hundred points of it: its markers in space,
/// or the sheet that the cameras see. Nothing is returned where that is not known.
Eigen::Matrix3Xd recorded_start_m(const RecordedMotion& motion) {
  constexpr int kMost = 400;
  std::vector<Eigen::Vector3d> points;
  if (!motion.set(0).camera) {
    if (motion.first_frame(0) < 0) return {};
    const Eigen::MatrixXd place = motion.places(0, motion.first_frame(0));
    const int stride = std::max(1, motion.markers() / kMost);
    for (int m = 0; m < motion.markers(); m += stride)
      if (place.col(m).allFinite()) points.emplace_back(place.col(m));
  } else if (motion.flat_sheet() && motion.recording().start == StartKind::released_flat) {
    for (int m = 0; m < motion.markers(); ++m)
      points.emplace_back(*motion.flat_sheet() *
                          Eigen::Vector3d(motion.marker_m()(0, m), motion.marker_m()(1, m), 0));
  }
  Eigen::Matrix3Xd start_m(3, static_cast<Eigen::Index>(points.size()));
  for (size_t k = 0; k < points.size(); ++k) start_m.col(static_cast<Eigen::Index>(k)) = points[k];
  return start_m;
}

/// Returns how near the cloth comes to an obstacle's box, m. In pictures that is how near it may
/// swing from where the first frame shows it.
double nearest_to_obstacle_m(const RecordedMotion& motion) {
  const SurfaceMesh& surface = *motion.recording().obstacle;
  const Eigen::Vector3d low = surface.vertex_m.rowwise().minCoeff(),
                        high = surface.vertex_m.rowwise().maxCoeff();
  const auto apart_m = [&](const Eigen::Vector3d& at) {
    return (low - at).cwiseMax(at - high).cwiseMax(0.0).norm();
  };
  double nearest_m = INFINITY;
  if (motion.set(0).camera) {
    if (!motion.flat_sheet()) return 0;
    const ClothDescription& cloth = motion.recording().cloth;
    const double swings_m = std::hypot(cloth.width_m, cloth.height_m);
    for (int m = 0; m < motion.markers(); ++m)
      nearest_m = std::min(
          nearest_m, apart_m(*motion.flat_sheet() *
                             Eigen::Vector3d(motion.marker_m()(0, m), motion.marker_m()(1, m), 0)));
    return std::max(0.0, nearest_m - swings_m);
  }
  constexpr int kFrames = 60;
  for (const int f : motion.sampled_frames(kFrames)) {
    const Eigen::MatrixXd place = motion.places(0, f);
    for (int m = 0; m < motion.markers(); ++m)
      if (place.col(m).allFinite())
        nearest_m = std::min(nearest_m, apart_m(Eigen::Vector3d(place.col(m))));
  }
  return nearest_m;
}

bool boxes_meet(const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                const Eigen::Vector3d& other_low, const Eigen::Vector3d& other_high) {
  return (low.array() <= other_high.array()).all() && (other_low.array() <= high.array()).all();
}

bool is_pierced(const SurfaceMesh& surface, const std::vector<std::pair<int, int>>& edges,
                const Mesh& mesh, const Eigen::Matrix3Xd& position_m) {
  const Eigen::Vector3d cloth_low = position_m.rowwise().minCoeff(),
                        cloth_high = position_m.rowwise().maxCoeff();
  for (const auto& [one, other] : edges) {
    const Eigen::Vector3d from = surface.vertex_m.col(one), to = surface.vertex_m.col(other);
    const Eigen::Vector3d low = from.cwiseMin(to), high = from.cwiseMax(to);
    if (!boxes_meet(low, high, cloth_low, cloth_high)) continue;
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

std::vector<double> depth_behind_m(const SurfaceMesh& surface, const Eigen::Matrix3Xd& point_m) {
  const Obstacle obstacle({surface.vertex_m, surface.triangle}, INFINITY);
  std::vector<double> depth_m;
  for (const auto& point : point_m.colwise()) {
    const auto nearest = obstacle.beneath(point);
    depth_m.push_back(nearest ? (nearest->place_m - point).norm() : 0);
  }
  return depth_m;
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
                        const Eigen::Matrix3Xd& start_m, double noise_m) {
  constexpr double kSigmas = 5;
  const double touches_m =
      std::max(kSigmas * noise_m, kPreflight.touches * std::sqrt(mesh.width_m * mesh.height_m));
  const Behind start = start_m.cols() > 0 ? behind(surface, start_m, touches_m) : Behind{};
  Findings findings;
  if (auto wrong = wrong_side(enclosed_volume_m3(surface), start, where))
    findings.push_back(std::move(*wrong));
  else if (auto narrow = too_narrow(surface, where, mesh))
    findings.push_back(std::move(*narrow));
  return findings;
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

bool is_carried(const RecordedMotion& motion) {
  const Recording& recording = motion.recording();
  const bool touches = std::ranges::any_of(recording.declared, [](const DeclaredEffect& effect) {
    return effect.name.starts_with("contact") && effect.name != "contact_mesh";
  });
  return touches || (recording.obstacle &&
                     nearest_to_obstacle_m(motion) < kPreflight.near_obstacle * motion.size_m());
}

void check_obstacle(const RecordedMotion& motion, CheckList& list) {
  const Recording& recording = motion.recording();
  if (!recording.obstacle) return;
  const ClothDescription& cloth = recording.cloth;
  const std::string file =
      recording.obstacle_file ? recording.obstacle_file->string() : list.file();
  const double noise_m = motion.units_per_m(0) > 0 ? motion.noise_m(0) : 0;
  for (Finding& finding :
       check_obstacle(*recording.obstacle, file,
                      {cloth.mesh_columns, cloth.mesh_rows, cloth.width_m, cloth.height_m},
                      recorded_start_m(motion), noise_m))
    list.add(std::move(finding));
  if (const double nearest_m = nearest_to_obstacle_m(motion);
      nearest_m > kPreflight.near_obstacle * motion.size_m())
    list.add("obstacle", FindingState::warning, file,
             fmt::format("no marker comes nearer to it than {:.3g} mm", 1e3 * nearest_m),
             "an obstacle that the cloth meets",
             "metres and the world's axes, as the tracks have?");
}

}  // namespace clothfit
