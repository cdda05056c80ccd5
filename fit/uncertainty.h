#pragma once

#include "fit/refine.h"

namespace clothfit {

struct Uncertainty {
  bool usable = false;
  Eigen::VectorXd sigma;         ///< of each parameter, in its unit: all below together
  Eigen::VectorXd noise_sigma;   ///< from independent residuals
  Eigen::VectorXd robust_sigma;  ///< from residuals that are correlated in time
  Eigen::MatrixXd correlation;   ///< of the coordinates
  double chi_square_per_dof = 0;
  /// How far each parameter would move (in its unit) if the time step went to zero: the
  /// discretisation's share, part of sigma.
  Eigen::VectorXd step_shift;
  /// Per parameter: how many times larger the derivative over a hair's breadth is than that over
  /// two per cent. About 1 where the cost is a valley; far larger where it is a rough mountain
  /// side, as of folding cloth without enough damping, and a sigma from derivatives means nothing.
  Eigen::VectorXd roughness;
};

/// How sure the optimum is, from the Jacobian J there, Huber's weights W and the priors. Of two
/// estimates of the variance the larger counts, parameter by parameter:
///
///   (J' W J / max(1, chi-square per degree of freedom) + P)^-1: independent residuals, of the size
///     that is left rather than the stated one;
///   H^-1 (sum over markers g g') H^-1, g = J_m' W r_m, H = J' W J + P: the sandwich that lets each
///     marker's residuals be correlated in time in any way [huber1967, liang1986], as they are when
///     the model lacks something.
///
/// Neither sees what all markers share. One such thing can be measured: the time step. Residuals at
/// half the step differ by d; the scheme is of first order, so at step zero they would differ by 2
/// d, and the optimum by step_shift = -H^-1 J' W 2 d, which is added in square.
///
/// `residual_by_coordinate`: exact derivatives at `values` that are known already, or empty.
Uncertainty estimate_uncertainty(const TrajectoryObjective& objective,
                                 const Eigen::VectorXd& values, Loss loss = Loss::huber,
                                 const Eigen::MatrixXd& residual_by_coordinate = {});

}  // namespace clothfit
