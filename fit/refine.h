#pragma once

#include <functional>
#include <memory>
#include <string>

#include "fit/objective.h"

namespace clothfit {

struct RefineOptions {
  int iterations = 25;       ///< of one Ceres solve
  int rounds = 6;            ///< solves, each with a time step chosen anew
  double least_gain = 1e-7;  ///< a solve ends when the cost falls by less than this share
  double least_step = 1e-6;  ///< or when a step is less than this share of the coordinates' norm
  Derivatives derivatives = Derivatives::tangents;
  double difference_step = Objective::kDifferenceStep;  ///< in coordinates; wider sees the trend
  Loss loss = Loss::huber;
  /// Of a round's first step, as Ceres has it: large where the start is near, so that directions
  /// that the data hardly determine are not held back.
  double trust_region_radius = 1e2;
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
  /// The exact derivatives there, residuals x coordinates; empty where they were not had.
  Eigen::MatrixXd residual_by_coordinate;
  double cost = 0;          ///< robust cost per residual
  double robust_scale = 1;  ///< residuals beyond three times this were weighed down by Huber's loss
  double time_step_s = 0;
  int solver_iterations = 0;
  int simulations = 0;
  std::string message;
};

/// Makes the cost that a round lowers, with the time step that the round chose (or with one of its
/// own).
using ObjectiveMaker = std::function<std::unique_ptr<Objective>(double time_step_s)>;

/// Least squares with Ceres, from `start`: the residuals of every observation under the loss, and
/// the problem's priors. Huber's scale is the residuals' own at the start of each round. The time
/// step of a round is fixed; a parameter vector for which it would not be stable is refused like
/// any failed step, and when the optimum leans on that limit another round follows with a smaller
/// one. A coordinate at a bound that keeps it from a lower cost takes no part in a step.
RefineResult refine(const FitProblem& problem, const ObjectiveMaker& make_objective,
                    const Eigen::VectorXd& start, const RefineOptions& options,
                    const ProgressCallback& progress);

/// The same of the trajectory cost over the first `frames` frames.
RefineResult refine(const FitProblem& problem, int frames, const Eigen::VectorXd& start,
                    const RefineOptions& options, const ProgressCallback& progress);

/// Huber's threshold in units of the residuals' robust scale.
inline constexpr double kHuberScales = 3;

/// 1.4826 times the median absolute value, at least 1: the size of whitened residuals.
double robust_scale(const Eigen::VectorXd& residual);

}  // namespace clothfit
