#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "model/kernels/lane_limits.h"
#include "model/kernels/lanes.h"
#include "model/topology/mesh.h"

namespace clothfit {

template <class L>
struct LimitArrays;

/// Sets springs that are longer than `longest_m` to exactly that by moving their two ends along
/// them [louchet1995, section 2.4; provot1995]. The shares are in proportion to the inverse masses:
/// equal ends move half each and a held one not at all. A spring held at both ends is left out.
/// Momentum is kept between free ends.
///
/// A sweep takes the springs one after the other, each as those before have left it, in an order
/// that is part of the model: types 0 to 5; of types 0, 2 and 3 first the springs that start in
/// even rows, then those in odd rows; of type 1 the same with columns; of types 4 and 5 first rows
/// (columns) 0, 1, 4, 5, 8, ..., then the others. The springs of one such group share no vertex, so
/// their order among themselves does not matter.
///
/// In lanes each spring is measured once, as its group's turn comes or before. In a single
/// simulation most springs are within their limits at most times. There one look finds those that
/// are not; the sweeps then visit these and the springs of vertices that have moved since.
///
/// In `double` the arithmetic is strict IEEE, with the same bits on every instruction set. A lane's
/// result does not depend on the others. Holds scratch memory: one object per thread.
template <class L = ExactLanes>
class StrainLimiter {
 public:
  /// `inverse_mass_per_kg` is 0 where a vertex must not move.
  StrainLimiter(const Mesh& mesh, const Eigen::VectorXd& inverse_mass_per_kg);

  /// Limits as `how` says. Here and below a single simulation may ask for its moves, in the order
  /// in which they were made.
  LimitOutcome<L> limit(const StrainLimit& how, const LaneLimits<L>& limits, double time_step_s,
                        LaneVectors<L>& position_m, LaneVectors<L>& velocity_m_per_s,
                        std::vector<LimitMove>* moves = nullptr);

  /// Sweeps once over positions alone; `unmet` is not looked at.
  LimitOutcome<L> limit_positions(const LaneLimits<L>& limits, LaneVectors<L>& position_m,
                                  std::vector<LimitMove>* moves = nullptr);

  /// Sweeps once over the springs that are too long before any is moved. They are set to
  /// `longest_m`, in the same order, even where others have shortened them meanwhile.
  LimitOutcome<L> limit_by_first_rates(const LaneLimits<L>& limits, LaneVectors<L>& position_m,
                                       std::vector<LimitMove>* moves = nullptr);

  /// Sweeps until no spring of a lane is longer than tolerated, at most `most_sweeps` times. A
  /// vertex's shift, over the time step, is added to its velocity. Held points that are further
  /// apart than the springs between them may reach leave the limit unmet; a spring that is held at
  /// both ends is not looked at.
  LimitOutcome<L> limit_consistently(const LaneLimits<L>& limits, int most_sweeps,
                                     double time_step_s, LaneVectors<L>& position_m,
                                     LaneVectors<L>& velocity_m_per_s,
                                     std::vector<LimitMove>* moves = nullptr);

 private:
  LimitArrays<L> arrays(const LaneLimits<L>& limits, LaneVectors<L>& position_m,
                        std::vector<LimitMove>* moves);

  Mesh mesh_;
  std::array<SpringShares<typename L::Number>, kSpringTypes> shares_;
  std::array<SpringGroup, kSpringGroups> groups_;  ///< without springs held at both ends
  SpringGroup found_;                              ///< scratch: those to shorten
  std::vector<std::uint8_t> found_lanes_;          ///< scratch: in which lanes, kMaskBytes each
  SingleLimitSets single_;                         ///< empty in lanes
};

}  // namespace clothfit
