#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/kernels/lane_limits.h"
#include "model/kernels/spring_reach.h"

namespace clothfit {

inline std::ptrdiff_t offset_of(const Mesh& mesh, size_t type) {
  return kSpringReach[type].offset(mesh);
}

/// Bytes from which a mask of lanes is read.
constexpr size_t kMaskBytes = 8;

enum class LimitPass {
  sweep,        ///< shortens springs that are too long as their turn comes
  rates_first,  ///< shortens springs that are too long at its beginning
  check         ///< only looks for springs that are longer than tolerated
};

/// Inputs and outputs of the passes over the springs. Element (vertex * kCount + lane) of each
/// array is one vertex in one lane.
template <class L>
struct LimitArrays {
  using Number = typename L::Number;
  Mesh mesh;
  const LaneLimits<L>& limits;
  const std::array<SpringShares<Number>, kSpringTypes>& shares;
  const std::array<SpringGroup, kSpringGroups>& groups;
  SpringGroup& found;                      ///< scratch for all springs
  std::vector<std::uint8_t>& found_lanes;  ///< scratch for kMaskBytes of each
  SingleLimitSets& single;                 ///< not used in lanes
  std::array<Number*, 3> position_m;
  std::array<Number*, 3> velocity_m_per_s;  ///< null: not corrected
  std::vector<LimitMove>* moves = nullptr;  ///< of a single lane, where they are asked for
  Number steps_per_s = 0;
  LaneValue<L> active = LaneValue<L>::Ones();     ///< 1 in lanes to work on, else 0
  LaneValue<L> shortened = LaneValue<L>::Zero();  ///< counts the springs that a sweep has shortened
  LaneValue<L> intolerable =
      LaneValue<L>::Zero();  ///< set to 1 where a spring is longer than tolerated
};

inline void insert(VertexSet& set, std::ptrdiff_t vertex) {
  set[static_cast<size_t>(vertex / 64)] |= std::uint64_t{1} << (vertex % 64);
}

/// Inserts the vertices `first` + k for every bit k of `bits`.
inline void insert(VertexSet& set, std::ptrdiff_t first, std::uint64_t bits) {
  const auto word = static_cast<size_t>(first / 64);
  const auto shift = static_cast<int>(first % 64);
  const std::uint64_t beyond = shift > 0 ? bits >> (64 - shift) : 0;
  if (bits << shift != 0) set[word] |= bits << shift;
  if (beyond != 0) set[word + 1] |= beyond;
}

/// Returns word `w` of the set of vertices v with v + offset in `set`.
inline std::uint64_t word_before(const VertexSet& set, size_t w, std::ptrdiff_t offset) {
  const size_t at = w + static_cast<size_t>(offset / 64);
  const auto shift = static_cast<int>(offset % 64);
  const auto word = [&](size_t n) { return n < set.size() ? set[n] : 0; };
  return shift == 0 ? word(at) : word(at) >> shift | word(at + 1) << (64 - shift);
}

}  // namespace clothfit
