// This file walks over the cloth's springs in lanes, in the order of cloth_sweep.cpp. It is
// included once for each instruction set.
#if defined(CLOTHFIT_MODEL_KERNELS_ROW_SWEEP_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CLOTHFIT_MODEL_KERNELS_ROW_SWEEP_INL_H_
#undef CLOTHFIT_MODEL_KERNELS_ROW_SWEEP_INL_H_
#else
#define CLOTHFIT_MODEL_KERNELS_ROW_SWEEP_INL_H_
#endif

#include <algorithm>

#include "model/kernels/lane_vector-inl.h"
#include "model/kernels/spring_reach.h"
#include "model/topology/mesh.h"

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

template <class V>
HWY_INLINE Vector3<V> force(const Vector3<V>& pull) {
  return pull;
}

/// Walks over the vertices in row-major order, for the lanes from `lane` on that fit into a vector.
/// `here_at(vertex, self)` reads the vertex whose element is `self`. `pull_to(type, vertex, here,
/// element)` is the pull of the spring of that type that leaves it for the vertex of `element`,
/// added to and subtracted from a Vector3. `sink(vertex, self, here, sum)` takes the sum over its
/// springs. The sink may move the vertex: no spring of a later one reaches back to it.
template <class L, class Here, class PullTo, class Sink>
HWY_INLINE void sweep_rows(const Mesh& mesh, std::ptrdiff_t lane, typename L::Number* scratch,
                           const Here& here_at, const PullTo& pull_to, const Sink& sink) {
  using Number = typename L::Number;
  using V = Vector<L>;
  using Pull = decltype(pull_to(size_t{}, std::ptrdiff_t{},
                                here_at(std::ptrdiff_t{}, std::ptrdiff_t{}), std::ptrdiff_t{}));
  const Tag<L> d;
  constexpr std::ptrdiff_t kLaneCount = L::kCount;
  const std::ptrdiff_t columns = mesh.columns, rows = mesh.rows;
  const std::ptrdiff_t width = columns * kLaneCount;
  const auto scratch_rows = [&](int n) HWY_ATTR {
    return std::array<Number*, 3>{scratch + n * width, scratch + (n + 1) * width,
                                  scratch + (n + 2) * width};
  };
  const std::array<Number*, 3> from_above = scratch_rows(0);
  const Pull none{};
  for (std::ptrdiff_t i = 0; i < rows; ++i) {
    const std::array<Number*, 3> from_two_above = scratch_rows(i % 2 == 0 ? 3 : 6);
    const bool one_below = i + 1 < rows, two_below = i + 2 < rows;
    // Pulls of the vertices just passed to the right, and below to the right.
    Pull right = none, right_two = none, right_two_next = none, down_right = none;
    Vector3<V> to_below = zero(d);  // sum so far for the vertex below the one just passed
    for (std::ptrdiff_t j = 0; j < columns; ++j) {
      const std::ptrdiff_t at = j * kLaneCount + lane, self = i * width + at;
      const std::ptrdiff_t vertex = i * columns + j;
      const auto here = here_at(vertex, self);
      Vector3<V> sum = zero(d) - (load(d, from_above, at) + load(d, from_two_above, at));
      sum = sum - right;
      sum = sum - right_two;
      right_two = right_two_next;
      if (j + 1 < columns) {
        right = pull_to(structural_s, vertex, here, self + kLaneCount);
        sum = sum + right;
      }
      if (j + 2 < columns) {
        right_two_next = pull_to(flexion_s, vertex, here, self + 2 * kLaneCount);
        sum = sum + right_two_next;
      }
      if (two_below) {
        const Pull down_two = pull_to(flexion_t, vertex, here, self + 2 * width);
        sum = sum + down_two;
        store(force(down_two), d, from_two_above, at);
      }
      if (one_below) {
        if (j > 0) {
          const Pull down_left = pull_to(shear_up, vertex, here, self + width - kLaneCount);
          sum = sum + down_left;
          store(to_below + down_left, d, from_above, at - kLaneCount);
        }
        const Pull down = pull_to(structural_t, vertex, here, self + width);
        sum = sum + down;
        to_below = force(down) + down_right;
        if (j + 1 < columns) {
          down_right = pull_to(shear_down, vertex, here, self + width + kLaneCount);
          sum = sum + down_right;
        } else {
          store(to_below, d, from_above, at);
        }
      }
      sink(vertex, self, here, sum);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#endif
