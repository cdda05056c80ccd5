#include "fit/problem/predictor.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace clothfit {
/// Weights on the frames of a run that express a time:
/// x(t) = sum over k of  position[k] x(frame + k) + velocity[k] v(frame + k).
struct Predictor::Instant {
  struct Weights {
    std::array<double, 2> position{}, velocity{};
  };
  size_t frame = 0;
  Weights place, rate;  ///< for x and for dx/dt

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

  /// Returns x at the time `at_s`, whose derivatives it takes over.
  MeasuredPoint moving(const MarkerRun& run, int marker, const MeasuredNumber& at_s) const {
    const Eigen::Vector3d x = of(place, run, marker), by_time = of(rate, run, marker);
    MeasuredPoint result;
    for (int c = 0; c < 3; ++c) {
      result[c] = MeasuredNumber(x[c]);
      result[c].v += by_time[c] * at_s.v;
    }
    return result;
  }
};

/// The parts of one sight of a marker: looks at some instants with weights, beside the marker.
struct Predictor::Looks {
  struct Look {
    Instant instant;
    double weight = 1;
  };
  std::array<Look, 3> look;
  size_t count = 1;
  /// Distance beside the marker, as factors of the surface's derivatives there.
  std::array<double, kSurfaceDerivatives.size()> beside{};

  /// Returns the same for a derivative of the run.
  Eigen::Vector3d of(const MarkerRun& tangent, int marker) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t k = 0; k < count; ++k) {
      const Instant& at = look[k].instant;
      sum += look[k].weight * at.of(at.place, tangent, marker);
      for (size_t d = 0; d < tangent.derivatives.size(); ++d)
        sum += look[k].weight * beside[d] * at.of(at.place, tangent.derivatives[d], marker);
    }
    return sum;
  }
};

/// A marker as the observer sees it, with derivatives by the places of the looks and by the
/// parameters.
struct Predictor::Appearance {
  Looks looks;
  Eigen::Vector3d seen;
  Eigen::Matrix3d by_place = Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, 3, kMeasurementParameters> by_parameter;

  MeasuredNumber coordinate(Eigen::Index c) const {
    MeasuredNumber number(seen[c]);
    number.v << by_place.row(c).transpose(), by_parameter.row(c).transpose();
    return number;
  }

  void set_coordinate(Eigen::Index c, const MeasuredNumber& number) {
    seen[c] = number.a;
    by_place.row(c) = number.v.head<kMeasuredPlace>();
    by_parameter.row(c) = number.v.tail<kMeasurementParameters>();
  }
};

namespace {

double median_interval_s(const std::vector<double>& time_s) {
  std::vector<double> interval_s;
  for (size_t f = 1; f < time_s.size(); ++f) interval_s.push_back(time_s[f] - time_s[f - 1]);
  if (interval_s.empty()) return 0;
  const auto middle = interval_s.begin() + static_cast<std::ptrdiff_t>(interval_s.size() / 2);
  std::ranges::nth_element(interval_s, middle);
  return *middle;
}

}  // namespace

MarkerRun marker_run(const FitProblem& problem, const std::vector<Eigen::Matrix3Xd>& position_m,
                     const std::vector<Eigen::Matrix3Xd>& velocity_m_per_s) {
  const auto seen_with = [&](const Surface::Weights& weights) {
    return MarkerRun{.position_m = marker_positions(weights, position_m),
                     .velocity_m_per_s = marker_positions(weights, velocity_m_per_s),
                     .derivatives = {}};
  };
  MarkerRun run = seen_with(problem.vertex_weights);
  for (const Surface::Weights& derivative : problem.derivative_weights)
    run.derivatives.push_back(seen_with(derivative));
  return run;
}

MarkerRun marker_run(const FitProblem& problem, const SimulateResult& run) {
  return marker_run(problem, run.position_m, run.velocity_m_per_s);
}

