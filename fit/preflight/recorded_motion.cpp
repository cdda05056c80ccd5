#include "fit/preflight/recorded_motion.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <boost/geometry/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "data/input_error.h"
#include "data/median.h"
#include "fit/observe/sheet_placement.h"

namespace clothfit {
namespace {

/// Markers that tell what the cloth does around one of them.
constexpr int kNeighbours = 12;
constexpr int kFewestToPlace = 4;

int last_frame(const FitInput& input, bool in_space) {
  int last = -1;
  if (in_space)
    for (const Position3d& row : input.tracks3d) last = std::max(last, row.frame);
  else
    for (const auto& [camera, tracks] : input.tracks2d)
      for (const Position2d& row : tracks) last = std::max(last, row.frame);
  return last;
}

std::vector<ObservationSet> sets_of(const FitInput& input, bool in_space,
                                    const ObservedFrames& frames) {
  const auto markers = static_cast<int>(input.recording.markers.markers.size());
  std::map<std::string, int> rejected;
  std::vector<ObservationSet> sets;
  if (in_space) {
    sets.push_back(observations_3d(input.tracks3d, frames, markers, {}, rejected));
  } else {
    for (const CameraParameters& camera : input.cameras)
      if (const auto tracks = input.tracks2d.find(camera.name); tracks != input.tracks2d.end())
        sets.push_back(observations_2d(tracks->second, camera, frames, markers, {}, rejected));
  }
  std::erase_if(sets, [](const ObservationSet& set) { return set.rows.empty(); });
  return sets;
}

/// Returns for each of the markers the `count` others that are nearest on the cloth, the nearest
/// first.
std::vector<std::vector<int>> neighbours_of(const Eigen::Matrix2Xd& marker_m,
                                            const std::vector<int>& markers, int count) {
  namespace geometry = boost::geometry;
  using Point = geometry::model::point<double, 2, geometry::cs::cartesian>;
  const auto point_of = [&](int m) { return Point(marker_m(0, m), marker_m(1, m)); };
  std::vector<std::pair<Point, int>> points;
  for (const int m : markers) points.emplace_back(point_of(m), m);
  const geometry::index::rtree<std::pair<Point, int>, geometry::index::linear<8>> tree(points);
  std::vector<std::vector<int>> neighbours(static_cast<size_t>(marker_m.cols()));
  for (const int m : markers) {
    std::vector<int> near;
    const auto nearest = geometry::index::nearest(point_of(m), static_cast<unsigned>(count) + 1);
    for (auto found = tree.qbegin(nearest); found != tree.qend(); ++found)
      if (found->second != m) near.push_back(found->second);
    neighbours[static_cast<size_t>(m)] =
        nearest_markers(marker_m, std::move(near), marker_m.col(m), count);
  }
  return neighbours;
}

std::vector<size_t> rows_by_frame(const ObservationSet& set, int frames) {
  std::vector<size_t> first(static_cast<size_t>(frames) + 1, set.rows.size());
  for (size_t row = set.rows.size(); row-- > 0;)
    first[static_cast<size_t>(set.rows[row].frame)] = row;
  for (size_t f = first.size() - 1; f-- > 0;) first[f] = std::min(first[f], first[f + 1]);
  return first;
}

}  // namespace

std::vector<int> nearest_markers(const Eigen::Matrix2Xd& marker_m, std::vector<int> markers,
                                 const Eigen::Vector2d& point_m, int count) {
  const Eigen::RowVectorXd distance2 = (marker_m.colwise() - point_m).colwise().squaredNorm();
  const auto nearer = [&](int a, int b) {
    return distance2[a] != distance2[b] ? distance2[a] < distance2[b] : a < b;
  };
  const auto end = markers.begin() + std::min<std::ptrdiff_t>(count, std::ssize(markers));
  std::partial_sort(markers.begin(), end, markers.end(), nearer);
  markers.erase(end, markers.end());
  return markers;
}

double distance_less_noise(const Eigen::VectorXd& step, double noise) {
  const double square = step.squaredNorm();
  const double by_noise = 2 * static_cast<double>(step.size()) * noise * noise;
  // Noise that was estimated from quick motion may be too large.
  constexpr double kLeast = 0.25;
  return std::sqrt(std::max(square - by_noise, kLeast * square));
}

double distance_to_held_m(const Recording& recording, const Eigen::Vector2d& point_m) {
  const auto distance_m = [&](const HeldPoint& point) {
    if (!point.edge) return (point.at_m - point_m).norm();
    switch (*point.edge) {
      case ClothEdge::top:
        return point_m.y();
      case ClothEdge::bottom:
        return recording.cloth.height_m - point_m.y();
      case ClothEdge::left:
        return point_m.x();
      case ClothEdge::right:
        return recording.cloth.width_m - point_m.x();
    }
    return 0.0;
  };
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const HeldPoint& point : recording.held) nearest_m = std::min(nearest_m, distance_m(point));
  return nearest_m;
}

