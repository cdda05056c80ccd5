#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "data/progress.h"
#include "fit/cost/objective.h"
#include "fit/refine/pooled_space.h"

namespace clothfit {

/// One recording's part of a pooled fit.
struct PooledPart {
  Eigen::VectorXd values;  ///< of its problem's parameters
  int frames = 0;          ///< looked at, from the first; 0: those that are not held out
  TimeSteps steps = 0;     ///< 0: as stability asks
  /// There, with these steps; where it is usable a fit begins with it. In the end of a fit: the
  /// residuals, and exact derivatives or such as served (PooledOptions::kept_within).
  Linearisation linear;
  bool borrowed = false;  ///< the derivatives are those of another model, until a step fails
  /// The error that is expected of the model, added to its residuals; empty: none.
  Eigen::VectorXd correction;
  /// Directions, residuals x any, in which it may err beyond that, each by a standard normal
  /// amplitude: residuals are r + correction + directions * amplitudes, which are fitted along.
  Eigen::MatrixXd directions;
  Eigen::VectorXd amplitudes;  ///< of the directions, as they were fitted
};

/// Residuals of a part with what it is expected to err by taken out.
Eigen::VectorXd corrected_residual(const PooledPart& part);

/// The same, and what its directions explain.
Eigen::VectorXd residual_of(const PooledPart& part);

struct PooledOptions {
  int iterations = 60;  ///< in all, without steps that were refused
  /// Exact derivatives, of all recordings together, after which it ends.
  int linearisations = 1000000;
  int rounds = 6;            ///< each with its own time steps and loss, until one hardly moves
  double least_step = 1e-7;  ///< it ends when no shared coordinate moves further,
  /// or the next step promises no more of the cost than this, times chi-square per residual where
  /// that is above one: the more is left, the less sure is any parameter.
  double least_decrease = 0;
  double stability_margin = 1.5;
  Loss loss = Loss::squared;
  /// Exact derivatives are computed, updated, or kept, as in a refinement (RefineOptions).
  double kept_within = 0;
  double updated_within = 0;
  bool own_only = false;  ///< shared parameters stay where they are
  /// Derivatives that a fit begins with are updated and never computed: near the optimum for the
  /// price of some runs. One round; `updated_within` must be more than 0.
  bool unrefined = false;
  /// Springs times time steps of the runs with derivatives: looked at after each iteration.
  double most_spring_steps = 1e18;
};

struct PooledFit {
  bool usable = false;
  bool converged = false;
  std::string message;
  std::map<std::string, double> shared;  ///< values of the parameters of the physics, by name
  std::vector<PooledPart> parts;         ///< where each recording ends
  double cost = 0;                       ///< half the sum of squares, or Huber's, with the priors
  int iterations = 0;
};

/// Several recordings of one cloth fitted together: the least of half the sum of squares of all
/// that they leave, with their priors, by Levenberg and Marquardt's method. Parameters of the
/// physics are shared (fit/refine/pooled_space.h). Recordings are simulated side by side; the bits
/// are the same for any number of threads. Throws InputError as PooledSpace does.
PooledFit fit_pooled(std::span<const FitProblem* const> problems, std::vector<PooledPart> start,
                     const PooledOptions& options, const ProgressCallback& progress);

/// The same from `start`, values by name; what it does not name starts where its problem has it.
PooledFit fit_pooled(std::span<const FitProblem* const> problems,
                     const std::map<std::string, double>& start, const PooledOptions& options,
                     const ProgressCallback& progress);

/// One recording's cost to second order where it was linearised, over its own space's parameters,
/// amplitudes of its directions eliminated. `threshold`: Huber's, infinite for plain squares.
Quadratic quadratic_of(const FitProblem& problem, const PooledPart& part, double threshold);

}  // namespace clothfit