Predictor::Predictor(const FitProblem& problem, const Eigen::VectorXd& values)
    : problem_(problem),
      sheet_middle_m_(problem.placed_sheet_m.rowwise().mean()),
      pattern_middle_m_(problem.marker_place_m.rowwise().mean()) {
  needs_velocities_ = problem.reads_in_rows;
  if (!problem.measurement.empty()) frame_interval_s_ = median_interval_s(problem.frame_time_s);
  for (const FitProblem::MeasurementTerm& term : problem.measurement) {
    mixes_neighbours_ = mixes_neighbours_ || term.effect->mixes_neighbours();
    needs_velocities_ = needs_velocities_ || mixes_neighbours_ || term.effect->shifts_time();
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

Sighting Predictor::sighting(const ObservationSet& set, const Observation& row) const {
  return {.time_s = problem_.frame_time_s[static_cast<size_t>(row.frame)],
          .first_time_s = problem_.frame_time_s.front(),
          .frame_interval_s = frame_interval_s_,
          .sheet_middle_m = sheet_middle_m_,
          .from_pattern_middle_m = problem_.marker_place_m.col(row.marker) - pattern_middle_m_,
          .camera = set.camera ? &*set.camera : nullptr,
          .observed_row_px = set.camera ? row.observed.y() : 0};
}

MeasuredNumber Predictor::seen_s(const Sighting& sighting) const {
  MeasuredNumber time_s(sighting.time_s);
  if (problem_.reads_in_rows)
    time_s += sighting.camera->readout_time_s *
              (sighting.observed_row_px / sighting.camera->image_height - 0.5);
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
      last_s = std::max(last_s, seen_s(sighting(set, row)).a);
    }
  }
  if (mixes_neighbours_) last_s += frame_interval_s_;
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

MeasuredPoint Predictor::look(const Sighting& sighting, const Observation& row,
                              const MarkerRun& run, Looks& looks) const {
  assert(run.derivatives.size() == problem_.derivative_weights.size());
  const MeasuredNumber time_s = seen_s(sighting);
  MeasuredNumber mixed(0.0);
  MeasuredPair shift_m(MeasuredNumber(0.0), MeasuredNumber(0.0));
  for (size_t e = 0; e < parameters_.size(); ++e) {
    problem_.measurement[e].effect->mix_neighbours(sighting, parameters_[e], mixed);
    problem_.measurement[e].effect->shift_place(sighting, parameters_[e], shift_m);
  }
  const std::array<MeasuredNumber, kSurfaceDerivatives.size()> beside{
      shift_m[0], shift_m[1], 0.5 * shift_m[0] * shift_m[0], shift_m[0] * shift_m[1],
      0.5 * shift_m[1] * shift_m[1]};
  std::ranges::transform(beside, looks.beside.begin(), &MeasuredNumber::a);
  looks.count = mixes_neighbours_ ? 3 : 1;
  const std::array<MeasuredNumber, 3> weight{1.0 - 2.0 * mixed, mixed, mixed};
  const std::array<double, 3> later_s{0, -frame_interval_s_, frame_interval_s_};
  MeasuredPoint point = Eigen::Vector3d::Zero().cast<MeasuredNumber>();
  for (size_t k = 0; k < looks.count; ++k) {
    const MeasuredNumber at_s = time_s + later_s[k];
    Instant& at = looks.look[k].instant;
    if (needs_velocities_) at = instant(at_s.a, run.position_m.size());
    looks.look[k].weight = weight[k].a;
    MeasuredPoint place = at.moving(run, row.marker, at_s);
    for (size_t d = 0; d < run.derivatives.size(); ++d)
      place += at.moving(run.derivatives[d], row.marker, at_s) * beside[d];
    point += place * weight[k];
  }
  for (int c = 0; c < kMeasuredPlace; ++c) point[c].v[c] += 1;
  return point;
}

/// Says whether the observer sees the marker at all.
bool Predictor::appears(const ObservationSet& set, const Observation& row, const MarkerRun& run,
                        bool derivatives, Appearance& result) const {
  Instant& at_frame = result.looks.look[0].instant;
  at_frame.frame = static_cast<size_t>(row.frame);
  at_frame.place.position[0] = 1;
  const bool measured_exactly = parameters_.empty() && !problem_.reads_in_rows;
  Sighting from;
  if (measured_exactly) {
    result.seen = run.position_m[at_frame.frame].col(row.marker);
  } else {
    from = sighting(set, row);
    MeasuredPoint point = look(from, row, run, result.looks);
    for (size_t e = 0; e < parameters_.size(); ++e)
      problem_.measurement[e].effect->move(from, parameters_[e], point);
    for (int c = 0; c < 3; ++c) result.set_coordinate(c, point[c]);
  }
  if (marker_offset_m_.cols() > 0) result.seen += marker_offset_m_.col(row.marker);

  Eigen::Matrix3d by_position;
  const auto seen = set.predict(result.seen, derivatives ? &by_position : nullptr);
  if (!seen) return false;
  result.seen = *seen;
  if (derivatives) result.by_place = (by_position * result.by_place).eval();
  if (measured_exactly) return true;
  if (derivatives) result.by_parameter = (by_position * result.by_parameter).eval();
  if (!set.camera) return true;
  MeasuredPair pixel(result.coordinate(0), result.coordinate(1));
  for (size_t e = 0; e < parameters_.size(); ++e)
    problem_.measurement[e].effect->move_pixel(from, parameters_[e], pixel);
  for (int c = 0; c < 2; ++c) result.set_coordinate(c, pixel[c]);
  return true;
}

std::optional<Eigen::Vector3d> Predictor::predict(int set, const Observation& row,
                                                  const MarkerRun& run) const {
  const ObservationSet& observer = problem_.observations[static_cast<size_t>(set)];
  Appearance found;
  if (!appears(observer, row, run, false, found)) return std::nullopt;
  return found.seen;
}

std::optional<Eigen::Vector3d> Predictor::predict(
    int set, const Observation& row, const MarkerRun& run, std::span<const MarkerRun> tangents,
    Eigen::Ref<Eigen::Matrix3Xd> by_coordinate) const {
  assert(static_cast<Eigen::Index>(tangents.size()) == by_coordinate.cols());
  const ObservationSet& observer = problem_.observations[static_cast<size_t>(set)];
  Appearance found;
  if (!appears(observer, row, run, true, found)) return std::nullopt;
  for (size_t p = 0; p < tangents.size(); ++p) {
    auto column = by_coordinate.col(static_cast<Eigen::Index>(p));
    if (tangents[p].position_m.empty())
      column.setZero();
    else
      column = found.by_place * found.looks.of(tangents[p], row.marker);
  }
  for (size_t n = 0; n < fitted_.size(); ++n) {
    const auto own = static_cast<Eigen::Index>(n);
    by_coordinate.col(fitted_[n]) += slope_[own] * found.by_parameter.col(own);
  }
  return found.seen;
}

}  // namespace clothfit
