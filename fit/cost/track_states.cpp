#include "fit/cost/track_states.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "data/algebra/dense_factors.h"
#include "data/input_error.h"
#include "fit/observe/node_weights.h"
#include "fit/observe/smoothing_spline.h"

namespace clothfit {
namespace {

/// A point of the cloth whose motion is known in some frames.
struct FollowedPoint {
  Eigen::Vector2d place_m;
  std::vector<bool> known;                        ///< [frame]
  Eigen::Matrix3Xd position_m, velocity_m_per_s;  ///< 3 x frames, where known
};

/// Says where a track is known well: between the ends of the spline and across short gaps.
std::vector<bool> known_frames(const std::vector<int>& seen, int frames,
                               const TrackStatesOptions& options) {
  std::vector<bool> known(static_cast<size_t>(frames), false);
  const int first = seen.front() + options.end_frames, last = seen.back() - options.end_frames;
  for (size_t n = 0; n < seen.size(); ++n) {
    const bool joined = n > 0 && seen[n] - seen[n - 1] - 1 <= options.longest_gap_frames;
    for (int f = joined ? seen[n - 1] + 1 : seen[n]; f <= seen[n]; ++f)
      known[static_cast<size_t>(f)] = f >= first && f <= last;
  }
  return known;
}

/// Returns the driven points, as long as their cloth has them.
std::vector<FollowedPoint> driven_points(const FitProblem& problem, int frames) {
  constexpr double kDifference = 1e-4;  // s; a drive bends over frames
  const Eigen::Matrix2Xd vertex_m = flat_positions(problem.cloth.mesh).topRows<2>();
  std::vector<FollowedPoint> points;
  for (const HeldVertexWeights& held : problem.cloth.held) {
    if (!held.motion) continue;
    FollowedPoint point{.place_m = Eigen::Vector2d::Zero(),
                        .known = std::vector<bool>(static_cast<size_t>(frames), true),
                        .position_m = Eigen::Matrix3Xd(3, frames),
                        .velocity_m_per_s = Eigen::Matrix3Xd(3, frames)};
    for (const auto& [vertex, weight] : held.weights)
      point.place_m += weight * vertex_m.col(vertex);
    for (int f = 0; f < frames; ++f) {
      const double t = problem.frame_time_s[static_cast<size_t>(f)];
      point.position_m.col(f) = held.motion(t);
      point.velocity_m_per_s.col(f) =
          (held.motion(t + kDifference) - held.motion(t - kDifference)) / (2 * kDifference);
    }
    points.push_back(std::move(point));
  }
  return points;
}

/// Fits a smoothing spline, robustly where samples are outliers. A track without noise has no scale
/// by which to tell an outlier, and motion itself stands out. Samples that a smooth path through
/// all of them follows as closely as the rest are no outliers.
SmoothingSpline smooth_path(const std::vector<double>& time_s, const Eigen::MatrixXd& samples) {
  constexpr double kAsClosely = 9;  // times the noise: sharp turns, sampled 60 times a second
  SmoothingSpline path = fit_smoothing_spline(time_s, samples);
  if (std::ranges::none_of(path.outlier, std::identity())) return path;
  SmoothingSpline through_all = fit_smoothing_spline(time_s, samples, {}, {.robust = false});
  for (size_t k = 0; k < time_s.size(); ++k) {
    const Eigen::VectorXd off =
        samples.col(static_cast<Eigen::Index>(k)) - through_all.position(time_s[k]);
    if (path.outlier[k] && off.cwiseAbs().maxCoeff() > kAsClosely * path.noise_sigma) return path;
  }
  return through_all;
}

/// Returns the smoothed markers. Adds the squares of the splines' sigma to `squared_sigma`.
std::vector<FollowedPoint> smoothed_markers(const FitProblem& problem, int frames,
                                            const TrackStatesOptions& options,
                                            std::vector<double>& squared_sigma) {
  constexpr size_t kFewest = 8;  // samples among which a spline can find outliers
  const auto marker_count = static_cast<int>(problem.marker_place_m.cols());
  const std::vector<Eigen::MatrixXd> tracks =
      marker_tracks(problem.observations.front(), marker_count, problem.frames());
  std::vector<FollowedPoint> points;
  for (int m = 0; m < marker_count; ++m) {
    const Eigen::MatrixXd& track = tracks[static_cast<size_t>(m)];
    std::vector<int> seen;
    std::vector<double> time_s;
    for (int f = 0; f < frames; ++f) {
      if (!track.col(f).allFinite()) continue;
      seen.push_back(f);
      time_s.push_back(problem.frame_time_s[static_cast<size_t>(f)]);
    }
    if (seen.size() < kFewest) continue;
    const SmoothingSpline path = smooth_path(time_s, track(Eigen::all, seen));
    for (const double sigma : path.value_sigma)
      if (std::isfinite(sigma)) squared_sigma.push_back(sigma * sigma);
    FollowedPoint point{.place_m = problem.marker_place_m.col(m),
                        .known = known_frames(seen, frames, options),
                        .position_m = Eigen::Matrix3Xd::Zero(3, frames),
                        .velocity_m_per_s = Eigen::Matrix3Xd::Zero(3, frames)};
    for (int f = 0; f < frames; ++f) {
      if (!point.known[static_cast<size_t>(f)]) continue;
      const double t = problem.frame_time_s[static_cast<size_t>(f)];
      point.position_m.col(f) = path.position(t);
      point.velocity_m_per_s.col(f) = path.velocity(t);
    }
    points.push_back(std::move(point));
  }
  return points;
}

/// Returns second differences of nodes x nodes values along both ways of the cloth.
Eigen::MatrixXd bends(int nodes) {
  std::vector<Eigen::RowVectorXd> rows;
  const auto add = [&](int at, int stride) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(nodes * nodes);
    row[at - stride] = row[at + stride] = 1;
    row[at] = -2;
    rows.push_back(std::move(row));
  };
  for (int i = 0; i < nodes; ++i)
    for (int j = 0; j < nodes; ++j) {
      if (i > 0 && i + 1 < nodes) add(i * nodes + j, nodes);
      if (j > 0 && j + 1 < nodes) add(i * nodes + j, 1);
    }
  Eigen::MatrixXd result(static_cast<Eigen::Index>(rows.size()), nodes * nodes);
  for (size_t n = 0; n < rows.size(); ++n) result.row(static_cast<Eigen::Index>(n)) = rows[n];
  return result;
}

/// Maps values at points to the smooth field's values at the vertices: vertices x points.
Eigen::MatrixXd field_through(const Mesh& mesh, const Eigen::Matrix2Xd& place_m, int nodes) {
  // A thousandth of the noise, so little that it matters only where no marker is.
  constexpr double kStiffness = 1e-6;
  const Eigen::MatrixXd at_points = node_weights(mesh, nodes, place_m);
  const Eigen::MatrixXd bending = bends(nodes);
  const double mean = at_points.squaredNorm() / static_cast<double>(at_points.cols());
  const Eigen::MatrixXd normal =
      at_points.transpose() * at_points + kStiffness * mean * bending.transpose() * bending;
  return node_weights(mesh, nodes, flat_positions(mesh).topRows<2>()) *
         SymmetricFactors(normal).solve(at_points.transpose());
}

}  // namespace

