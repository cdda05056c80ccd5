#include "fit/report_residuals.h"

#include <cmath>
#include <limits>

namespace clothfit {
namespace {

/// Root mean squares of residuals as they come.
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

}  // namespace

void fill_residuals(const FitProblem& problem, const FitInput& input,
                    const std::vector<Eigen::Matrix3Xd>& mesh_positions, FitReport& report) {
  const auto markers = marker_positions(problem.vertex_weights, mesh_positions);
  const auto frames = static_cast<size_t>(problem.frames());
  for (const ObservationSet& set : problem.observations) {
    FitReport::Residuals residuals{.kind = set.kind, .unit = set.unit};
    Accumulator fitted, held_out;
    std::vector<Accumulator> by_frame(frames);
    for (const Observation& row : set.rows) {
      const auto predicted = set.predict(markers[static_cast<size_t>(row.frame)].col(row.marker));
      if (!predicted) continue;  // the model moved it behind the camera: no pixel to compare
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
    (void)input;
    report.residuals.push_back(std::move(residuals));
    report.result.errors.push_back(std::move(errors));
  }
}

}  // namespace clothfit
