#pragma once

#include <string>

#include "fit/refine/refine.h"
#include "fit/uncertainty/space_time_blocks.h"

namespace clothfit {

/// The level of the intervals that a fit states.
inline constexpr double kIntervalLevel = 0.9;

struct UncertaintyOptions {
  Loss loss = Loss::huber;
  int bootstrap = 0;  ///< replicates, 0 or at least 19
  unsigned long long seed = 1;
};

struct Uncertainty {
  bool usable = false;
  Eigen::VectorXd sigma;        ///< of each parameter, in its unit: all below together
  Eigen::VectorXd noise_sigma;  ///< from independent residuals
  Eigen::VectorXd
      robust_sigma;  ///< from residuals that depend on each other within blocks; 0: none
  /// Degrees of freedom of the robust sigma's square, for Student's t. Few blocks leave that square
  /// uncertain itself.
  Eigen::VectorXd degrees_of_freedom;
  BlockCounts block_counts;
  int blocks = 0;             ///< 0: there is no robust estimate,
  std::string why_no_blocks;  ///< for this reason
  /// The interval of kIntervalLevel of each parameter, symmetric in its coordinate, within its
  /// range. It is the wider of the normal one of independent residuals and Student's of the blocks.
  /// The time step's share is added in square.
  Eigen::VectorXd lower, upper;
  Eigen::VectorXd half_width;       ///< of it in coordinates, before the range cuts it
  Eigen::MatrixXd inverse_hessian;  ///< of the cost by coordinates, (J' W J + P)^-1
  /// Studentised intervals of a bootstrap over the blocks (fit/uncertainty/block_bootstrap.h),
  /// within the ranges. Empty unless asked for, and without blocks.
  Eigen::VectorXd bootstrap_lower, bootstrap_upper;
  Eigen::MatrixXd correlation;  ///< of the coordinates
  double chi_square_per_dof = 0;
  /// The distance that each parameter would move (in its unit) if the time step went to zero. It is
  /// the discretisation's share, part of sigma.
  Eigen::VectorXd step_shift;
  /// The distance that each parameter would move (in its unit) if those at an end of their range
  /// could leave it, as the residuals ask for; 0 where none does. It is part of sigma.
  Eigen::VectorXd bound_shift;
  int bound_by = -1;  ///< the parameter at its end that moves the others most
  /// Tells how much steeper derivatives are over a hair's breadth than over two per cent. It is
  /// about 1 where the cost is a smooth basin. It is far larger where the cost is rough, as of
  /// folding cloth without enough damping, and a sigma from derivatives means nothing.
  Eigen::VectorXd roughness;
};

/// Estimates how sure the optimum is, from the Jacobian J there, Huber's weights W and the priors
/// P. Of two estimates of the variance the larger counts, parameter by parameter:
///
///   (J' W J / max(1, chi-square per degree of freedom) + P)^-1: independent residuals, of the
///     size that they have rather than the stated one;
///   the sandwich over blocks of the cloth (fit/uncertainty/cluster_covariance.h, `bias_reduced`;
///     the blocks by fit/uncertainty/observed_blocks.h), within which residuals may depend on each
///     other in any way, as they do when the model lacks something.
///
/// The sandwich takes the residuals after one Gauss-Newton step. What the optimisation left, or a
/// bound, pulls at all blocks alike and is no scatter. There is no sandwich where observations lie
/// in fewer than two blocks, or coordinates cannot be told apart. The first estimate stands alone
/// then.
///
/// A bound that binds moves the others too: by H^-1 times the gradient that it holds up. This is
/// added in square.
///
/// Neither sees what all markers share. One such thing can be measured: the time step. Residuals at
/// half the step differ by d. The scheme is of first order, so at step zero they would differ by 2
/// d, and the optimum by step_shift = -H^-1 J' W 2 d, H = J' W J + P. This is added in square.
///
/// `residual_by_coordinate` are exact derivatives at `values` that are known already, or empty.
Uncertainty estimate_uncertainty(const TrajectoryObjective& objective,
                                 const Eigen::VectorXd& values,
                                 const UncertaintyOptions& options = {},
                                 Eigen::MatrixXd residual_by_coordinate = {});

/// A derivative this many times steeper than the trend over two per cent says nothing of it.
inline constexpr double kRoughSlope = 3;

/// Derivatives, held against differences over two per cent.
struct Trend {
  Eigen::VectorXd roughness;  ///< see Uncertainty; 1 for what is no physics, which makes no folds
  Eigen::MatrixXd residual_by_coordinate;  ///< the differences where it is above kRoughSlope
};

/// Takes two runs for each parameter of the physics. `residual_by_coordinate` are derivatives at
/// `values`.
Trend trend_of(const Objective& objective, const Eigen::VectorXd& values,
               const Eigen::MatrixXd& residual_by_coordinate);

}  // namespace clothfit
