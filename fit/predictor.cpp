#include "fit/predictor.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace clothfit {

/// A time as weights on the frames of a run:
/// x(t) = sum over k of  position[k] x(frame + k) + velocity[k] v(frame + k).
struct Predictor::Instant {
  struct Weights {
    std::array<double, 2> position{}, velocity{};
  };
  size_t frame = 0;
  Weights place, rate;  ///< of x and of dx/dt

  Eigen::Vector3d of(const Weights& weights, const MarkerRun& run, int marker) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t k = 0; k < 2; ++k) {
      if (weights.position[k] != 0)
        sum += weights.position[k] * run.position_m[frame + k].col(marker);
      if (weights.velocity[k] != 0)
        sum += weights.velocity[k] * run.velocity_m_per_s[frame + k].col(marker);
    }
    return sum;
  }
};

/// Where a marker appears to be, with derivatives by where it is and by the parameters.
struct Predictor::Appearance {
  Instant instant;
  Eigen::Vector3d position_m;
  Eigen::Matrix3d by_place = Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, 3, kMeasurementParameters> by_parameter;
};

MarkerRun marker_run(const FitProblem& problem, const SimulateResult& run) {
  return {.position_m = marker_positions(problem.vertex_weights, run.position_m),
          .velocity_m_per_s = marker_positions(problem.vertex_weights, run.velocity_m_per_s)};
}

Predictor::Predictor(const FitProblem& problem, const Eigen::VectorXd& values)
    : problem_(problem), sheet_middle_m_(problem.placed_sheet_m.rowwise().mean()) {
  for (const FitProblem::MeasurementTerm& term : problem.measurement) {
    needs_velocities_ = needs_velocities_ || term.effect->shifts_time();
    parameters_.emplace_back();
    for (const Binding& binding : term.parameters) {
      MeasuredNumber& number = parameters_.back().emplace_back(binding.value(values));
      if (binding.parameter < 0) continue;
      number.v[kMeasuredPlace + static_cast<Eigen::Index>(fitted_.size())] = 1;
      fitted_.push_back(binding.parameter);
    }
  }
  assert(fitted_.size() <= kMeasurementParameters);
  slope_ = problem.space.value_by_coordinate(values)(fitted_);
}

Sighting Predictor::sighting(const Observation& row) const {
  return {.time_s = problem_.frame_time_s[static_cast<size_t>(row.frame)],
          .sheet_middle_m = sheet_middle_m_};
}

MeasuredNumber Predictor::seen_s(const Sighting& sighting) const {
  MeasuredNumber time_s(sighting.time_s);
  for (size_t e = 0; e < parameters_.size(); ++e)
    problem_.measurement[e].effect->shift_time(sighting, parameters_[e], time_s);
  return time_s;
}

int Predictor::frames_to_run(int frames) const {
  if (!needs_velocities_) return frames;
  const std::vector<double>& frame_time_s = problem_.frame_time_s;
  double last_s = frame_time_s[static_cast<size_t>(frames - 1)];
  for (const ObservationSet& set : problem_.observations) {
    for (const Observation& row : set.rows) {
      if (row.frame >= frames) break;  // rows are sorted by frame
      last_s = std::max(last_s, seen_s(sighting(row)).a);
    }
  }
  const auto enough = std::ranges::lower_bound(frame_time_s, last_s) - frame_time_s.begin() + 1;
  return static_cast<int>(std::min<std::ptrdiff_t>(enough, problem_.frames()));
}

