#include "fit/objective.h"

#include <cassert>
#include <cmath>
#include <limits>

#include "model/simulate.h"
#include "model/stability.h"

namespace clothfit {

Objective::Objective(const FitProblem& problem, int frames, double time_step_s)
    : problem_(problem), frames_(frames), time_step_s_(time_step_s) {
  assert(frames >= 1 && frames <= problem.frames());
  for (size_t s = 0; s < problem.observations.size(); ++s) {
    const ObservationSet& set = problem.observations[s];
    for (size_t r = 0; r < set.rows.size(); ++r) {
      if (set.rows[r].frame >= frames) break;  // rows are sorted by frame
      blocks_.push_back({static_cast<int>(s), static_cast<int>(r), residual_count_, set.dimension});
      residual_count_ += set.dimension;
    }
  }
}

double Objective::spring_steps_per_run() const {
  const Schedule schedule{.frame_time_s = problem_.frame_time_s, .time_step_s = time_step_s_};
  double steps = 0;
  for (int frame = 1; frame < frames_; ++frame) steps += schedule.substeps(frame);
  return steps * static_cast<double>(problem_.cloth.spring_count());
}

std::vector<Eigen::VectorXd> Objective::residuals(
    const std::vector<Eigen::VectorXd>& values) const {
  const auto trajectories = run_model(problem_, values, frames_, time_step_s_);
  std::vector<Eigen::VectorXd> results(values.size());
  for (size_t n = 0; n < values.size(); ++n) {
    if (trajectories[n].empty()) continue;
    const auto markers = marker_positions(problem_.vertex_weights, trajectories[n]);
    Eigen::VectorXd residual(residual_count_);
    bool visible = true;
    for (const Block& block : blocks_) {
      const ObservationSet& set = problem_.observations[static_cast<size_t>(block.set)];
      const Observation& row = set.rows[static_cast<size_t>(block.row)];
      const auto predicted = set.predict(markers[static_cast<size_t>(row.frame)].col(row.marker));
      if (!predicted) {
        visible = false;
        break;
      }
      residual.segment(block.offset, block.dimension) =
          (*predicted - row.observed).head(block.dimension) / row.sigma;
    }
    if (visible && residual.allFinite()) results[n] = std::move(residual);
  }
  return results;
}

Linearisation Objective::linearise(const Eigen::VectorXd& values, Differences differences,
                                   double step) const {
  Linearisation result;
  const int parameters = problem_.space.size();
  const bool central = differences == Differences::central;
  const Eigen::VectorXd coordinates = problem_.space.coordinates(values);
  std::vector<Eigen::VectorXd> points{values};
  const auto add_point = [&](int p, double offset) {
    Eigen::VectorXd moved = coordinates;
    moved[p] += offset;
    points.push_back(problem_.space.values(moved));
  };
  for (int p = 0; p < parameters; ++p) {
    add_point(p, step);
    if (central) add_point(p, -step);
  }
  // One whose time step would not be stable spoils all; the others need not run then.
  for (const Eigen::VectorXd& point : points)
    if (stable_time_step_s(problem_.cloth, parameter_set(problem_, point)) < time_step_s_)
      return result;
  std::vector<Eigen::VectorXd> residuals_of = residuals(points);
  result.runs = static_cast<int>(points.size());
  for (const Eigen::VectorXd& residual : residuals_of)
    if (residual.size() != residual_count_) return result;
  result.usable = true;
  result.residual = std::move(residuals_of.front());
  result.residual_by_coordinate.resize(residual_count_, parameters);
  for (int p = 0; p < parameters; ++p) {
    const auto plus = static_cast<size_t>(central ? 1 + 2 * p : 1 + p);
    const Eigen::VectorXd& from = central ? residuals_of[plus + 1] : result.residual;
    result.residual_by_coordinate.col(p) =
        (residuals_of[plus] - from) / (central ? 2 * step : step);
  }
  return result;
}

double Objective::mean_length(const Eigen::VectorXd& residual) const {
  if (residual.size() != residual_count_ || blocks_.empty())
    return std::numeric_limits<double>::infinity();
  double sum = 0;
  for (const Block& block : blocks_) sum += residual.segment(block.offset, block.dimension).norm();
  return sum / static_cast<double>(blocks_.size());
}

}  // namespace clothfit
