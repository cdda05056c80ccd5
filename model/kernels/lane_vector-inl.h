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

#include "model/lanes.h"

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::CappedTag<double, kLanes>;
using Vector = hn::Vec<Tag>;

struct Vector3 {
  Vector x, y, z;
};

template <class Number>
HWY_INLINE Vector3 load(const std::array<Number*, 3>& from, std::ptrdiff_t at) {
  const Tag d;
  return {hn::LoadU(d, from[0] + at), hn::LoadU(d, from[1] + at), hn::LoadU(d, from[2] + at)};
}

HWY_INLINE void store(const Vector3& v, const std::array<double*, 3>& to, std::ptrdiff_t at) {
  const Tag d;
  hn::StoreU(v.x, d, to[0] + at);
  hn::StoreU(v.y, d, to[1] + at);
  hn::StoreU(v.z, d, to[2] + at);
}

HWY_INLINE Vector3 zero() {
  const Vector none = hn::Zero(Tag());
  return {none, none, none};
}

HWY_INLINE Vector3 operator+(const Vector3& a, const Vector3& b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}

HWY_INLINE Vector3 operator-(const Vector3& a, const Vector3& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

HWY_INLINE Vector3 operator*(const Vector& a, const Vector3& b) {
  return {hn::Mul(a, b.x), hn::Mul(a, b.y), hn::Mul(a, b.z)};
}

/// `a` where `mask` holds, else `b`.
HWY_INLINE Vector3 select(const hn::Mask<Tag>& mask, const Vector3& a, const Vector3& b) {
  return {hn::IfThenElse(mask, a.x, b.x), hn::IfThenElse(mask, a.y, b.y),
          hn::IfThenElse(mask, a.z, b.z)};
}

HWY_INLINE Vector dot(const Vector3& a, const Vector3& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}

/// 1 / sqrt(x) to 3e-16 for x from 1e-290 on; below that, its value there. A guess from the bits of
/// the exponent, then Newton's steps: only operations that IEEE 754 rounds correctly, so that the
/// bits are the same everywhere, and none that go through the divider, which would take longer than
/// all the rest of a spring.
HWY_INLINE Vector inverse_square_root(Vector x) {
  const Tag d;
  const hn::RebindToSigned<Tag> bits;
  x = hn::Max(x, hn::Set(d, 1e-290));
  const Vector half = hn::Mul(hn::Set(d, 0.5), x);
  Vector y = hn::BitCast(d, hn::Sub(hn::Set(bits, 0x5fe6eb50c7b537a9),  // off by at most 3.5 %
                                    hn::ShiftRight<1>(hn::BitCast(bits, x))));
  for (int n = 0; n < 4; ++n)  // 2e-3, 5e-6, 4e-11, rounding
    y = hn::Mul(y, hn::Sub(hn::Set(d, 1.5), hn::Mul(half, hn::Mul(y, y))));
  return y;
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#endif
