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

/// How the markers of a run of the model moved: 3 x markers in each of its frames (m, world);
/// velocities where they were asked for.
struct MarkerRun {
  std::vector<Eigen::Matrix3Xd> position_m, velocity_m_per_s;
  /// The same of the surface's derivatives there, x_s, x_t (1, 1/s), x_ss, x_st, x_tt (1/m,
  /// 1/(m s)); or none.
  std::vector<MarkerRun> derivatives;
};

/// From the motion of the vertices, or from a derivative of it.
MarkerRun marker_run(const FitProblem& problem, const std::vector<Eigen::Matrix3Xd>& position_m,
                     const std::vector<Eigen::Matrix3Xd>& velocity_m_per_s);

MarkerRun marker_run(const FitProblem& problem, const SimulateResult& run);

/// What the observations of a problem should be, for values of its parameters, given how the
/// markers of the model moved: seen when and where the effects of the measurement say
/// (fit/measurement_effects), by the observer of their set.
///
/// Between frames markers follow the cubic through the places and velocities at both (Hermite;
/// error O(interval^4)), after the last one they go straight on. Before the first one cloth is
/// where it starts, or, where it starts in motion, has come straight. Beside its markers the cloth
/// goes on as its derivatives there say, to second order.
class Predictor {
 public:
  /// `problem` must outlive it.
  Predictor(const FitProblem& problem, const Eigen::VectorXd& values);

  /// Constants by which markers are seen beside where they would be (fit/observe/marker_offsets.h),
  /// 3 x markers, world. Without derivatives: fits take them out of the cost instead.
  void offset_markers(Eigen::Matrix3Xd offset_m) { marker_offset_m_ = std::move(offset_m); }

  /// Whether it looks between frames and so asks for the markers' velocities.
  bool needs_velocities() const { return needs_velocities_; }

  /// How many frames a run must have for the observations before frame `frames`.
  int frames_to_run(int frames) const;

  /// Nothing behind a camera. A pixel's third number is 0.
  std::optional<Eigen::Vector3d> predict(int set, const Observation& row,
                                         const MarkerRun& run) const;

  /// The same with its derivatives by the space's coordinates, 3 x coordinates, from those of the
  /// markers' motion; one without frames stands for a motion that does not change. Velocities of
  /// `tangents` are looked at where those of `run` are.
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
  /// Which parameters of the fit are the measurement's, and d value / d coordinate of these.
  std::vector<int> fitted_;
  Eigen::VectorXd slope_;
};

}  // namespace clothfit
