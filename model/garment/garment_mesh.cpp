#include "model/garment/garment_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "data/input_error.h"
#include "model/garment/pattern_outline.h"

namespace clothfit {
namespace {

int parts_of(double length_m, double spacing_m) {
  return std::max(1, static_cast<int>(std::ceil(length_m / spacing_m - 1e-6)));
}

/// A place on an edge, as a share of its length.
struct EdgePlace {
  int edge = 0;
  double share = 0;
};

/// A side of a seam as one line, in the direction of the seam.
class SideLine {
 public:
  SideLine(const Pattern& pattern, const SeamSide& side, bool against)
      : side_(side), panel_(pattern.panels[static_cast<size_t>(side.panel)]), against_(against) {
    for (const int edge : side.edges)
      begins_m_.push_back(begins_m_.back() + edge_length_m(panel_, edge));
  }
  double length_m() const { return begins_m_.back(); }

  /// Returns the shares of the length at which corners lie, both ends left out.
  std::vector<double> corner_shares() const {
    std::vector<double> shares;
    for (size_t k = 1; k + 1 < begins_m_.size(); ++k)
      shares.push_back(turned(begins_m_[k] / length_m()));
    std::ranges::sort(shares);
    return shares;
  }

  /// Returns the place at a share of the length. A corner belongs to the edge that begins there.
  EdgePlace at(double share) const {
    const double along_m = turned(share) * length_m(), near_m = 1e-9 * length_m();
    for (size_t k = 0; k < side_.edges.size(); ++k) {
      const double begin_m = begins_m_[k], end_m = begins_m_[k + 1];
      if (along_m < begin_m + near_m) return {side_.edges[k], 0};
      if (along_m < end_m - near_m)
        return {side_.edges[k], (along_m - begin_m) / (end_m - begin_m)};
    }
    return {(side_.edges.back() + 1) % panel_.edge_count(), 0};
  }

 private:
  double turned(double share) const { return against_ ? 1 - share : share; }

