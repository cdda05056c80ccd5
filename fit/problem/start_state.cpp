#include "fit/problem/start_state.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "data/algebra/dense_factors.h"
#include "fit/observe/node_weights.h"
#include "fit/observe/shape_from_pixels.h"
#include "fit/observe/smoothing_spline.h"

namespace clothfit {
namespace {

Eigen::Matrix2Xd vertex_places(const Mesh& mesh) {
  return flat_positions(mesh).topRows<2>();
}

/// The markers' places and velocities at the first frame, from smoothed tracks.
struct MarkerStates {
  Eigen::Matrix2Xd place_m;  ///< (s, t) of the markers that have a state
  Eigen::Matrix3Xd position_m, velocity_m_per_s;
};

MarkerStates smoothed_states(const ObservationSet& set, const Eigen::Matrix2Xd& marker_m,
                             const std::vector<double>& frame_time_s, int first_held_out) {
  constexpr size_t kFewest = 5;   // samples that are worth fitting a spline to
  constexpr int kLateFrames = 3;  // a marker that is first seen later is extrapolated too far
  const std::vector<Eigen::MatrixXd> tracks =
      marker_tracks(set, static_cast<int>(marker_m.cols()), static_cast<int>(frame_time_s.size()));
  std::vector<Eigen::Vector2d> places;
  std::vector<Eigen::Vector3d> positions, velocities;
  for (Eigen::Index m = 0; m < marker_m.cols(); ++m) {
    const Eigen::MatrixXd& track = tracks[static_cast<size_t>(m)];
    std::vector<double> time_s;
    std::vector<Eigen::Vector3d> samples;
    for (int f = 0; f < first_held_out; ++f) {
      if (!track.col(f).allFinite()) continue;
      if (samples.empty() && f > kLateFrames) break;
      time_s.push_back(frame_time_s[static_cast<size_t>(f)]);
      samples.push_back(track.col(f));
    }
    if (samples.size() < kFewest) continue;
    const SmoothingSpline path = fit_smoothing_spline(
        time_s, Eigen::Map<Eigen::Matrix3Xd>(samples.front().data(), 3,
                                             static_cast<Eigen::Index>(samples.size())));
    places.push_back(marker_m.col(m));
    positions.push_back(path.position(frame_time_s.front()));
    velocities.push_back(path.velocity(frame_time_s.front()));
  }
  MarkerStates states;
  const auto count = static_cast<Eigen::Index>(places.size());
  states.place_m.resize(2, count);
  states.position_m.resize(3, count);
  states.velocity_m_per_s.resize(3, count);
  for (Eigen::Index n = 0; n < count; ++n) {
    states.place_m.col(n) = places[static_cast<size_t>(n)];
    states.position_m.col(n) = positions[static_cast<size_t>(n)];
    states.velocity_m_per_s.col(n) = velocities[static_cast<size_t>(n)];
  }
  return states;
}

/// Returns the values at nodes of the smooth field that comes closest to values at the markers.
Eigen::Matrix3Xd smooth_field(const Mesh& mesh, const Eigen::Matrix2Xd& places,
                              const Eigen::Matrix3Xd& values, int nodes) {
  const Eigen::MatrixXd at_markers = node_weights(mesh, nodes, places);
  // This is the least ridge that keeps nodes without a marker near from running away.
  const double ridge = 1e-6 * at_markers.squaredNorm() / static_cast<double>(at_markers.cols());
  const Eigen::Vector3d mean = values.rowwise().mean();
  Eigen::MatrixXd normal = at_markers.transpose() * at_markers;
  normal.diagonal().array() += ridge;
  const Eigen::MatrixXd node_values = SymmetricFactors(normal).solve(
      at_markers.transpose() * (values.colwise() - mean).transpose());
  return node_values.transpose().colwise() + mean;
}

struct Guess {
  int nodes = 0;                                  ///< a side
  Eigen::Matrix3Xd position_m, velocity_m_per_s;  ///< there, 3 x nodes^2
};

std::optional<Guess> guess_from_tracks(const ObservationSet& set, const Eigen::Matrix2Xd& marker_m,
                                       const std::vector<double>& frame_time_s, int first_held_out,
                                       const Mesh& mesh) {
  const MarkerStates states = smoothed_states(set, marker_m, frame_time_s, first_held_out);
  const int per_side = static_cast<int>(std::sqrt(static_cast<double>(states.place_m.cols())));
  if (per_side < 3) return std::nullopt;
  const int nodes = std::clamp(per_side - 1, 2, 9);
  return Guess{nodes, smooth_field(mesh, states.place_m, states.position_m, nodes),
               smooth_field(mesh, states.place_m, states.velocity_m_per_s, nodes)};
}

/// Guesses from shapes of the first frames, with a parabola in time through each vertex's places.
std::optional<Guess> guess_from_pixels(const std::vector<ObservationSet>& sets,
                                       const Eigen::Matrix2Xd& marker_m,
                                       const std::vector<double>& frame_time_s, int first_held_out,
                                       const Mesh& mesh, const Rigid3& world_from_sheet) {
  constexpr int kNodes = 6;
  constexpr int kFrames = 7;
  if (first_held_out < kFrames) return std::nullopt;
  const auto shapes = shapes_from_pixels(sets, marker_m, mesh.width_m, mesh.height_m,
                                         world_from_sheet, kNodes, kFrames);
  constexpr double kFits = 3;  // pixels, about
  if (!shapes || shapes->rms_residual > kFits) return std::nullopt;
  Eigen::Matrix<double, kFrames, 3> powers;
  for (int f = 0; f < kFrames; ++f) {
    const double t = frame_time_s[static_cast<size_t>(f)] - frame_time_s.front();
    powers.row(f) << 1, t, t * t;
  }
  const Eigen::Matrix<double, 3, kFrames> fitted =
      (powers.transpose() * powers).inverse() * powers.transpose();
  Eigen::Matrix3Xd position_m = Eigen::Matrix3Xd::Zero(3, kNodes * kNodes);
  Eigen::Matrix3Xd velocity_m_per_s = position_m;
  for (int f = 0; f < kFrames; ++f) {
    position_m += fitted(0, f) * shapes->node_m[static_cast<size_t>(f)];
    velocity_m_per_s += fitted(1, f) * shapes->node_m[static_cast<size_t>(f)];
  }
  return Guess{kNodes, std::move(position_m), std::move(velocity_m_per_s)};
}

/// Returns how far the guessed shape is from the nearest one through fewer nodes: rms over the
/// cloth, m.
double detail_beyond(int nodes, const Guess& guess, const Mesh& mesh) {
  constexpr int kPoints = 13;  // a side; finer than any guess
  const Eigen::Matrix2Xd points = vertex_places({kPoints, kPoints, mesh.width_m, mesh.height_m});
  const Eigen::MatrixXd place_m =
      node_weights(mesh, guess.nodes, points) * guess.position_m.transpose();
  const Eigen::MatrixXd fields = node_weights(mesh, nodes, points);
  const Eigen::MatrixXd nearest =
      fields * SymmetricFactors(Eigen::MatrixXd(fields.transpose() * fields))
                   .solve(fields.transpose() * place_m);
  return std::sqrt((place_m - nearest).squaredNorm() / static_cast<double>(points.cols()));
}

/// Returns as few nodes for the corrections as follow a shape like the guessed one. What it shows
/// beyond them it may also be wrong by. A tenth of a second after its release a cloth shows 0.7 to
/// 1.1 mm, and few do; after a quarter it shows 1.2 mm in pixels and 1.8 mm in space, and they do
/// not.
int nodes_for(const std::optional<Guess>& guess, bool in_space, const Mesh& mesh) {
  const double most_m = in_space ? 1.4e-3 : 1e-3;
  const bool is_smooth = guess && guess->nodes > StartStateOptions::kFewNodes &&
                         detail_beyond(StartStateOptions::kFewNodes, *guess, mesh) < most_m;
  return is_smooth ? StartStateOptions::kFewNodes : StartStateOptions::kManyNodes;
}

void add_corrections(const char* name, const char* unit, double sigma, int nodes,
                     ParameterSpace& space, std::vector<Binding>& bindings,
                     std::vector<GaussianPrior>& priors) {
  constexpr double kWidest = 20;  // standard deviations: the prior holds it, not the range
  GaussianPrior prior;
  for (int k = 0; k < nodes * nodes; ++k) {
    for (const char axis : {'x', 'y', 'z'}) {
      prior.indices.push_back(space.size());
      bindings.push_back({.parameter = space.size()});
      space.parameters.push_back({.name = std::string(name) + "_" + std::to_string(k) + "_" + axis,
                                  .unit = unit,
                                  .role = ParameterRole::start,
                                  .scale = ParameterScale::linear,
                                  .lower = -kWidest * sigma,
                                  .upper = kWidest * sigma,
                                  .start = 0,
                                  .typical = sigma});
    }
  }
  const auto count = static_cast<Eigen::Index>(prior.indices.size());
  prior.mean = Eigen::VectorXd::Zero(count);
  prior.sqrt_information = Eigen::MatrixXd::Identity(count, count) / sigma;
  priors.push_back(std::move(prior));
}

}  // namespace

StartState make_start_state(const std::vector<ObservationSet>& sets,
                            const Eigen::Matrix2Xd& marker_m,
                            const std::vector<double>& frame_time_s, int first_held_out,
                            const Mesh& mesh, const Rigid3& world_from_sheet,
                            const StartStateOptions& options, ParameterSpace& space,
                            std::vector<GaussianPrior>& priors) {
  const bool in_space = !sets.empty() && !sets.front().camera;
  const std::optional<Guess> guess =
      in_space
          ? guess_from_tracks(sets.front(), marker_m, frame_time_s, first_held_out, mesh)
          : guess_from_pixels(sets, marker_m, frame_time_s, first_held_out, mesh, world_from_sheet);
  double position_sigma_m = options.position_sigma_m;
  double velocity_sigma_m_per_s = options.velocity_sigma_m_per_s;
  StartState start;
  if (guess) {
    const Eigen::MatrixXd at_vertices = node_weights(mesh, guess->nodes, vertex_places(mesh));
    start.position_m = guess->position_m * at_vertices.transpose();
    start.velocity_m_per_s = guess->velocity_m_per_s * at_vertices.transpose();
  } else {
    // Sigmas are as far from flat, and as fast, as a cloth of this size gets.
    const double size_m = std::max(mesh.width_m, mesh.height_m);
    position_sigma_m = std::max(position_sigma_m, 0.2 * size_m);
    velocity_sigma_m_per_s = std::max(velocity_sigma_m_per_s, 2 * std::sqrt(9.81 * size_m));
    start.position_m = flat_positions(mesh);
    start.velocity_m_per_s = Eigen::Matrix3Xd::Zero(3, mesh.vertex_count());
    for (Eigen::Index v = 0; v < start.position_m.cols(); ++v)
      start.position_m.col(v) = world_from_sheet * Eigen::Vector3d(start.position_m.col(v));
  }
  const int nodes = options.nodes > 0 ? options.nodes : nodes_for(guess, in_space, mesh);
  start.basis = node_weights(mesh, nodes, vertex_places(mesh));
  add_corrections("start_position", "m", position_sigma_m, nodes, space, start.position, priors);
  add_corrections("start_velocity", "m/s", velocity_sigma_m_per_s, nodes, space, start.velocity,
                  priors);
  return start;
}

}  // namespace clothfit