Predictor::Instant Predictor::instant(double time_s, size_t run_frames) const {
  const std::vector<double>& frame_time_s = problem_.frame_time_s;
  const auto end = frame_time_s.begin() + static_cast<std::ptrdiff_t>(run_frames);
  const auto next = std::upper_bound(frame_time_s.begin(), end, time_s);
  Instant at;
  if (next == frame_time_s.begin() || next == end) {
    const bool before = next == frame_time_s.begin();
    at.frame = before ? 0 : run_frames - 1;
    at.place.position[0] = 1;
    if (before && problem_.start != StartKind::unknown) return at;
    at.place.velocity[0] = time_s - frame_time_s[at.frame];
    at.rate.velocity[0] = 1;
    return at;
  }
  at.frame = static_cast<size_t>(next - frame_time_s.begin()) - 1;
  const double h = *next - frame_time_s[at.frame];
  const double u = (time_s - frame_time_s[at.frame]) / h;
  at.place.position = {1 + u * u * (2 * u - 3), u * u * (3 - 2 * u)};
  at.place.velocity = {h * u * (1 - u) * (1 - u), -h * u * u * (1 - u)};
  at.rate.position = {-6 * u * (1 - u) / h, 6 * u * (1 - u) / h};
  at.rate.velocity = {(1 - u) * (1 - 3 * u), u * (3 * u - 2)};
  return at;
}

Predictor::Appearance Predictor::appearance(const Observation& row, const MarkerRun& run) const {
  Appearance result;
  result.instant.frame = static_cast<size_t>(row.frame);
  result.instant.place.position[0] = 1;
  if (parameters_.empty()) {
    result.position_m = run.position_m[result.instant.frame].col(row.marker);
  } else {
    const Sighting seen = sighting(row);
    const MeasuredNumber time_s = seen_s(seen);
    if (needs_velocities_) result.instant = instant(time_s.a, run.position_m.size());
    const Eigen::Vector3d place_m = result.instant.of(result.instant.place, run, row.marker);
    const Eigen::Vector3d rate = result.instant.of(result.instant.rate, run, row.marker);
    MeasuredPoint point;
    for (int c = 0; c < 3; ++c) {
      point[c] = MeasuredNumber(place_m[c], c);
      point[c].v += rate[c] * time_s.v;
    }
    for (size_t e = 0; e < parameters_.size(); ++e)
      problem_.measurement[e].effect->move(seen, parameters_[e], point);
    for (int c = 0; c < 3; ++c) {
      result.position_m[c] = point[c].a;
      result.by_place.row(c) = point[c].v.head<kMeasuredPlace>();
      result.by_parameter.row(c) = point[c].v.tail<kMeasurementParameters>();
    }
  }
  if (marker_offset_m_.cols() > 0) result.position_m += marker_offset_m_.col(row.marker);
  return result;
}

std::optional<Eigen::Vector3d> Predictor::predict(int set, const Observation& row,
                                                  const MarkerRun& run) const {
  const ObservationSet& observer = problem_.observations[static_cast<size_t>(set)];
  return observer.predict(appearance(row, run).position_m);
}

std::optional<Eigen::Vector3d> Predictor::predict(
    int set, const Observation& row, const MarkerRun& run, std::span<const MarkerRun> tangents,
    Eigen::Ref<Eigen::Matrix3Xd> by_coordinate) const {
  assert(static_cast<Eigen::Index>(tangents.size()) == by_coordinate.cols());
  const ObservationSet& observer = problem_.observations[static_cast<size_t>(set)];
  const Appearance seen = appearance(row, run);
  Eigen::Matrix3d by_position;
  const auto predicted = observer.predict(seen.position_m, &by_position);
  if (!predicted) return std::nullopt;
  const Eigen::Matrix3d by_place = by_position * seen.by_place;
  for (size_t p = 0; p < tangents.size(); ++p) {
    auto column = by_coordinate.col(static_cast<Eigen::Index>(p));
    if (tangents[p].position_m.empty())
      column.setZero();
    else
      column = by_place * seen.instant.of(seen.instant.place, tangents[p], row.marker);
  }
  for (size_t n = 0; n < fitted_.size(); ++n) {
    const auto own = static_cast<Eigen::Index>(n);
    by_coordinate.col(fitted_[n]) += slope_[own] * by_position * seen.by_parameter.col(own);
  }
  return predicted;
}

}  // namespace clothfit
