#include "fit/objective.h"

#include <cassert>
#include <cmath>
#include <limits>

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

bool Objective::linearise(const Eigen::VectorXd& values, Differences differences,
                          Eigen::VectorXd& residual, Eigen::MatrixXd& residual_by_coordinate,
                          double step) const {
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
  std::vector<Eigen::VectorXd> results = residuals(points);
  for (const Eigen::VectorXd& result : results)
    if (result.size() != residual_count_) return false;
  residual = std::move(results.front());
  residual_by_coordinate.resize(residual_count_, parameters);
  for (int p = 0; p < parameters; ++p) {
    const auto plus = static_cast<size_t>(central ? 1 + 2 * p : 1 + p);
    residual_by_coordinate.col(p) = central
                                        ? ((results[plus] - results[plus + 1]) / (2 * step)).eval()
                                        : ((results[plus] - residual) / step).eval();
  }
  return true;
}

double Objective::mean_length(const Eigen::VectorXd& residual) const {
  if (residual.size() != residual_count_ || blocks_.empty())
    return std::numeric_limits<double>::infinity();
  double sum = 0;
  for (const Block& block : blocks_) sum += residual.segment(block.offset, block.dimension).norm();
  return sum / static_cast<double>(blocks_.size());
}

}  // namespace clothfit
