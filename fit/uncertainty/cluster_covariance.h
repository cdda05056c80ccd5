#pragma once

#include <Eigen/Core>
#include <string>

#include "fit/uncertainty/linearised_fit.h"

namespace clothfit {

/// Corrections for residuals that are smaller than the errors they stand for. They are smaller
/// because the fit has followed the errors, the more so the fewer the blocks are [cameron2015].
enum class ClusterCorrection {
  none,          ///< CR0
  count,         ///< CR1: times blocks / (blocks - 1)
  bias_reduced,  ///< CR2: (I - J_b H^-1 J_b')^-1/2 r_b, unbiased for white residuals [bell2002]
  jackknife      ///< CR3: (I - J_b H^-1 J_b')^-1 r_b, as from leaving out each block in turn
};

struct ClusterCovariance {
  bool usable = false;
  std::string reason;          ///< why not
  Eigen::MatrixXd covariance;  ///< of the coordinates; infinite variance where nothing is known
  /// Degrees of freedom of each coordinate's variance, at least 1; infinite where priors alone make
  /// it.
  Eigen::VectorXd degrees_of_freedom;
  int blocks = 0;
};

/// Computes the covariance of a least-squares fit whose residuals depend on each other within
/// blocks. They may do so in any way there, and not at all between blocks. The covariance is
///
///   H^-1 (sum over blocks g_b g_b' + P) H^-1,   g_b = J_b' W_b A_b r_b,   H = J' W J + P
///
/// [huber1967, liang1986], with the correction's A_b. P counts as a source of scatter of its own,
/// for a prior's mean has the covariance P^-1. Degrees of freedom are those of the chi-square law
/// with the estimate's mean and variance, were the residuals white (Satterthwaite's rule)
/// [bell2002].
///
/// A coordinate without information (a column of zeros, as at a bound) takes no part. The
/// covariance is not usable where the others cannot be told apart. Throws InputError as
/// sum_over_blocks() does.
ClusterCovariance cluster_covariance(
    const LinearisedFit& fit, const Eigen::VectorXi& block,
    ClusterCorrection correction = ClusterCorrection::bias_reduced);

/// Returns half the width of each coordinate's symmetric interval of `level` (0 < level < 1). It
/// comes from Student's t with its degrees of freedom.
Eigen::VectorXd half_width(const ClusterCovariance& covariance, double level);

/// Returns the quantile that half_width() multiplies a standard deviation with.
/// `degrees_of_freedom` are > 0 or infinite.
double student_factor(double level, double degrees_of_freedom);

}  // namespace clothfit
