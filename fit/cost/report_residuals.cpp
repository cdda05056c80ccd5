#include "fit/cost/report_residuals.h"

#include <cmath>
#include <limits>

#include "fit/observe/trivial_predictors.h"

namespace clothfit {
namespace {

/// Accumulates root mean squares of residuals.
struct Accumulator {
  double sum = 0;
  int points = 0;
  int dimension = 1;
  void add(const Eigen::VectorXd& residual) {
    sum += residual.squaredNorm();
    ++points;
    dimension = static_cast<int>(residual.size());
  }
  double rms() const { return points > 0 ? std::sqrt(sum / (points * dimension)) : 0; }
  ErrorSummary summary() const {
    return {.rms = rms(),
            .rms_distance = rms() * std::sqrt(static_cast<double>(dimension)),
            .count = points};
  }
};

/// Returns where the observer of a set sees the held points in every frame. Points that move are
/// seen as driven, others where the placed sheet has them.
std::vector<Eigen::MatrixXd> held_tracks(const FitProblem& problem, const ObservationSet& set) {
  std::vector<Eigen::MatrixXd> tracks;
  for (const HeldVertexWeights& held : problem.cloth.held) {
    Eigen::Vector3d start = Eigen::Vector3d::Zero();
    for (const auto& [vertex, weight] : held.weights)
      start += weight * problem.placed_sheet_m.col(vertex);
    Eigen::MatrixXd track(set.dimension, problem.frames());
    for (int f = 0; f < problem.frames(); ++f) {
      const double time_s = problem.frame_time_s[static_cast<size_t>(f)];
      const auto seen = set.predict(held.motion ? held.motion(time_s) : start);
      if (seen)
        track.col(f) = seen->head(set.dimension);
      else
        track.col(f).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    tracks.push_back(std::move(track));
  }
  return tracks;
}

/// Returns the mean displacement of the held points; a cloth that nothing holds stays.
Eigen::MatrixXd held_displacement(const FitProblem& problem, const ObservationSet& set) {
  if (problem.cloth.held.empty()) return Eigen::MatrixXd::Zero(set.dimension, problem.frames());
  return mean_displacement(held_tracks(problem, set));
}

/// Fills the trivial predictors' part.
void add_trivial_predictors(const FitProblem& problem, const ObservationSet& set,
                            FitReport::Residuals& residuals, TrivialErrors& errors) {
  const std::vector<Eigen::MatrixXd> tracks =
      marker_tracks(set, static_cast<int>(problem.vertex_weights.rows()), problem.frames());
  const int from = std::max(1, problem.first_held_out);
  const TrivialPrediction first = predict_first_frame(tracks, from);
  const TrivialPrediction velocity = predict_last_velocity(problem.frame_time_s, tracks, from);
  const TrivialPrediction rigid = predict_rigid(tracks, held_displacement(problem, set), from);
  residuals.first_frame_by_frame = first.rms_by_frame;
  residuals.last_velocity_by_frame = velocity.rms_by_frame;
  residuals.rigid_by_frame = rigid.rms_by_frame;
  errors = {.first_frame = first.held_out_rms,
            .last_velocity = velocity.held_out_rms,
            .rigid = rigid.held_out_rms};
}

}  // namespace

void fill_residuals(const FitProblem& problem, const Predictor& predictor, const MarkerRun& run,
                    FitReport& report) {
  const auto frames = static_cast<size_t>(problem.frames());
  for (size_t s = 0; s < problem.observations.size(); ++s) {
    const ObservationSet& set = problem.observations[s];
    FitReport::Residuals residuals{.kind = set.kind, .unit = set.unit};
    Accumulator fitted, held_out;
    std::vector<Accumulator> by_frame(frames);
    for (const Observation& row : set.rows) {
      const auto predicted = predictor.predict(static_cast<int>(s), row, run);
      if (!predicted) continue;  // the point is behind the camera: no pixel to compare
      const bool is_held_out = row.frame >= problem.first_held_out;
      const Eigen::VectorXd difference = (*predicted - row.observed).head(set.dimension);
      (is_held_out ? held_out : fitted).add(difference);
      by_frame[static_cast<size_t>(row.frame)].add(difference);
      residuals.rows.push_back({.frame = row.frame,
                                .marker = row.marker,
                                .observed = row.observed.head(set.dimension),
                                .predicted = predicted->head(set.dimension),
                                .sigma = row.sigma,
                                .held_out = is_held_out});
    }
    for (const Accumulator& frame : by_frame)
      residuals.rms_by_frame.push_back(frame.points > 0 ? frame.rms()
                                                        : std::numeric_limits<double>::quiet_NaN());
    ObservationErrors errors{.kind = set.kind,
                             .unit = set.unit,
                             .fitted = fitted.summary(),
                             .held_out = held_out.summary(),
                             .noise = set.noise};
    add_trivial_predictors(problem, set, residuals, errors.trivial);
    report.residuals.push_back(std::move(residuals));
    report.result.errors.push_back(std::move(errors));
  }
}

}  // namespace clothfit
