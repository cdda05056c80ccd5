#pragma once

#include <string>

#include "fit/objective.h"

namespace clothfit {

struct RefineOptions {
  int iterations = 25;       ///< of one Ceres solve
  int rounds = 6;            ///< solves, each with a time step chosen anew
  double least_gain = 1e-7;  ///< a solve ends when the cost falls by less than this share
  Differences differences = Differences::central;       ///< forward: half the runs, a blunter end
  double difference_step = Objective::kDifferenceStep;  ///< in coordinates; wider sees the trend
  /// Springs times time steps of the linearisations' runs: looked at after each iteration but the
  /// first.
  double most_spring_steps = 1e18;
  double stability_margin = 1.5;  ///< stiffness and damping may grow this much before a new round
  double substep_scale = 1;
};

struct RefineResult {
  bool usable = false;
  bool cancelled = false;
  bool converged = false;
  Eigen::VectorXd values;
  double cost = 0;          ///< robust cost per residual
  double robust_scale = 1;  ///< residuals beyond three times this were weighed down (Huber)
  double time_step_s = 0;
  int solver_iterations = 0;
  int simulations = 0;
  std::string message;
};

/// Least squares over the first `frames` frames with Ceres, from `start`: trajectory residuals of
/// every observation under a Huber loss whose scale is the residuals' own at the start of each
/// round, and the problem's priors. The time step of a round is fixed; a parameter vector for which
/// it would not be stable is refused like any failed step, and when the optimum leans on that limit
/// another round follows with a smaller one. A coordinate at a bound that keeps it from a lower
/// cost takes no part in a step.
RefineResult refine(const FitProblem& problem, int frames, const Eigen::VectorXd& start,
                    const RefineOptions& options, const ProgressCallback& progress);

/// Huber's threshold in units of the residuals' robust scale.
inline constexpr double kHuberScales = 3;

/// 1.4826 times the median absolute value, at least 1: the size of whitened residuals.
double robust_scale(const Eigen::VectorXd& residual);

}  // namespace clothfit
