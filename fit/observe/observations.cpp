#include "fit/observe/observations.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/camera/projection.h"
#include "data/input_error.h"
#include "fit/observe/noise.h"

namespace clothfit {
namespace {

/// Gives rows without a sigma the noise that the tracks themselves show. Cameras keep their rate;
/// trackers that answer when they are done do not. Where no run of frames is even enough, uneven
/// ones have to do.
void estimate_missing_sigma(ObservationSet& set, const ObservedFrames& frames, int marker_count) {
  if (std::ranges::all_of(set.rows, [](const Observation& row) { return row.sigma > 0; })) return;
  std::vector<Eigen::MatrixXd> tracks =
      marker_tracks(set, marker_count, static_cast<int>(frames.time_s.size()));
  for (Eigen::MatrixXd& track : tracks)
    track.rightCols(track.cols() - frames.first_held_out)
        .setConstant(std::numeric_limits<double>::quiet_NaN());
  constexpr int kFewest = 100;
  NoiseEstimate estimate;
  for (const double tolerance : {0.05, 0.2, 0.5}) {
    estimate = estimate_noise(frames.time_s, tracks, {.interval_tolerance = tolerance});
    if (estimate.differences >= kFewest) break;
  }
  if (!(estimate.sigma > 0)) {
    const bool exact = estimate.differences > 0;
    throw InputError(set.kind,
                     exact ? "the tracks state no sigma and do not scatter by themselves"
                           : "the tracks state no sigma and are too short to estimate it from",
                     exact ? "measured positions, or a sigma column"
                           : "at least four consecutive frames of one marker, or a sigma column");
  }
  for (Observation& row : set.rows)
    if (!(row.sigma > 0)) row.sigma = estimate.sigma;
}

void finish(ObservationSet& set) {
  std::ranges::sort(set.rows, [](const Observation& a, const Observation& b) {
    return std::pair(a.frame, a.marker) < std::pair(b.frame, b.marker);
  });
  double sum = 0;
  for (const Observation& row : set.rows) sum += row.sigma * row.sigma;
  set.noise = set.rows.empty() ? 0 : std::sqrt(sum / static_cast<double>(set.rows.size()));
}

}  // namespace

std::optional<Eigen::Vector3d> ObservationSet::predict(const Eigen::Vector3d& position_m,
                                                       Eigen::Matrix3d* by_position) const {
  if (!camera) {
    if (by_position != nullptr) by_position->setIdentity();
    return position_m;
  }
  const Rigid3 camera_from = camera_from_world(*camera);
  Eigen::Matrix<double, 2, 3> pixel_by_point;
  const auto pixel = project(*camera, camera_from * position_m, &pixel_by_point);
  if (!pixel) return std::nullopt;
  if (by_position != nullptr) {
    by_position->topRows<2>() = pixel_by_point * camera_from.rotation.toRotationMatrix();
    by_position->row(2).setZero();
  }
  return Eigen::Vector3d(pixel->x(), pixel->y(), 0.0);
}

ObservationSet observations_3d(const Tracks3d& tracks, const ObservedFrames& frames,
                               int marker_count, const std::vector<int>& excluded,
                               std::map<std::string, int>& rejected) {
  ObservationSet set{.kind = "tracks3d", .unit = "m", .dimension = 3, .camera = {}, .rows = {}};
  for (const Position3d& row : tracks) {
    if (std::ranges::find(excluded, row.marker) != excluded.end()) {
      ++rejected["drives_a_held_point"];
      continue;
    }
    set.rows.push_back({row.frame, row.marker, row.position_m, row.sigma_m});
  }
  estimate_missing_sigma(set, frames, marker_count);
  finish(set);
  return set;
}

ObservationSet observations_2d(const Tracks2d& tracks, const CameraParameters& camera,
                               const ObservedFrames& frames, int marker_count,
                               const std::vector<int>& excluded,
                               std::map<std::string, int>& rejected) {
  ObservationSet set{
      .kind = camera.name, .unit = "px", .dimension = 2, .camera = camera, .rows = {}};
  for (const Position2d& row : tracks) {
    if (!row.rejected.empty()) {
      ++rejected[row.rejected];
    } else if (std::ranges::find(excluded, row.marker) != excluded.end()) {
      ++rejected["drives_a_held_point"];
    } else {
      set.rows.push_back(
          {row.frame, row.marker, {row.position_px.x(), row.position_px.y(), 0.0}, row.sigma_px});
    }
  }
  estimate_missing_sigma(set, frames, marker_count);
  finish(set);
  return set;
}

Eigen::Matrix2Xd marker_places(const MarkerSet& markers) {
  Eigen::Matrix2Xd places(2, static_cast<Eigen::Index>(markers.markers.size()));
  for (size_t m = 0; m < markers.markers.size(); ++m)
    places.col(static_cast<Eigen::Index>(m)) << markers.markers[m].s_m, markers.markers[m].t_m;
  return places;
}

std::vector<Eigen::MatrixXd> marker_tracks(const ObservationSet& set, int marker_count,
                                           int frames) {
  std::vector<Eigen::MatrixXd> tracks(
      static_cast<size_t>(marker_count),
      Eigen::MatrixXd::Constant(set.dimension, frames, std::numeric_limits<double>::quiet_NaN()));
  for (const Observation& row : set.rows)
    tracks[static_cast<size_t>(row.marker)].col(row.frame) = row.observed.head(set.dimension);
  return tracks;
}

std::vector<Eigen::Matrix3Xd> marker_positions(
    const Surface::Weights& vertex_weights, const std::vector<Eigen::Matrix3Xd>& mesh_positions) {
  // All frames go into one product: vertices x 3 F, a frame's x, y, z in neighbouring columns.
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto frames = static_cast<Eigen::Index>(mesh_positions.size());
  RowMajor vertices(vertex_weights.cols(), 3 * frames);
  for (Eigen::Index f = 0; f < frames; ++f)
    vertices.middleCols(3 * f, 3) = mesh_positions[static_cast<size_t>(f)].transpose();
  const RowMajor markers = vertex_weights * vertices;
  std::vector<Eigen::Matrix3Xd> result(mesh_positions.size());
  for (Eigen::Index f = 0; f < frames; ++f)
    result[static_cast<size_t>(f)] = markers.middleCols(3 * f, 3).transpose();
  return result;
}

}  // namespace clothfit
