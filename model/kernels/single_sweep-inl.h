// This file walks over the springs of one simulation. It is included once for each instruction set.
#if defined(CLOTHFIT_MODEL_KERNELS_SINGLE_SWEEP_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CLOTHFIT_MODEL_KERNELS_SINGLE_SWEEP_INL_H_
#undef CLOTHFIT_MODEL_KERNELS_SINGLE_SWEEP_INL_H_
#else
#define CLOTHFIT_MODEL_KERNELS_SINGLE_SWEEP_INL_H_
#endif

#include <algorithm>

#include "model/kernels/spring_pull-inl.h"
#include "model/kernels/sweep_arrays.h"

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

/// The pulls of a type's springs in a ring, kept until the vertices that they end at are reached. A
/// vector that begins near the end of the ring goes on behind it, where the ring's beginning is
/// written a second time.
struct PullRing {
  std::array<double*, 3> pulls;
  std::ptrdiff_t length;
  std::ptrdiff_t offset;  ///< of the springs
  std::ptrdiff_t next;    ///< place of the vertices whose pulls come next

  std::ptrdiff_t before(std::ptrdiff_t place, std::ptrdiff_t distance) const {
    return place < distance ? place - distance + length : place - distance;
  }
};

/// Sweeps as `sweep` for lanes does, but the numbers of a vector are neighbouring vertices of the
/// one simulation. A spring that would cross an edge of the cloth pulls with zero; sums run in the
/// same order. Vertices are moved one vector behind the springs, so that all pulls on them are
/// written by then.
template <bool kFactors, class Sink>
HWY_INLINE void sweep_single(const SweepArrays<SingleLane>& arrays, const Sink& sink) {
  const Tag<ExactLanes> d;
  using V = hn::Vec<Tag<ExactLanes>>;
  constexpr size_t kCount = kSpringTypes;
  const auto size = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  const std::ptrdiff_t vertices = arrays.mesh.vertex_count();
  const std::array<const double*, 3> positions = arrays.position_m;
  const std::array<const double*, 3> velocities = arrays.velocity_m_per_s;

  std::fill_n(arrays.scratch, single_scratch_size(arrays.mesh), 0.0);
  SpringConstants<V> springs[kCount];
  PullRing rings[kCount];
  const std::uint8_t* leaving[kCount];
  double* scratch = arrays.scratch;
  for (size_t s = 0; s < kCount; ++s) {
    const auto type = static_cast<size_t>(kLeaving[s]);
    springs[s] = spring_constants(hn::Set(d, arrays.springs.stiffness_n_per_m[type][0]),
                                  hn::Set(d, arrays.springs.damping_ns_per_m[type][0]),
                                  hn::Set(d, arrays.springs.natural_length_m[type][0]));
    const std::ptrdiff_t length = ring_length(arrays.mesh, type);
    const std::ptrdiff_t row = length + kMostVertices;
    rings[s] = {{scratch, scratch + row, scratch + 2 * row},
                length,
                kSpringReach[type].offset(arrays.mesh),
                0};
    scratch += 3 * row;
    leaving[s] = arrays.leaving[type].data();
  }

  for (std::ptrdiff_t ahead = 0; ahead < vertices + size; ahead += size) {
    if (ahead < vertices) {
      const Vector3<V> position = load(d, positions, ahead), velocity = load(d, velocities, ahead);
      Pull<V> pulls[kCount];
      Vector3<V> rate[kCount];
      for (size_t s = 0; s < kCount; ++s) {
        const std::ptrdiff_t other = ahead + rings[s].offset;
        const std::ptrdiff_t at = other < vertices ? other : ahead;  // at the end there is none
        pulls[s].along = load(d, positions, at) - position;
        rate[s] = load(d, velocities, at) - velocity;
      }
      if constexpr (kFactors) {
        SpringConstants<V> scaled[kCount];
        for (size_t s = 0; s < kCount; ++s) {
          const auto of_springs = [&](const auto& factors) HWY_ATTR {
            return hn::LoadU(d, factors[static_cast<size_t>(kLeaving[s])].data() + ahead);
          };
          scaled[s] = spring_constants(
              hn::Mul(springs[s].stiffness, of_springs(arrays.factors->stiffness)),
              springs[s].damping,
              hn::Mul(springs[s].natural_length, of_springs(arrays.factors->natural_length)));
        }
        set_strengths(scaled, rate, pulls);
      } else {
        set_strengths(springs, rate, pulls);
      }
      for (size_t s = 0; s < kCount; ++s) {
        PullRing& ring = rings[s];
        // Nothing is kept where no spring leaves, whatever stands beyond the last vertex.
        const auto leaves = hn::LoadMaskBits(d, leaving[s] + ahead);
        const Vector3<V> all = force(pulls[s]);
        const Vector3<V> pulled{hn::IfThenElseZero(leaves, all.x),
                                hn::IfThenElseZero(leaves, all.y),
                                hn::IfThenElseZero(leaves, all.z)};
        store(pulled, d, ring.pulls, ring.next);
        if (ring.next < kMostVertices) store(pulled, d, ring.pulls, ring.next + ring.length);
      }
    }
    if (ahead >= size) {
      const std::ptrdiff_t vertex = ahead - size;
      std::ptrdiff_t own[kCount];
      for (size_t s = 0; s < kCount; ++s) own[s] = rings[s].before(rings[s].next, size);
      const auto arrives = [&](size_t s) HWY_ATTR {
        return load(d, rings[s].pulls, rings[s].before(own[s], rings[s].offset));
      };
      constexpr size_t kRight = 0, kTwoRight = 1, kTwoDown = 2, kDownLeft = 3, kDown = 4,
                       kDownRight = 5;  // places in kLeaving
      const Vector3<V> above = (arrives(kDown) + arrives(kDownRight)) + arrives(kDownLeft);
      Vector3<V> sum = zero(d) - (above + arrives(kTwoDown));
      sum = sum - arrives(kRight);
      sum = sum - arrives(kTwoRight);
      for (size_t s = 0; s < kCount; ++s) sum = sum + load(d, rings[s].pulls, own[s]);
      sink(d, vertex, vertex, sum, load(d, velocities, vertex), load(d, positions, vertex));
    }
    for (PullRing& ring : rings) {
      ring.next += size;
      if (ring.next == ring.length) ring.next = 0;
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#endif
