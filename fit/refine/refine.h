#pragma once

#include <functional>
#include <memory>
#include <string>

#include "data/progress.h"
#include "fit/cost/objective.h"
#include "fit/problem/time_steps.h"

namespace clothfit {

struct RefineOptions {
  int iterations = 25;       ///< of one Ceres solve
  int rounds = 6;            ///< solves, each with a time step of its own
  double least_gain = 1e-7;  ///< a solve ends when the cost falls by less than this share
  double least_step = 1e-6;  ///< or when a step is less than this share of the coordinates' norm
  Derivatives derivatives = Derivatives::tangents;
  double difference_step = Objective::kDifferenceStep;  ///< in coordinates; wider sees the trend
  /// Exact derivatives cost as much as ten runs. Those had at one point serve at another while they
  /// predict the residuals' change on the way to within `kept_within` of it: they err by about
  /// that share then, and the optimum by that share of its sigma. Up to `updated_within` they are
  /// corrected by what they missed [broyden1965], and another round looks at where they lead.
  double kept_within = 0.01;
  double updated_within = 0.3;
  bool exact_in_the_end = true;  ///< whether updated derivatives ask for another round
  Loss loss = Loss::huber;
  /// The trust region's radius in a round's first step, as Ceres has it. It is large where the
  /// start is near, so that directions that the data hardly determine are not held back.
  double trust_region_radius = 1e2;
  /// Springs times time steps of the linearisations' runs: looked at after each iteration but the
  /// first.
  double most_spring_steps = 1e18;
  double stability_margin =
      kStabilityMargin;  ///< stiffness and damping may grow this much before a new round
  double substep_scale = 1;
};

struct RefineResult {
  bool usable = false;
  bool converged = false;
  Eigen::VectorXd values;
  /// The exact derivatives there, or where they were last had (RefineOptions::kept_within),
  /// residuals x coordinates; empty where there are none.
  Eigen::MatrixXd residual_by_coordinate;
  double cost = 0;          ///< robust cost per residual
  double robust_scale = 1;  ///< residuals beyond three times this were weighed down by Huber's loss
  double time_step_s = 0;
  int solver_iterations = 0;
  int simulations = 0;
  std::string message;
};

/// Makes the cost that a round lowers, with the time steps that the round chose (or with its own).
using ObjectiveMaker = std::function<std::unique_ptr<Objective>(const TimeSteps& steps)>;

/// Least squares with Ceres, from `start`: the residuals of every observation under the loss, and
/// the problem's priors. Huber's scale is the residuals' own at the start of each round. The time
/// steps are those that are stable where a round begins, with a margin; a trial that asks for finer
/// ones gets them for the rest of the round, down to half, and is refused like any failed step
/// beyond. When the optimum leans on that limit another round follows. A coordinate at a bound that
/// keeps it from a lower cost takes no part in a step.
RefineResult refine(const FitProblem& problem, const ObjectiveMaker& make_objective,
                    const Eigen::VectorXd& start, const RefineOptions& options,
                    const ProgressCallback& progress);

/// The same of the trajectory cost over the first `frames` frames.
RefineResult refine(const FitProblem& problem, int frames, const Eigen::VectorXd& start,
                    const RefineOptions& options, const ProgressCallback& progress);

}  // namespace clothfit
