#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "model/kernels/lanes.h"
#include "model/topology/mesh.h"

namespace clothfit {

/// Says how springs are kept within their critical elongation after each time step.
enum class StrainLimitMode {
  off,
  positions,    ///< the founding paper's: one sweep over the springs, velocities untouched
  rates_first,  ///< the same, but the springs that are too long are found before any is moved
  consistent  ///< sweeps until no spring is longer than tolerated; velocities follow the positions
};

struct StrainLimit {
  StrainLimitMode mode = StrainLimitMode::off;
  double tolerance = 1e-3;  ///< `consistent`: largest remaining elongation beyond the critical one
  int most_sweeps = 100;    ///< `consistent`: of one time step
};

/// Lengths that springs may have, in every lane; infinite where there is no limit.
template <class L = ExactLanes>
struct LaneLimits {
  std::array<LaneValue<L>, kSpringTypes> longest_m;  ///< natural length times (1 + critical one)
  std::array<LaneValue<L>, kSpringTypes>
      tolerated_m;  ///< `consistent` sweeps until none exceeds this
};

/// Shares of a correction for the first and the second ends of a type's springs, by the vertex that
/// a spring leaves.
template <class Number>
struct SpringShares {
  std::vector<Number> first, second;
};

/// Springs of one type that share no vertex, by the vertices that they leave.
using SpringGroup = std::vector<std::int32_t>;

/// Two groups for each type, in the order in which a sweep takes them: type t has 2 t and 2 t + 1.
inline constexpr size_t kSpringGroups = 2 * kSpringTypes;

/// A set of vertices: bit v % 64 of word v / 64. It has a word more, so that one can read past the
/// last vertex.
using VertexSet = std::vector<std::uint64_t>;

/// The springs to visit in a single simulation, by the vertices that they leave.
struct SingleLimitSets {
  std::array<VertexSet, kSpringGroups> groups;
  std::array<VertexSet, kSpringTypes> too_long;  ///< at the first look
  VertexSet moved;                               ///< vertices that have moved since
};

/// One spring that a limit has shortened. Its ends have moved by shares of `excess` times `along`
/// towards each other.
struct LimitMove {
  int type = 0;
  int first = 0, second = 0;  ///< vertices
  double first_share = 0, second_share = 0;
  Eigen::Vector3d along_m;  ///< from the first to the second, before
  double excess = 0;        ///< 1 - longest / length
  double inverse_length_per_m = 0;
};

/// The findings of a limit, in every lane.
template <class L = ExactLanes>
struct LimitOutcome {
  LaneValue<L> too_long = LaneValue<L>::Zero();  ///< springs that the first sweep shortened
  LaneValue<L> unmet = LaneValue<L>::Zero();  ///< 1 where a spring is still longer than tolerated
};

}  // namespace clothfit
