// This file limits the strain of one simulation. It is included once for each instruction set.
#if defined(CLOTHFIT_MODEL_KERNELS_SINGLE_LIMIT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CLOTHFIT_MODEL_KERNELS_SINGLE_LIMIT_INL_H_
#undef CLOTHFIT_MODEL_KERNELS_SINGLE_LIMIT_INL_H_
#else
#define CLOTHFIT_MODEL_KERNELS_SINGLE_LIMIT_INL_H_
#endif

#include <algorithm>
#include <bit>

#include "model/kernels/lane_vector-inl.h"
#include "model/kernels/limit_arrays.h"

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

/// The numbers of a vector are neighbouring vertices.
using Neighbours = Tag<ExactLanes>;

HWY_INLINE std::uint64_t bits_of(const hn::Mask<Neighbours>& mask) {
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(Neighbours(), mask, bits);
  return bits[0];
}

/// Forgets the vertices that have moved and finds the springs that are too long.
HWY_INLINE void look_along(LimitArrays<SingleLane>& arrays) {
  const Neighbours d;
  const auto size = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  const std::array<const double*, 3> position = {arrays.position_m[0], arrays.position_m[1],
                                                 arrays.position_m[2]};
  std::ranges::fill(arrays.single.moved, 0);
  for (VertexSet& set : arrays.single.too_long) std::ranges::fill(set, 0);
  for (size_t type = 0; type < kSpringTypes; ++type) {
    const std::ptrdiff_t offset = offset_of(arrays.mesh, type);
    const double longest = arrays.limits.longest_m[type][0];
    const auto allowed2 = hn::Set(d, longest * longest);
    for (std::ptrdiff_t at = 0; at + offset < arrays.mesh.vertex_count(); at += size) {
      const auto along = load(d, position, at + offset) - load(d, position, at);
      arrays.single.too_long[type][static_cast<size_t>(at / 64)] |=
          bits_of(hn::Gt(dot(along, along), allowed2)) << (at % 64);
    }
  }
}

template <class V>
HWY_INLINE void store_where(const hn::Mask<Neighbours>& mask, const Vector3<V>& v, Neighbours d,
                            const std::array<double*, 3>& to, std::ptrdiff_t at) {
  hn::BlendedStore(v.x, mask, d, to[0] + at);
  hn::BlendedStore(v.y, mask, d, to[1] + at);
  hn::BlendedStore(v.z, mask, d, to[2] + at);
}

template <class V>
void note_moves(LimitArrays<SingleLane>& arrays, size_t type, std::ptrdiff_t at,
                std::uint64_t found, const Vector3<V>& along, const V& excess, const V& inverse) {
  const Neighbours d;
  double x[8], y[8], z[8], excesses[8], inverses[8];
  hn::StoreU(along.x, d, x);
  hn::StoreU(along.y, d, y);
  hn::StoreU(along.z, d, z);
  hn::StoreU(excess, d, excesses);
  hn::StoreU(inverse, d, inverses);
  for (; found != 0; found &= found - 1) {
    const int k = std::countr_zero(found);
    const auto vertex = static_cast<size_t>(at + k);
    arrays.moves->push_back({.type = static_cast<int>(type),
                             .first = static_cast<int>(vertex),
                             .second = static_cast<int>(at + k + offset_of(arrays.mesh, type)),
                             .first_share = arrays.shares[type].first[vertex],
                             .second_share = arrays.shares[type].second[vertex],
                             .along_m = {x[k], y[k], z[k]},
                             .excess = excesses[k],
                             .inverse_length_per_m = inverses[k]});
  }
}

template <LimitPass pass>
HWY_INLINE void visit_along(LimitArrays<SingleLane>& arrays, size_t type) {
  const Neighbours d;
  using V = hn::Vec<Neighbours>;
  constexpr size_t kWordBits = 64;
  const auto size = static_cast<int>(hn::Lanes(d));
  const std::ptrdiff_t offset = offset_of(arrays.mesh, type);
  const std::array<double*, 3> position = arrays.position_m, velocity = arrays.velocity_m_per_s;
  const double allowed_m =
      (pass == LimitPass::check ? arrays.limits.tolerated_m : arrays.limits.longest_m)[type][0];
  const V allowed2 = hn::Set(d, allowed_m * allowed_m);
  const V longest = hn::Set(d, arrays.limits.longest_m[type][0]);
  const V one = hn::Set(d, 1.0), steps_per_s = hn::Set(d, arrays.steps_per_s);
  if (!(arrays.active[0] > 0)) return;

  for (const size_t g : {2 * type, 2 * type + 1}) {
    const VertexSet& group = arrays.single.groups[g];
    for (size_t w = 0; w + 1 < group.size(); ++w) {
      std::uint64_t left = arrays.single.too_long[type][w];
      if (pass != LimitPass::rates_first)
        left |= arrays.single.moved[w] | word_before(arrays.single.moved, w, offset);
      left &= group[w];
      while (left != 0) {
        const int shift = std::countr_zero(left) / size * size;
        const std::uint8_t wanted = static_cast<std::uint8_t>((left >> shift) & ((1u << size) - 1));
        const std::uint8_t wanted_bits[8] = {wanted};  // as many as a mask may load
        left &= ~(std::uint64_t{wanted} << shift);
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(w * kWordBits) + shift;
        const Vector3<V> a = load(d, position, at), b = load(d, position, at + offset);
        const Vector3<V> along = b - a;
        const V length2 = dot(along, along);
        auto exceeds = hn::LoadMaskBits(d, wanted_bits);
        if constexpr (pass != LimitPass::rates_first)
          exceeds = hn::And(exceeds, hn::Gt(length2, allowed2));
        const std::uint64_t found = bits_of(exceeds);
        if (found == 0) continue;
        if constexpr (pass == LimitPass::check) {
          arrays.intolerable[0] = 1;
          return;
        }
        arrays.shortened[0] += std::popcount(found);
        insert(arrays.single.moved, at, found);
        insert(arrays.single.moved, at + offset, found);
        const V inverse = inverse_square_root(length2);
        const V excess = minus_product(one, longest, inverse);
        const V first_share = hn::LoadU(d, arrays.shares[type].first.data() + at);
        const V second_share = hn::LoadU(d, arrays.shares[type].second.data() + at);
        if (arrays.moves != nullptr) note_moves(arrays, type, at, found, along, excess, inverse);
        const auto move = [&](const std::array<double*, 3>& of, const Vector3<V>& from,
                              const Vector3<V>& to, const V& share) HWY_ATTR {
          // Neither end of a spring is among the other ends, so the second store stands.
          store_where(exceeds, mul_add(hn::Mul(share, first_share), along, from), d, of, at);
          store_where(exceeds, minus_product(to, hn::Mul(share, second_share), along), d, of,
                      at + offset);
        };
        move(position, a, b, excess);
        if (velocity[0] != nullptr)
          move(velocity, load(d, velocity, at), load(d, velocity, at + offset),
               hn::Mul(steps_per_s, excess));
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#endif
