#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "model/kernels/lane_springs.h"
#include "model/kernels/spring_reach.h"

namespace clothfit {

/// Inputs and outputs of a sweep; element (vertex * kCount + lane) is one vertex in one lane.
template <class L>
struct SweepArrays {
  using Number = typename L::Number;
  Mesh mesh;
  const LaneSprings<L>& springs;
  const SpringFactors<L>* factors;  ///< or null
  std::array<const Number*, 3> position_m;
  std::array<const Number*, 3> velocity_m_per_s;
  Number* scratch;  ///< of scratch_size
  /// For a single lane: bit k of entry v is set where a spring leaves vertex v + k.
  const std::array<std::vector<std::uint8_t>, kSpringTypes>& leaving;
};

template <class L>
struct EulerArrays {
  using Number = typename L::Number;
  std::array<Number*, 3> position_m;
  std::array<Number*, 3> velocity_m_per_s;
  std::array<const Number*, 3> gravity_m_per_s2;  ///< per lane
  std::array<const Number*, 3> effect_force_n;    ///< or null
  const double* inverse_mass_per_kg;              ///< per vertex
  double time_step_s;
};

/// Vectors of forces that arrive from one row above, and twice those from two rows above: one for
/// the row at hand, one for the next. A vertex before the first takes what an absent spring sends
/// to the left.
constexpr int kScratchVectors = 3;

/// The vertices of one simulation in the longest vector.
constexpr std::ptrdiff_t kMostVertices = 8;

/// Returns a ring's length in one simulation: pulls still to arrive, and the vector behind.
inline std::ptrdiff_t ring_length(const Mesh& mesh, size_t type) {
  const std::ptrdiff_t needed = kSpringReach[type].offset(mesh) + 2 * kMostVertices;
  return (needed + kMostVertices - 1) / kMostVertices * kMostVertices;
}

inline std::ptrdiff_t single_scratch_size(const Mesh& mesh) {
  std::ptrdiff_t size = 0;
  for (size_t type = 0; type < kSpringTypes; ++type)
    size += 3 * (ring_length(mesh, type) + kMostVertices);
  return size;
}

template <class L>
std::ptrdiff_t scratch_size(const Mesh& mesh) {
  if (L::kCount == 1) return single_scratch_size(mesh);
  return std::ptrdiff_t{3} * kScratchVectors * (mesh.columns + 1) * L::kCount;
}

template <class L>
std::array<typename L::Number*, 3> scratch_rows(const SweepArrays<L>& arrays, int n) {
  const std::ptrdiff_t width = (arrays.mesh.columns + 1) * L::kCount;
  typename L::Number* const x = arrays.scratch + 3 * n * width + L::kCount;
  return {x, x + width, x + 2 * width};
}

}  // namespace clothfit
