#pragma once

#include <Eigen/Core>

#include "fit/uncertainty/linearised_fit.h"

namespace clothfit {

/// The way in which a replicate differs from the recording.
enum class BlockWeights {
  /// Each block counts as often as it is drawn. As many are drawn with replacement as there are
  /// blocks [cameron2008].
  resampled,
  /// The residuals of a block are multiplied by one of six numbers of mean 0 and variance 1:
  /// +- sqrt(1/2), +- 1, +- sqrt(3/2), equally likely [webb2014]. The Jacobian stays. These are for
  /// few blocks, of which some drawings would leave out too many.
  wild
};

struct BootstrapOptions {
  BlockWeights weights = BlockWeights::wild;
  int replicates = 999;  ///< >= 19; the ends of a 90 % interval scatter by 5 % of it at 999
  unsigned long long seed = 1;

  bool valid() const;  ///< enough replicates
};

/// Returns the numbers of the blocks in one replicate. They depend on (seed, replicate) and the
/// number of blocks alone, so that no order of work changes them.
Eigen::VectorXd block_weights(const BootstrapOptions& options, int blocks, int replicate);

struct Bootstrap {
  /// Estimate of each replicate less that of the recording, coordinates x replicates. NaN where a
  /// replicate has no estimate.
  Eigen::MatrixXd change;
  /// The change divided by the replicate's own standard deviation.
  Eigen::MatrixXd studentised;
  Eigen::VectorXd
      sigma;       ///< of the recording, from its blocks (CR0), which `studentised` goes with
  int failed = 0;  ///< replicates without an estimate
};

/// Takes one Gauss-Newton step per replicate from the optimum at hand. `block` is as for
/// sum_over_blocks(). Throws InputError as that does.
Bootstrap bootstrap_linearised(const LinearisedFit& fit, const Eigen::VectorXi& block,
                               const BootstrapOptions& options);

/// Ends of an interval for each coordinate, as differences from the estimate.
struct ChangeIntervals {
  Eigen::VectorXd lower, upper;  ///< NaN where fewer than 19 replicates have an estimate
};

/// Takes the ends from quantiles of the change.
ChangeIntervals percentile_intervals(const Bootstrap& bootstrap, double level);

/// Takes the ends from quantiles of the studentised change. They are wider where few blocks make
/// sigma itself uncertain.
ChangeIntervals studentised_intervals(const Bootstrap& bootstrap, double level);

}  // namespace clothfit