std::optional<Eigen::VectorXd> place_among(const Eigen::Matrix2Xd& marker_m,
                                           const Eigen::MatrixXd& place,
                                           const std::vector<int>& near,
                                           const Eigen::Vector2d& point_m) {
  std::vector<int> used;
  for (const int m : near)
    if (place.col(m).allFinite()) used.push_back(m);
  // Twice the map is fitted again without those that lie far off it: one may be taken for another.
  constexpr int kRounds = 3;
  constexpr double kFarOff = 3;
  std::optional<Eigen::VectorXd> result;
  for (int round = 0; round < kRounds; ++round) {
    const auto count = static_cast<Eigen::Index>(used.size());
    if (count < kFewestToPlace) return result;
    Eigen::MatrixXd map_by(count, 3), seen(count, place.rows());
    for (Eigen::Index k = 0; k < count; ++k) {
      const int m = used[static_cast<size_t>(k)];
      map_by.row(k) << 1, (marker_m.col(m) - point_m).transpose();
      seen.row(k) = place.col(m).transpose();
    }
    const double scale_m = map_by.rightCols(2).rowwise().norm().maxCoeff();
    if (!(scale_m > 0)) return result;
    map_by.rightCols(2) /= scale_m;
    const Eigen::Matrix3d normal = map_by.transpose() * map_by;
    const Eigen::LDLT<Eigen::Matrix3d> factors(normal);
    if (!(factors.vectorD().minCoeff() > 1e-6 * static_cast<double>(count))) return result;
    const Eigen::MatrixXd map = factors.solve(map_by.transpose() * seen);
    result = map.row(0).transpose();
    const Eigen::VectorXd off = (seen - map_by * map).rowwise().norm();
    const double usual = median({off.data(), off.data() + count});
    std::vector<int> kept;
    for (Eigen::Index k = 0; k < count; ++k)
      if (off[k] <= kFarOff * usual) kept.push_back(used[static_cast<size_t>(k)]);
    if (kept.size() == used.size()) break;
    used = std::move(kept);
  }
  return result;
}

RecordedMotion::RecordedMotion(const FitInput& input, ObservationKind kind) : input_(input) {
  const bool in_space = kind == ObservationKind::automatic ? !input.tracks3d.empty()
                                                           : kind == ObservationKind::tracks3d;
  const int frames = last_frame(input, in_space) + 1;
  for (int f = 0; f < frames; ++f) time_s_.push_back(input.recording.frame_time_s(f));
  marker_m_ = marker_places(input.recording.markers);
  sets_ = sets_of(
      input, in_space,
      {.time_s = time_s_,
       .first_held_out = std::min(frames, input.recording.held_out_from_frame.value_or(frames))});
  if (sets_.empty())
    throw InputError((input.recording.folder / "recording.yaml").string(),
                     "there is nothing to fit", "tracks3d or tracks2d with at least one good row",
                     "look at the status column of the tracks");
  std::vector<char> seen(static_cast<size_t>(markers()));
  for (const ObservationSet& set : sets_)
    for (const Observation& row : set.rows) seen[static_cast<size_t>(row.marker)] = 1;
  for (int m = 0; m < markers(); ++m)
    if (seen[static_cast<size_t>(m)] != 0) tracked_.push_back(m);
  neighbours_ = neighbours_of(marker_m_, tracked_, kNeighbours);
  for (const ObservationSet& set : sets_) first_row_.push_back(rows_by_frame(set, frames));
  for (int s = 0; s < sets(); ++s) {
    first_frame_.push_back(find_first_frame(s));
    units_per_m_.push_back(measured_units_per_m(s));
  }
  flat_sheet_ = place_flat_sheet(sets_, marker_m_, 1);
}

int RecordedMotion::find_first_frame(int s) const {
  const std::vector<size_t>& row = first_row_[static_cast<size_t>(s)];
  for (int f = 0; f < frames(); ++f)
    if (row[static_cast<size_t>(f) + 1] - row[static_cast<size_t>(f)] >= kFewestToPlace) return f;
  return -1;
}

double RecordedMotion::measured_units_per_m(int s) const {
  if (first_frame(s) < 0) return 0;
  constexpr size_t kPairs = 4;
  const Eigen::MatrixXd place = places(s, first_frame(s));
  std::vector<double> ratios;
  for (const int m : tracked_)
    for (size_t k = 0; k < std::min(kPairs, neighbours(m).size()); ++k) {
      const int n = neighbours(m)[k];
      const double flat_m = (marker_m_.col(n) - marker_m_.col(m)).norm();
      const Eigen::VectorXd step = place.col(n) - place.col(m);
      if (step.allFinite() && flat_m > 0)
        ratios.push_back(distance_less_noise(step, set(s).noise) / flat_m);
    }
  return ratios.empty() ? 0 : median(std::move(ratios));
}

std::vector<int> RecordedMotion::nearest(const Eigen::Vector2d& point_m, int count) const {
  return nearest_markers(marker_m_, tracked_, point_m, count);
}

double RecordedMotion::size_m() const {
  return std::sqrt(recording().cloth.width_m * recording().cloth.height_m);
}

Eigen::MatrixXd RecordedMotion::places(int s, int frame) const {
  const ObservationSet& set = sets_[static_cast<size_t>(s)];
  const std::vector<size_t>& first = first_row_[static_cast<size_t>(s)];
  Eigen::MatrixXd place =
      Eigen::MatrixXd::Constant(set.dimension, markers(), std::numeric_limits<double>::quiet_NaN());
  for (size_t row = first[static_cast<size_t>(frame)]; row < first[static_cast<size_t>(frame) + 1];
       ++row)
    place.col(set.rows[row].marker) = set.rows[row].observed.head(set.dimension);
  return place;
}

std::vector<int> RecordedMotion::sampled_frames(int most) const {
  std::vector<int> result;
  const int count = std::min(most, frames());
  for (int k = 0; k < count; ++k)
    result.push_back(count == frames() ? k
                                       : static_cast<int>(static_cast<long>(k) * (frames() - 1) /
                                                          std::max(1, count - 1)));
  return result;
}

}  // namespace clothfit
