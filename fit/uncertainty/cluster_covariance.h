#pragma once

#include <Eigen/Core>
#include <string>

#include "fit/uncertainty/linearised_fit.h"

namespace clothfit {

/// What is done about residuals being smaller than the errors they stand for, since the fit has
/// followed the errors; the fewer the blocks, the more so [cameron2015].
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
  /// Of each coordinate's variance, at least 1; infinite where priors alone make it.
  Eigen::VectorXd degrees_of_freedom;
  int blocks = 0;
};

/// Covariance of a least-squares fit whose residuals may depend on each other in any way within
/// blocks and not at all between them:
///
///   H^-1 (sum over blocks g_b g_b' + P) H^-1,   g_b = J_b' W_b A_b r_b,   H = J' W J + P
///
/// [huber1967, liang1986], with the correction's A_b. P counts as an own source of scatter: a
/// prior's mean has the covariance P^-1. Degrees of freedom are those of the chi-square law with
/// the estimate's mean and variance, were the residuals white (Satterthwaite's rule) [bell2002].
///
/// A coordinate without information (a column of zeros, as at a bound) takes no part. Not usable
/// where the others cannot be told apart. Throws InputError as sum_over_blocks() does.
ClusterCovariance cluster_covariance(
    const LinearisedFit& fit, const Eigen::VectorXi& block,
    ClusterCorrection correction = ClusterCorrection::bias_reduced);

/// Half the width of each coordinate's symmetric interval of `level` (0 < level < 1), from
/// Student's t with its degrees of freedom.
Eigen::VectorXd half_width(const ClusterCovariance& covariance, double level);

/// The quantile that half_width() multiplies a standard deviation with. `degrees_of_freedom` > 0 or
/// infinite.
double student_factor(double level, double degrees_of_freedom);

}  // namespace clothfit