  SeamSide side_;
  const Panel& panel_;
  bool against_;
  std::vector<double> begins_m_{0};
};

/// Shares of both sides that meet.
using Meeting = std::array<double, 2>;

/// Returns where corners of both sides meet: those that are each other's nearest, nearer than half
/// a spacing, in rising order.
std::vector<Meeting> meeting_corners(const std::vector<double>& ones,
                                     const std::vector<double>& others, double nearest) {
  std::vector<Meeting> meetings{{0, 0}};
  const auto nearest_in = [](const std::vector<double>& shares, double share) {
    return *std::ranges::min_element(shares, {}, [&](double of) { return std::abs(of - share); });
  };
  for (const double s : ones) {
    if (others.empty()) break;
    const double t = nearest_in(others, s);
    const bool mutual = nearest_in(ones, t) == s && std::abs(s - t) < nearest;
    if (mutual && s > meetings.back()[0] && t > meetings.back()[1]) meetings.push_back({s, t});
  }
  meetings.push_back({1, 1});
  return meetings;
}

/// Returns the shares of both sides at which vertices meet. A corner that meets none of the other
/// side lies between its neighbours that do, at the same share of the way.
std::vector<Meeting> meeting_shares(const SideLine& one, const SideLine& other, double spacing_m) {
  const double longer_m = std::max(one.length_m(), other.length_m());
  const std::vector<double> ones = one.corner_shares(), others = other.corner_shares();
  const std::vector<Meeting> fixed = meeting_corners(ones, others, 0.5 * spacing_m / longer_m);
  std::vector<Meeting> corners;
  for (size_t k = 0; k + 1 < fixed.size(); ++k) {
    const auto [s, t] = fixed[k];
    const double by_s = fixed[k + 1][0] - s, by_t = fixed[k + 1][1] - t;
    std::vector<double> ways{0};  // shares of the way to the next corners that meet
    for (const double corner : ones)
      if (corner > s && corner < s + by_s) ways.push_back((corner - s) / by_s);
    for (const double corner : others)
      if (corner > t && corner < t + by_t) ways.push_back((corner - t) / by_t);
    std::ranges::sort(ways);
    for (size_t n = 0; n < ways.size(); ++n)
      if (n == 0 || ways[n] > ways[n - 1])
        corners.push_back({s + ways[n] * by_s, t + ways[n] * by_t});
  }
  corners.push_back({1, 1});
  std::vector<Meeting> shares;
  for (size_t k = 0; k + 1 < corners.size(); ++k) {
    const auto [s, t] = corners[k];
    const double by_s = corners[k + 1][0] - s, by_t = corners[k + 1][1] - t;
    const int parts = parts_of(std::max(by_s * one.length_m(), by_t * other.length_m()), spacing_m);
    for (int part = 0; part < parts; ++part) {
      const double way = static_cast<double>(part) / parts;
      shares.push_back({s + way * by_s, t + way * by_t});
    }
  }
  shares.push_back({1, 1});
  return shares;
}

/// The outlines' vertices and the pairs of them that seams join.
struct Outlines {
  /// Shares of every edge of every panel at which vertices lie: 0 the first, 1 left out.
  std::vector<std::vector<std::vector<double>>> shares;
  std::vector<std::vector<std::array<EdgePlace, 2>>> seams;
  std::vector<std::vector<double>> seam_length_m;
};

Outlines outlines_of(const Pattern& pattern, double spacing_m) {
  Outlines outlines;
  std::vector<std::vector<bool>> sewn;
  for (const Panel& panel : pattern.panels) {
    outlines.shares.emplace_back(panel.edges.size(), std::vector<double>{0});
    sewn.emplace_back(panel.edges.size(), false);
  }
  for (const Seam& seam : pattern.seams) {
    const SideLine one(pattern, seam.sides[0], false), other(pattern, seam.sides[1], true);
    const std::vector<Meeting> meetings = meeting_shares(one, other, spacing_m);
    outlines.seams.emplace_back();
    outlines.seam_length_m.emplace_back();
    for (size_t k = 0; k < meetings.size(); ++k) {
      outlines.seams.back().push_back({one.at(meetings[k][0]), other.at(meetings[k][1])});
      const Meeting &before = meetings[k > 0 ? k - 1 : 0],
                    &after = meetings[std::min(k + 1, meetings.size() - 1)];
      // Half of the way between the neighbours, of the mean of both sides.
      outlines.seam_length_m.back().push_back(0.25 * ((after[0] - before[0]) * one.length_m() +
                                                      (after[1] - before[1]) * other.length_m()));
    }
    for (size_t side = 0; side < 2; ++side) {
      const auto panel = static_cast<size_t>(seam.sides[side].panel);
      for (const int edge : seam.sides[side].edges) sewn[panel][static_cast<size_t>(edge)] = true;
      for (const auto& meeting : outlines.seams.back())
        if (const EdgePlace& place = meeting[side]; place.share > 0)
          outlines.shares[panel][static_cast<size_t>(place.edge)].push_back(place.share);
    }
  }
  for (size_t p = 0; p < pattern.panels.size(); ++p)
    for (size_t e = 0; e < pattern.panels[p].edges.size(); ++e) {
      std::vector<double>& shares = outlines.shares[p][e];
      if (!sewn[p][e]) {
        const int parts =
            parts_of(edge_length_m(pattern.panels[p], static_cast<int>(e)), spacing_m);
        for (int part = 1; part < parts; ++part)
          shares.push_back(static_cast<double>(part) / parts);
      }
      std::ranges::sort(shares);
    }
  return outlines;
}

/// Numbers groups of joined vertices.
void number_particles(GarmentMesh& mesh) {
  const auto count = static_cast<size_t>(mesh.cloth.vertex_count());
  std::vector<int> parent(count);
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[static_cast<size_t>(v)] != v) v = parent[static_cast<size_t>(v)];
    return v;
  };
  for (const auto& seam : mesh.seams)
    for (const auto& [a, b] : seam) {
      const auto [low, high] = std::minmax({root(a), root(b)});
      parent[static_cast<size_t>(high)] = low;
    }
  mesh.particle_of.assign(count, -1);
  for (size_t v = 0; v < count; ++v) {
    const auto of = static_cast<size_t>(root(static_cast<int>(v)));
    mesh.particle_of[v] = of == v ? mesh.particles++ : mesh.particle_of[of];
  }
}

/// Adds a panel's mesh to the right of those that are there.
void add_panel(const ClothMesh& part, ClothMesh& cloth, std::vector<double>& panel_left_m) {
  const int vertices = cloth.vertex_count();
  const double gap_m = 4 * part.spacing_m;
  const double left_m = (vertices == 0 ? 0 : cloth.material_m.row(0).maxCoeff() + gap_m) -
                        part.material_m.row(0).minCoeff();
  panel_left_m.push_back(left_m);
  Eigen::Matrix2Xd material(2, vertices + part.vertex_count());
  material << cloth.material_m, part.material_m;
  material.rightCols(part.vertex_count()).row(0).array() += left_m;
  cloth.material_m = std::move(material);
  Eigen::VectorXd area(vertices + part.vertex_count());
  area << cloth.area_m2, part.area_m2;
  cloth.area_m2 = std::move(area);
  for (ClothCell cell : part.cells) {
    for (int k = 0; k < cell.corners; ++k) cell.vertex[static_cast<size_t>(k)] += vertices;
    cloth.cells.push_back(cell);
  }
}

/// Returns the outline of a panel, turned so that its warp runs along t, and the number of the
/// first vertex of every edge in it.
Eigen::Matrix2Xd outline_of(const Panel& panel, const std::vector<std::vector<double>>& shares,
                            std::vector<int>& first_vertex) {
  const Eigen::Rotation2Dd turn(-panel.grain_rad);
  std::vector<Eigen::Vector2d> outline;
  for (int edge = 0; edge < panel.edge_count(); ++edge) {
    first_vertex.push_back(static_cast<int>(outline.size()));
    const Eigen::Matrix2Xd points_m =
        points_of_edge_m(panel, edge, shares[static_cast<size_t>(edge)]);
    for (const auto& point : points_m.colwise()) outline.emplace_back(turn * point);
  }
  Eigen::Matrix2Xd border_m(2, static_cast<Eigen::Index>(outline.size()));
  for (size_t k = 0; k < outline.size(); ++k)
    border_m.col(static_cast<Eigen::Index>(k)) = outline[k];
  return border_m;
}

