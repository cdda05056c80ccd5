#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "model/lanes.h"
#include "model/mesh.h"

namespace clothfit {

/// How springs are kept from stretching beyond their critical elongation after each time step.
enum class StrainLimitMode {
  off,
  positions,    ///< the founding paper's: one sweep over the springs, velocities untouched
  rates_first,  ///< the same, but which springs are too long is found out before any is moved
  consistent  ///< sweeps until no spring is longer than tolerated; velocities follow the positions
};

struct StrainLimit {
  StrainLimitMode mode = StrainLimitMode::off;
  double tolerance = 1e-3;  ///< `consistent`: elongation beyond the critical one that may remain
  int most_sweeps = 100;    ///< `consistent`: of one time step
};

/// Lengths that springs may have, in every lane; infinite where there is no limit.
template <class L = ExactLanes>
struct LaneLimits {
  std::array<LaneValue<L>, kSpringTypes> longest_m;  ///< natural length times (1 + critical one)
  std::array<LaneValue<L>, kSpringTypes>
      tolerated_m;  ///< `consistent` sweeps until none exceeds this
};

/// Shares of a correction that the first and the second ends of a type's springs take, by the
/// vertex that a spring leaves.
template <class Number>
struct SpringShares {
  std::vector<Number> first, second;
};

/// Springs of one type that share no vertex, by the vertices that they leave.
using SpringGroup = std::vector<std::int32_t>;

/// Two of each type, in the order in which a sweep takes them: type t has 2 t and 2 t + 1.
inline constexpr size_t kSpringGroups = 2 * kSpringTypes;

/// A set of vertices: bit v % 64 of word v / 64. A word more than that, so that one can read past
/// the last vertex.
using VertexSet = std::vector<std::uint64_t>;

/// Which springs to visit, for a single simulation: the vertices that they leave.
struct SingleLimitSets {
  std::array<VertexSet, kSpringGroups> groups;
  std::array<VertexSet, kSpringTypes> too_long;  ///< at the first look
  VertexSet moved;                               ///< vertices that have moved since
};

/// One spring that a limit has shortened: its ends have moved by shares of `excess` times `along`
/// towards each other.
struct LimitMove {
  int type = 0;
  int first = 0, second = 0;  ///< vertices
  double first_share = 0, second_share = 0;
  Eigen::Vector3d along_m;  ///< from the first to the second, before
  double excess = 0;        ///< 1 - longest / length
  double inverse_length_per_m = 0;
};

/// What a limit found, in every lane.
template <class L = ExactLanes>
struct LimitOutcome {
  LaneValue<L> too_long = LaneValue<L>::Zero();  ///< springs that the first sweep shortened
  LaneValue<L> unmet = LaneValue<L>::Zero();  ///< 1 where a spring is still longer than tolerated
};

template <class L>
struct LimitArrays;

/// Sets springs that are longer than `longest_m` to exactly that by moving their two ends along
/// them [louchet1995, section 2.4; provot1995], by shares in proportion to the inverse masses, so
/// that equal ends move half each and a held one not at all; a spring held at both ends is left
/// out. Momentum is kept between free ends.
///
/// A sweep takes the springs one after the other, each as those before have left it, in an order
/// that is part of the model: types 0 to 5; of types 0, 2 and 3 first the springs that start in
/// even rows, then those in odd rows; of type 1 the same with columns; of types 4 and 5 first rows
/// (columns) 0, 1, 4, 5, 8, ..., then the others. The springs of one such group share no vertex, so
/// their order among themselves does not matter.
///
/// In lanes each spring is measured once, as its group's turn comes or before. For a single
/// simulation, most of whose springs are within their limits at most times, one look finds those
/// that are not, and the sweeps then visit these and what hangs on a vertex that has moved since.
///
/// In `double` strict IEEE, the same bits on every instruction set. A lane's result does not depend
/// on what the others carry. Holds scratch memory: one object per thread.
template <class L = ExactLanes>
class StrainLimiter {
 public:
  /// `inverse_mass_per_kg` is 0 where a vertex must not move.
  StrainLimiter(const Mesh& mesh, const Eigen::VectorXd& inverse_mass_per_kg);

  /// Limits as `how` says. A single simulation may ask for its moves, in the order in which they
  /// were made, here and below.
  LimitOutcome<L> limit(const StrainLimit& how, const LaneLimits<L>& limits, double time_step_s,
                        LaneVectors<L>& position_m, LaneVectors<L>& velocity_m_per_s,
                        std::vector<LimitMove>* moves = nullptr);

  /// One sweep over positions alone; `unmet` is not looked at.
  LimitOutcome<L> limit_positions(const LaneLimits<L>& limits, LaneVectors<L>& position_m,
                                  std::vector<LimitMove>* moves = nullptr);

  /// The same, but the springs that are too long before any is moved are those that are set to
  /// `longest_m`, in the same order, even where others have shortened them meanwhile.
  LimitOutcome<L> limit_by_first_rates(const LaneLimits<L>& limits, LaneVectors<L>& position_m,
                                       std::vector<LimitMove>* moves = nullptr);

  /// Sweeps until no spring of a lane is longer than tolerated, at most `most_sweeps` times; what a
  /// vertex is moved by, over the time step, is added to its velocity. Held points that are further
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
