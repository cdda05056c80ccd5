#pragma once

#include <Eigen/Core>

namespace clothfit {

/// Places on the cloth and times at which residuals were observed: one entry per residual in each.
struct ObservationPlaces {
  Eigen::VectorXd s_m, t_m;   ///< material place of the marker
  Eigen::VectorXd time_s;     ///< of the frame
  Eigen::VectorXi component;  ///< which coordinate of its observation a residual is, 0 ... 2

  /// Says whether there is a finite place for each of at least one residual.
  bool valid() const;
};

/// Numbers of parts of equal length into which each direction is cut.
struct BlockCounts {
  int along_s = 1, along_t = 1;  ///< >= 1
  int in_time = 1;               ///< >= 1
  bool valid() const { return along_s >= 1 && along_t >= 1 && in_time >= 1; }
};

/// A partition of residuals into blocks that are cuboids over the cloth and time.
struct SpaceTimeBlocks {
  Eigen::VectorXi block;  ///< of each residual, 0 ... count - 1
  int count = 0;          ///< blocks with at least one residual; empty ones have no index
};

/// Cuts what the places span, from the least to the largest in each direction. Counts and
/// places must be valid.
SpaceTimeBlocks space_time_blocks(const ObservationPlaces& places, const BlockCounts& counts);

/// The distance, in each direction, from which on two residuals tell nothing of each other. It is
/// at most the whole extent.
struct CorrelationRanges {
  double s_m = 0, t_m = 0, time_s = 0;
};

/// Finds the shortest separation at which residuals are not correlated along a direction, the
/// others held. There their autocorrelation is not above zero by more than two of its standard
/// errors, were the residuals white. It is taken from means over cells, 8 along the cloth each way
/// and 32 in time. White residuals give the length of a cell, whatever their size. That a robust
/// covariance must span the covariogram's range is the rule of [lehner2026].
CorrelationRanges correlation_ranges(const ObservationPlaces& places,
                                     const Eigen::VectorXd& residual);

/// Limits of blocks for a robust covariance. Along the cloth there are as many as their range goes
/// into its extent, from `least` to `most` each way.
///
/// In time the default is one block. A range that is short in time does not allow shorter blocks. A
/// swinging cloth's residuals and its derivatives swing alike. So their product, of which the
/// covariance is made, keeps its sign for longer than either. This was tried on a second of a
/// swinging cloth with residuals of a range of 0.3 s. Intervals for its shear stiffness covered at
/// 65 to 67 % with blocks of a third of a second, at 78 to 86 % with one block in time
/// (docs/theory/identification.md).
///
/// Fewer than four blocks leave about one degree of freedom, so intervals become several times as
/// wide as needed. More than nine are shorter than the residuals of a wrong model reach.
struct BlockLimits {
  BlockCounts least{.along_s = 2, .along_t = 2, .in_time = 1};
  BlockCounts most{.along_s = 3, .along_t = 3, .in_time = 1};
};
BlockCounts choose_block_counts(const ObservationPlaces& places, const Eigen::VectorXd& residual,
                                const BlockLimits& limits = {});

}  // namespace clothfit
