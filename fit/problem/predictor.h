#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "fit/measurement_effects/measurement_effect.h"
#include "fit/problem/problem.h"
#include "model/integrate/simulate.h"

namespace clothfit {

/// The motion of the markers in a run of the model: 3 x markers in each of its frames (m, world).
/// Velocities are there where they were asked for.
struct MarkerRun {
  std::vector<Eigen::Matrix3Xd> position_m, velocity_m_per_s;
  /// The same for the surface's derivatives there, x_s, x_t (1, 1/s), x_ss, x_st, x_tt (1/m, 1/(m
  /// s)); or none.
  std::vector<MarkerRun> derivatives;
};

/// Returns the markers' motion from that of the vertices, or from a derivative of it.
MarkerRun marker_run(const FitProblem& problem, const std::vector<Eigen::Matrix3Xd>& position_m,
                     const std::vector<Eigen::Matrix3Xd>& velocity_m_per_s);

MarkerRun marker_run(const FitProblem& problem, const SimulateResult& run);

/// Predicts the observations of a problem, for values of its parameters, from the motion of the
/// model's markers. Time and place are those that the effects of the measurement state
/// (fit/measurement_effects). The view is that of the set's observer.
///
/// Between frames markers follow the cubic through the places and velocities at both (Hermite;
/// error O(interval^4)). After the last frame they go straight on. Before the first one the cloth
/// is at its start or, where it starts in motion, has come straight. Beside its markers the cloth
/// continues as its derivatives there say, to second order.
class Predictor {
 public:
  /// `problem` must outlive the predictor.
  Predictor(const FitProblem& problem, const Eigen::VectorXd& values);

  /// Sets constants by which markers are seen beside their place (fit/observe/marker_offsets.h), 3
  /// x markers, world. They have no derivatives: fits remove them from the cost instead.
  void offset_markers(Eigen::Matrix3Xd offset_m) { marker_offset_m_ = std::move(offset_m); }

  /// Says whether it looks between frames, for which it needs the markers' velocities.
  bool needs_velocities() const { return needs_velocities_; }

  /// Returns how many frames a run must have for the observations before frame `frames`.
  int frames_to_run(int frames) const;

  /// Returns nothing for a point behind a camera. A pixel's third number is 0.
  std::optional<Eigen::Vector3d> predict(int set, const Observation& row,
                                         const MarkerRun& run) const;

  /// Predicts with derivatives by the space's coordinates, 3 x coordinates, from those of the
  /// markers' motion. A derivative without frames stands for a motion that does not change.
  /// Velocities of `tangents` are looked at where those of `run` are.
  std::optional<Eigen::Vector3d> predict(int set, const Observation& row, const MarkerRun& run,
                                         std::span<const MarkerRun> tangents,
                                         Eigen::Ref<Eigen::Matrix3Xd> by_coordinate) const;

 private:
  struct Instant;
  struct Looks;
  struct Appearance;

  Sighting sighting(const ObservationSet& set, const Observation& row) const;
  MeasuredNumber seen_s(const Sighting& sighting) const;
  Instant instant(double time_s, size_t run_frames) const;
  MeasuredPoint look(const Sighting& sighting, const Observation& row, const MarkerRun& run,
                     Looks& looks) const;
  bool appears(const ObservationSet& set, const Observation& row, const MarkerRun& run,
               bool derivatives, Appearance& result) const;

  const FitProblem& problem_;
  bool needs_velocities_ = false;
  bool mixes_neighbours_ = false;
  Eigen::Vector3d sheet_middle_m_;
  Eigen::Vector2d pattern_middle_m_;
  double frame_interval_s_ = 0;                          ///< median
  Eigen::Matrix3Xd marker_offset_m_;                     ///< 3 x markers, or none
  std::vector<std::vector<MeasuredNumber>> parameters_;  ///< [effect][parameter]
  /// Indices of the measurement's fitted parameters, with d value / d coordinate of these.
  std::vector<int> fitted_;
  Eigen::VectorXd slope_;
};

}  // namespace clothfit
