#include "fit/problem/drive.h"

#include <fmt/format.h>

#include <memory>

#include "data/input_error.h"
#include "fit/observe/held_tracks.h"
#include "fit/observe/smoothing_spline.h"
#include "fit/problem/memory_limits.h"

namespace clothfit {
namespace {

std::function<Eigen::Vector3d(double)> follow(std::shared_ptr<const SmoothingSpline> spline) {
  return [spline](double time_s) { return Eigen::Vector3d(spline->position(time_s)); };
}

std::function<Eigen::Vector3d(double)> follow_path(const HeldPath& path) {
  Eigen::MatrixXd samples(3, static_cast<Eigen::Index>(path.position_m.size()));
  for (size_t n = 0; n < path.position_m.size(); ++n)
    samples.col(static_cast<Eigen::Index>(n)) = path.position_m[n];
  // A known path is not noisy: the spline goes through every sample.
  return follow(std::make_shared<const SmoothingSpline>(
      fit_smoothing_spline(path.time_s, samples, {}, {.smoothing = 1e-30, .robust = false})));
}

TrackedPoint smooth_track(const Recording& recording, int marker, const Tracks3d& tracks,
                          const std::vector<double>& frame_time_s) {
  TrackedPoint point{.held = 0, .marker = marker, .path = {}, .sigma = {}};
  std::vector<double> time_s;
  std::vector<Eigen::Vector3d> places;
  std::vector<double> sigma;
  bool all_stated = true;
  for (const Position3d& row : tracks) {
    if (row.marker != marker) continue;
    time_s.push_back(frame_time_s[static_cast<size_t>(row.frame)]);
    places.push_back(row.position_m);
    sigma.push_back(row.sigma_m);
    all_stated = all_stated && row.sigma_m > 0;
  }
  const std::string& name = recording.markers.markers[static_cast<size_t>(marker)].name;
  if (places.size() < 3)
    throw InputError((recording.folder / "recording.yaml").string(),
                     "held point with motion: tracked has only " + std::to_string(places.size()) +
                         " positions of its marker " + name,
                     "at least 3 frames that show it",
                     "use motion: fixed or path, or track the held point");
  Eigen::MatrixXd samples(3, static_cast<Eigen::Index>(places.size()));
  for (size_t n = 0; n < places.size(); ++n) samples.col(static_cast<Eigen::Index>(n)) = places[n];
  if (!all_stated) sigma.clear();
  point.path =
      std::make_shared<const SmoothingSpline>(fit_smoothing_spline(time_s, samples, sigma));
  for (size_t n = 0; n < sigma.size(); ++n)
    if (!point.path->outlier[n]) point.sigma.push_back(sigma[n]);
  return point;
}

bool is_along_s(const HeldPoint& edge) {
  return edge.edge == ClothEdge::top || edge.edge == ClothEdge::bottom;
}

/// Returns how many points of the cloth are held for one of the recording.
size_t held_count(const HeldPoint& point, const Mesh& mesh) {
  if (!point.edge) return 1;
  return static_cast<size_t>(is_along_s(point) ? mesh.columns : mesh.rows);
}

void hold_edge(const HeldPoint& edge, const Mesh& mesh, std::vector<HeldVertexWeights>& held) {
  const bool along_s = is_along_s(edge);
  const int count = static_cast<int>(held_count(edge, mesh));
  for (int n = 0; n < count; ++n) {
    int i = n, j = n;
    if (along_s)
      i = edge.edge == ClothEdge::top ? 0 : mesh.rows - 1;
    else
      j = edge.edge == ClothEdge::left ? 0 : mesh.columns - 1;
    held.push_back({.weights = {{mesh.vertex(i, j), 1.0}}, .motion = {}});
  }
}

}  // namespace

void hold(const HeldPoint& point, const HeldPath* path, const Mesh& mesh, const std::string& where,
          std::vector<HeldVertexWeights>& held) {
  const size_t count = held.size() + held_count(point, mesh);
  if (count > kMostHeldPoints)
    throw InputError(
        where, fmt::format("holds {} points or more", count),
        fmt::format("at most {}, an edge as one at each of its vertices", kMostHeldPoints),
        "fewer held points, or a coarser mesh under a held edge");
  if (point.edge) return hold_edge(point, mesh, held);
  held.push_back(held_at(mesh, point.at_m.x(), point.at_m.y()));
  if (path != nullptr) held.back().motion = follow_path(*path);
}

Drive make_drive(const Recording& recording, const Mesh& mesh, const Tracks3d& tracks,
                 const std::vector<double>& frame_time_s) {
  Drive drive;
  const std::string where = (recording.folder / "recording.yaml").string();
  drive.driving_markers = driving_markers(recording);
  for (const HeldPoint& point : recording.held) {
    if (point.motion == HeldMotion::path) {
      const HeldPath path = read_held_path(*point.file);
      hold(point, &path, mesh, where, drive.held);
      continue;
    }
    hold(point, nullptr, mesh, where, drive.held);
    if (point.motion == HeldMotion::tracked) {
      const int marker = drive.driving_markers[drive.tracked.size()];
      TrackedPoint tracked = smooth_track(recording, marker, tracks, frame_time_s);
      tracked.held = static_cast<int>(drive.held.size()) - 1;
      drive.held.back().motion = follow(tracked.path);
      drive.tracked.push_back(std::move(tracked));
    }
  }
  return drive;
}

}  // namespace clothfit
