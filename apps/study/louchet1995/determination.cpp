#include "apps/study/louchet1995/determination.h"

#include <cmath>

#include "data/algebra/dense_factors.h"

namespace clothfit {
namespace {

/// No data determine a combination of parameters whose information is below this rounding error.
/// Columns are of unit length.
constexpr double kNoInformation = 1e-13;
/// A parameter takes part in a combination from this share on.
constexpr double kTakesPart = 1e-3;

/// Makes every vertex a marker, seen without error where the model has it.
void observe_vertices(FitProblem& problem, const RecordedStates& states, double frame_rate_hz,
                      double noise_m) {
  const int vertices = problem.cloth.mesh.vertex_count();
  problem.frame_time_s.clear();
  for (int frame = 0; frame <= std::floor(states.time_s.back() * frame_rate_hz + 1e-9); ++frame)
    problem.frame_time_s.push_back(frame / frame_rate_hz);
  problem.first_held_out = problem.frames();
  problem.vertex_weights.resize(vertices, vertices);
  problem.vertex_weights.setIdentity();
  ObservationSet set{.kind = "tracks3d", .unit = "m", .noise = noise_m};
  for (int frame = 1; frame < problem.frames(); ++frame)
    for (int vertex = 0; vertex < vertices; ++vertex)
      set.rows.push_back({.frame = frame, .marker = vertex, .sigma = noise_m});
  problem.observations = {set};
}

}  // namespace

Eigen::VectorXd relative_sigmas(const Objective& whitened, const Eigen::VectorXd& truth) {
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(truth.size(), INFINITY);
  const Linearisation linear = whitened.linearise(truth);
  if (!linear.usable) return sigma;
  const Eigen::VectorXd relative_by_coordinate =
      whitened.problem().space.value_by_coordinate(truth).cwiseQuotient(truth);
  Eigen::MatrixXd jacobian =
      linear.residual_by_coordinate * relative_by_coordinate.cwiseInverse().asDiagonal();
  const Eigen::VectorXd length = jacobian.colwise().norm();
  for (Eigen::Index p = 0; p < truth.size(); ++p)
    if (length[p] > 0) jacobian.col(p) /= length[p];
  const SymmetricEigen information = symmetric_eigen(jacobian.transpose() * jacobian);
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(truth.size());
  for (Eigen::Index k = 0; k < truth.size(); ++k) {
    const Eigen::VectorXd& direction = information.vectors.col(k);
    const double told = information.values[k];
    for (Eigen::Index p = 0; p < truth.size(); ++p)
      if (told > kNoInformation)
        variance[p] += direction[p] * direction[p] / told;
      else if (std::abs(direction[p]) > kTakesPart)
        variance[p] = INFINITY;
  }
  for (Eigen::Index p = 0; p < truth.size(); ++p)
    if (length[p] > 0) sigma[p] = std::sqrt(variance[p]) / length[p];
  return sigma;
}

Eigen::VectorXd measured_sigmas(const PaperExperiment& experiment, const RecordedStates& states,
                                SpringSet set, double frame_rate_hz, double noise_m) {
  FitProblem problem = paper_problem(experiment, states, set);
  observe_vertices(problem, states, frame_rate_hz, noise_m);
  const TrajectoryObjective objective(problem, problem.frames(), experiment.time_step_s);
  return relative_sigmas(objective, paper_truth(experiment, set));
}

Eigen::VectorXd transition_sigmas(const PaperExperiment& experiment, const RecordedStates& states,
                                  SpringSet set, int transition, double noise_m) {
  const FitProblem problem = paper_problem(experiment, states, set);
  const StateObjective objective(problem, states, {transition}, experiment.time_step_s, noise_m);
  return relative_sigmas(objective, paper_truth(experiment, set));
}

double share_at_limit(const PaperExperiment& experiment, const RecordedStates& states, int state) {
  const FitProblem problem = paper_problem(experiment, states, SpringSet::louchet5);
  const SpringParameters springs = spring_parameters(experiment.reference);
  const Eigen::Matrix3Xd& position_m = states.position_m[static_cast<size_t>(state)];
  long at_limit = 0, count = 0;
  for (size_t type = 0; type < kSpringTypes; ++type) {
    const double limit_m = springs.natural_length_m[type] * (1 + springs.critical_elongation[type]);
    for (const auto& [a, b] : problem.cloth.springs[type]) {
      const double length_m = (position_m.col(b) - position_m.col(a)).norm();
      at_limit += length_m > limit_m * (1 - 1e-9);
      ++count;
    }
  }
  return static_cast<double>(at_limit) / static_cast<double>(count);
}

}  // namespace clothfit