std::optional<TrackStates> find_states_of_tracks(const FitProblem& problem,
                                                 const TrackStatesOptions& options) {
  constexpr int kMostNodes = 17;  // a side: as the densest meshes of recordings have
  constexpr int kFewestAlongASide = 3;
  if (problem.observations.empty() || problem.observations.front().camera) return std::nullopt;
  const int frames = problem.first_held_out;
  TrackStates result;
  std::vector<double> squared_sigma;
  std::vector<FollowedPoint> points = smoothed_markers(problem, frames, options, squared_sigma);
  for (FollowedPoint& point : driven_points(problem, frames)) points.push_back(std::move(point));
  double sum = 0;
  for (const double square : squared_sigma) sum += square;
  if (sum > 0) result.position_sigma_m = std::sqrt(sum / static_cast<double>(squared_sigma.size()));

  std::vector<bool> before;
  Eigen::MatrixXd weights;
  const int all_per_side = static_cast<int>(std::sqrt(static_cast<double>(points.size()) + 0.5));
  const int nodes = std::min(all_per_side, kMostNodes);
  for (int f = 0; f < frames && nodes >= kFewestAlongASide; ++f) {
    std::vector<bool> known;
    for (const FollowedPoint& point : points) known.push_back(point.known[static_cast<size_t>(f)]);
    const auto count = std::ranges::count(known, true);
    if (static_cast<double>(count) < options.least_share * static_cast<double>(points.size()) ||
        count < kFewestAlongASide * kFewestAlongASide) {
      ++result.left_out;
      continue;
    }
    Eigen::Matrix2Xd place_m(2, count);
    Eigen::Matrix3Xd position_m(3, count), velocity_m_per_s(3, count);
    Eigen::Index column = 0;
    for (size_t n = 0; n < points.size(); ++n) {
      if (!known[n]) continue;
      place_m.col(column) = points[n].place_m;
      position_m.col(column) = points[n].position_m.col(f);
      velocity_m_per_s.col(column++) = points[n].velocity_m_per_s.col(f);
    }
    if (known != before) weights = field_through(problem.cloth.mesh, place_m, nodes);
    before = known;
    result.frame.push_back(f);
    result.states.time_s.push_back(problem.frame_time_s[static_cast<size_t>(f)]);
    result.states.position_m.push_back(position_m * weights.transpose());
    result.states.velocity_m_per_s.push_back(velocity_m_per_s * weights.transpose());
  }
  if (result.frame.size() < 2) return std::nullopt;
  return result;
}

TrackStates recorded_states_of_tracks(const FitProblem& problem,
                                      const TrackStatesOptions& options) {
  if (problem.observations.empty() || problem.observations.front().camera)
    throw InputError("states", "the recording is observed in pixels",
                     "3D tracks: states are positions and velocities in space");
  std::optional<TrackStates> found = find_states_of_tracks(problem, options);
  if (!found)
    throw InputError("states", "fewer than two fitted frames have a state",
                     "at least 3 x 3 markers that are tracked over 8 frames or more",
                     "fit the trajectory: it needs no states");
  return *std::move(found);
}

std::unique_ptr<StateObjective> state_objective_of_tracks(const FitProblem& problem,
                                                          const TrackStates& tracks, bool full,
                                                          const TimeSteps& steps) {
  constexpr double kFewestSteps = 10;
  constexpr double kLeastSigmaM = 1e-6;  // for tracks without noise
  double interval_s = problem.frame_time_s.back() - problem.frame_time_s.front();
  for (size_t f = 1; f < problem.frame_time_s.size(); ++f)
    interval_s = std::min(interval_s, problem.frame_time_s[f] - problem.frame_time_s[f - 1]);
  return std::make_unique<StateObjective>(
      problem, tracks.states,
      full ? full_cost_transitions(tracks.states) : small_cost_transitions(tracks.states),
      std::min(steps.run_s, interval_s / kFewestSteps),
      std::max(tracks.position_sigma_m, kLeastSigmaM));
}

}  // namespace clothfit
