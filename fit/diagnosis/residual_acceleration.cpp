#include "fit/diagnosis/residual_acceleration.h"

#include <cstddef>
#include <map>

#include "data/algebra/dense_factors.h"

namespace clothfit {
namespace {

constexpr int kReach = 2;            ///< frames on either side
constexpr size_t kFewestFrames = 4;  ///< of the five

struct TimedResidual {
  double time_s = 0, sigma_m = 0;
  Eigen::Vector3d residual_m;
};

/// The parabola's second derivative at the samples' mean time, and its sigma.
ResidualAcceleration fit_parabola(const std::vector<const TimedResidual*>& samples) {
  const auto count = static_cast<Eigen::Index>(samples.size());
  double middle_s = 0;
  for (const TimedResidual* sample : samples)
    middle_s += sample->time_s / static_cast<double>(count);
  Eigen::MatrixXd powers(count, 3), residual_m(count, 3);
  for (Eigen::Index k = 0; k < count; ++k) {
    const TimedResidual& sample = *samples[static_cast<size_t>(k)];
    const double t = sample.time_s - middle_s;
    powers.row(k) << 1, t, 0.5 * t * t;
    powers.row(k) /= sample.sigma_m;
    residual_m.row(k) = sample.residual_m.transpose() / sample.sigma_m;
  }
  // Times are of the order of the frames' interval, so its powers are scaled to one.
  const Eigen::RowVector3d size = powers.colwise().norm();
  powers = powers * size.cwiseInverse().asDiagonal();
  const SymmetricFactors information(Eigen::MatrixXd(powers.transpose() * powers));
  const Eigen::MatrixXd parabola = information.solve(powers.transpose() * residual_m);
  const Eigen::MatrixXd covariance = information.solve(Eigen::MatrixXd::Identity(3, 3));
  ResidualAcceleration result;
  result.acceleration_m_per_s2 = parabola.row(2).transpose() / size[2];
  result.sigma_m_per_s2 = std::sqrt(covariance(2, 2)) / size[2];
  return result;
}

}  // namespace

std::vector<ResidualAcceleration> residual_accelerations(const FittedModel& model,
                                                         size_t recording) {
  const FitProblem& problem = *model.problems[recording];
  const Eigen::VectorXd residual = residual_of(model.parts[recording]);
  std::map<int, std::map<int, TimedResidual>> of_marker;  // of each frame
  std::map<int, std::map<int, Eigen::Vector3d>> observed_m;
  const TrajectoryObjective objective = model.objective(recording);
  for (const Objective::Block& block : objective.blocks()) {
    if (block.set < 0 || block.dimension != 3) continue;
    const Observation& row =
        problem.observations[static_cast<size_t>(block.set)].rows[static_cast<size_t>(block.row)];
    // Residuals are predicted less observed, in sigmas.
    of_marker[block.marker][block.frame] = {
        .time_s = problem.frame_time_s[static_cast<size_t>(block.frame)],
        .sigma_m = row.sigma,
        .residual_m = -row.sigma * residual.segment<3>(block.offset)};
    observed_m[block.marker][block.frame] = row.observed;
  }
  std::vector<ResidualAcceleration> result;
  for (const auto& [marker, frames] : of_marker) {
    for (const auto& [frame, here] : frames) {
      if (!frames.contains(frame - 1) || !frames.contains(frame + 1)) continue;
      std::vector<const TimedResidual*> around;
      for (int f = frame - kReach; f <= frame + kReach; ++f)
        if (const auto found = frames.find(f); found != frames.end())
          around.push_back(&found->second);
      if (around.size() < kFewestFrames) continue;
      result.push_back(fit_parabola(around));
      result.back().marker = marker;
      result.back().frame = frame;
      result.back().observed_m = observed_m[marker][frame];
    }
  }
  return result;
}

}  // namespace clothfit
