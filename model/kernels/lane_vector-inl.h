// Vectors of lanes for the kernels: included once for each instruction set.
#if defined(CLOTHFIT_MODEL_KERNELS_LANE_VECTOR_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CLOTHFIT_MODEL_KERNELS_LANE_VECTOR_INL_H_
#undef CLOTHFIT_MODEL_KERNELS_LANE_VECTOR_INL_H_
#else
#define CLOTHFIT_MODEL_KERNELS_LANE_VECTOR_INL_H_
#endif

#include <hwy/highway.h>

#include <array>
#include <cstddef>
#include <type_traits>

#include "model/kernels/lanes.h"

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// As many lanes of `L` as a vector of this instruction set holds.
template <class L>
using Tag = hn::CappedTag<typename L::Number, L::kCount>;

/// A number in each lane of a vector; Vector3: a vector in each.
template <class L>
using Vector = hn::Vec<Tag<L>>;

template <class V>
struct Vector3 {
  V x, y, z;
};

template <class D, class Number>
HWY_INLINE Vector3<hn::Vec<D>> load(D d, const std::array<Number*, 3>& from, std::ptrdiff_t at) {
  return {hn::LoadU(d, from[0] + at), hn::LoadU(d, from[1] + at), hn::LoadU(d, from[2] + at)};
}

template <class D>
HWY_INLINE void store(const Vector3<hn::Vec<D>>& v, D d, const std::array<hn::TFromD<D>*, 3>& to,
                      std::ptrdiff_t at) {
  hn::StoreU(v.x, d, to[0] + at);
  hn::StoreU(v.y, d, to[1] + at);
  hn::StoreU(v.z, d, to[2] + at);
}