ClothMesh mesh_panel(const Panel& panel, const Eigen::Matrix2Xd& border_m, double spacing_m) {
  ClothOutline outline;
  outline.border_m.push_back(border_m);
  double twice_m2 = 0;
  for (Eigen::Index k = 0; k < border_m.cols(); ++k) {
    const Eigen::Vector2d here = border_m.col(k), next = border_m.col((k + 1) % border_m.cols());
    twice_m2 += here.x() * next.y() - here.y() * next.x();
  }
  if (!(twice_m2 > 0))
    throw InputError("panels." + panel.name,
                     fmt::format("its outline has no area left at {:g} mm", 1e3 * spacing_m),
                     "a spacing that its curves bear", "a finer one");
  try {
    return mesh_cloth(outline, spacing_m);
  } catch (const InputError& error) {
    throw InputError("panels." + panel.name, error.problem(), error.expected(), error.remedy());
  }
}

}  // namespace

GarmentMesh mesh_garment(const Pattern& pattern, double spacing_m) {
  const Outlines outlines = outlines_of(pattern, spacing_m);
  GarmentMesh mesh;
  mesh.cloth.spacing_m = spacing_m;
  std::vector<std::vector<int>> first_vertex(pattern.panels.size());
  std::vector<Eigen::Vector3d> placed;
  for (size_t p = 0; p < pattern.panels.size(); ++p) {
    const Panel& panel = pattern.panels[p];
    const int first = mesh.cloth.vertex_count();
    // A mesh's first vertices are those of its outline.
    const ClothMesh part =
        mesh_panel(panel, outline_of(panel, outlines.shares[p], first_vertex[p]), spacing_m);
    for (int& vertex : first_vertex[p]) vertex += first;
    const Eigen::Rotation2Dd turn_back(panel.grain_rad);
    for (const auto& at : part.material_m.colwise()) {
      const Eigen::Vector2d flat = turn_back * Eigen::Vector2d(at);
      placed.emplace_back(panel.placement * Eigen::Vector3d(flat.x(), flat.y(), 0));
      mesh.panel_of.push_back(static_cast<int>(p));
      mesh.fabric_of.push_back(panel.fabric);
    }
    add_panel(part, mesh.cloth, mesh.panel_left_m);
  }
  mesh.placed_m.resize(3, mesh.cloth.vertex_count());
  for (size_t v = 0; v < placed.size(); ++v)
    mesh.placed_m.col(static_cast<Eigen::Index>(v)) = placed[v];

  for (size_t n = 0; n < outlines.seams.size(); ++n) {
    mesh.seams.emplace_back();
    for (const auto& meeting : outlines.seams[n]) {
      std::array<int, 2> vertices{};
      for (size_t side = 0; side < 2; ++side) {
        const auto panel = static_cast<size_t>(pattern.seams[n].sides[side].panel),
                   edge = static_cast<size_t>(meeting[side].edge);
        const std::vector<double>& shares = outlines.shares[panel][edge];
        vertices[side] =
            first_vertex[panel][edge] +
            static_cast<int>(std::ranges::find(shares, meeting[side].share) - shares.begin());
      }
      mesh.seams.back().push_back(vertices);
    }
  }
  mesh.seam_length_m = outlines.seam_length_m;
  number_particles(mesh);
  return mesh;
}

Correspondence correspond(const GarmentMesh& fine, const GarmentMesh& coarse) {
  const Eigen::Matrix3Xi triangles = coarse.cloth.triangles();
  const auto count = static_cast<Eigen::Index>(fine.panel_of.size());
  Correspondence all;
  all.corner.resize(3, count);
  all.weight.resize(3, count);
  for (size_t panel = 0; panel < fine.panel_left_m.size(); ++panel) {
    std::vector<int> points, of_panel;
    for (int v = 0; v < static_cast<int>(count); ++v)
      if (fine.panel_of[static_cast<size_t>(v)] == static_cast<int>(panel)) points.push_back(v);
    for (int t = 0; t < static_cast<int>(triangles.cols()); ++t)
      if (coarse.panel_of[static_cast<size_t>(triangles(0, t))] == static_cast<int>(panel))
        of_panel.push_back(t);
    Eigen::Matrix2Xd point_m = fine.cloth.material_m(Eigen::all, points);
    point_m.row(0).array() += coarse.panel_left_m[panel] - fine.panel_left_m[panel];
    const Eigen::Matrix3Xi triangle = triangles(Eigen::all, of_panel);
    const Correspondence part = correspond(point_m, coarse.cloth.material_m, triangle);
    for (size_t k = 0; k < points.size(); ++k) {
      all.corner.col(points[k]) = part.corner.col(static_cast<Eigen::Index>(k));
      all.weight.col(points[k]) = part.weight.col(static_cast<Eigen::Index>(k));
    }
  }
  return all;
}

}  // namespace clothfit