template <class D>
HWY_INLINE Vector3<hn::Vec<D>> zero(D d) {
  return {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
}

template <class V>
HWY_INLINE Vector3<V> operator+(const Vector3<V>& a, const Vector3<V>& b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}

template <class V>
HWY_INLINE Vector3<V> operator-(const Vector3<V>& a, const Vector3<V>& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

template <class V>
HWY_INLINE Vector3<V> operator*(const V& a, const Vector3<V>& b) {
  return {hn::Mul(a, b.x), hn::Mul(a, b.y), hn::Mul(a, b.z)};
}

/// Says whether a product may be fused with a sum. It may in `float`, which is for speed. In
/// `double`, which is for exact results, a product is rounded first.
template <class V>
constexpr bool kMayContract = std::is_same_v<hn::TFromD<hn::DFromV<V>>, float>;

/// Returns a b + c.
template <class V>
HWY_INLINE V mul_add(const V& a, const V& b, const V& c) {
  if constexpr (kMayContract<V>)
    return hn::MulAdd(a, b, c);
  else
    return hn::Add(hn::Mul(a, b), c);
}

/// Returns c - a b.
template <class V>
HWY_INLINE V minus_product(const V& c, const V& a, const V& b) {
  if constexpr (kMayContract<V>)
    return hn::NegMulAdd(a, b, c);
  else
    return hn::Sub(c, hn::Mul(a, b));
}

/// Returns a b + c, the product rounded first: the same bits on every instruction set, in `float`
/// too. Derivatives are made of these, because where a fit ends depends on their last bits.
template <class V>
HWY_INLINE V rounded_mul_add(const V& a, const V& b, const V& c) {
  return hn::Add(hn::Mul(a, b), c);
}

template <class V>
HWY_INLINE Vector3<V> mul_add(const V& a, const Vector3<V>& b, const Vector3<V>& c) {
  return {mul_add(a, b.x, c.x), mul_add(a, b.y, c.y), mul_add(a, b.z, c.z)};
}

template <class V>
HWY_INLINE Vector3<V> minus_product(const Vector3<V>& c, const V& a, const Vector3<V>& b) {
  return {minus_product(c.x, a, b.x), minus_product(c.y, a, b.y), minus_product(c.z, a, b.z)};
}

/// Returns `a` where `mask` holds, else `b`.
template <class M, class V>
HWY_INLINE Vector3<V> select(const M& mask, const Vector3<V>& a, const Vector3<V>& b) {
  return {hn::IfThenElse(mask, a.x, b.x), hn::IfThenElse(mask, a.y, b.y),
          hn::IfThenElse(mask, a.z, b.z)};
}

template <class V>
HWY_INLINE V dot(const Vector3<V>& a, const Vector3<V>& b) {
  return mul_add(a.z, b.z, mul_add(a.y, b.y, hn::Mul(a.x, b.x)));
}

/// Returns 1 / sqrt(x) to 3e-16 for x from 1e-290 on; below that, its value there. A guess from the
/// bits of the exponent is followed by Newton's steps. IEEE 754 rounds all of these operations
/// correctly, so the bits are the same everywhere. None goes through the divider, which would take
/// longer than all the rest of a spring.
///
/// Several are computed at once, each step for all of them: the steps of one wait for each other.
template <class V, size_t n>
HWY_INLINE void inverse_square_roots(const V (&x)[n], V (&y)[n]) {
  const hn::DFromV<V> d;
  const hn::RebindToSigned<decltype(d)> bits;
  V half[n], square[n];
  for (size_t s = 0; s < n; ++s) {
    const V normal = hn::Max(x[s], hn::Set(d, 1e-290));
    half[s] = hn::Mul(hn::Set(d, 0.5), normal);
    y[s] = hn::BitCast(d, hn::Sub(hn::Set(bits, 0x5fe6eb50c7b537a9),  // off by at most 3.5 %
                                  hn::ShiftRight<1>(hn::BitCast(bits, normal))));
  }
  for (int step = 0; step < 4; ++step) {  // 2e-3, 5e-6, 4e-11, rounding
    for (size_t s = 0; s < n; ++s) square[s] = hn::Mul(y[s], y[s]);
    for (size_t s = 0; s < n; ++s) square[s] = hn::Mul(half[s], square[s]);
    for (size_t s = 0; s < n; ++s) square[s] = hn::Sub(hn::Set(d, 1.5), square[s]);
    for (size_t s = 0; s < n; ++s) y[s] = hn::Mul(y[s], square[s]);
  }
}

template <class V>
HWY_INLINE V inverse_square_root(const V& x) {
  const V xs[1] = {x};
  V ys[1];
  inverse_square_roots(xs, ys);
  return ys[0];
}

/// Returns 2 / sqrt(x) in `float` to 4e-7 for normal x > 0: the processor's estimate and a Newton
/// step.
template <class V, size_t n>
HWY_INLINE void twice_inverse_square_roots(const V (&x)[n], V (&y)[n]) {
  const hn::DFromV<V> d;
  V square[n];
  for (size_t s = 0; s < n; ++s) y[s] = hn::ApproximateReciprocalSqrt(x[s]);
  if constexpr (HWY_TARGET == HWY_SCALAR)  // no instruction: 2e-3
    for (size_t s = 0; s < n; ++s)
      y[s] = hn::Mul(y[s], hn::NegMulAdd(hn::Mul(hn::Set(d, 0.5f), x[s]), hn::Mul(y[s], y[s]),
                                         hn::Set(d, 1.5f)));
  for (size_t s = 0; s < n; ++s) square[s] = hn::Mul(x[s], y[s]);
  for (size_t s = 0; s < n; ++s) square[s] = hn::NegMulAdd(square[s], y[s], hn::Set(d, 3.0f));
  for (size_t s = 0; s < n; ++s) y[s] = hn::Mul(y[s], square[s]);
}

/// Returns |a|^2; in `float` at least 1e-30, so that it has an inverse square root.
template <class V>
HWY_INLINE V squared_length(const Vector3<V>& a) {
  if constexpr (kMayContract<V>)
    return mul_add(a.z, a.z,
                   mul_add(a.y, a.y, mul_add(a.x, a.x, hn::Set(hn::DFromV<V>(), 1e-30f))));
  else
    return dot(a, a);
}

/// Returns |a|^2 with fused operations where there are any, in `double` too: not the same bits
/// everywhere.
template <class V>
HWY_INLINE V fused_squared_length(const Vector3<V>& a) {
  if constexpr (kMayContract<V>)
    return squared_length(a);
  else
    return hn::MulAdd(a.z, a.z, hn::MulAdd(a.y, a.y, hn::Mul(a.x, a.x)));
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#endif
