// This file computes the pulls of springs. It is included once for each instruction set.
#if defined(CLOTHFIT_MODEL_KERNELS_SPRING_PULL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CLOTHFIT_MODEL_KERNELS_SPRING_PULL_INL_H_
#undef CLOTHFIT_MODEL_KERNELS_SPRING_PULL_INL_H_
#else
#define CLOTHFIT_MODEL_KERNELS_SPRING_PULL_INL_H_
#endif

#include "model/kernels/lane_vector-inl.h"
#include "model/topology/mesh.h"

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

template <class V>
struct SpringConstants {
  V stiffness, damping, natural_length;
  V quarter_damping, half_rest;  ///< of `float`: c / 4, k l0 / 2
};

template <class V>
HWY_INLINE SpringConstants<V> spring_constants(const V& stiffness, const V& damping,
                                               const V& natural_length) {
  SpringConstants<V> spring{stiffness, damping, natural_length, damping, stiffness};
  if constexpr (kMayContract<V>) {
    const hn::DFromV<V> d;
    spring.quarter_damping = hn::Mul(hn::Set(d, 0.25f), damping);
    spring.half_rest = hn::Mul(hn::Set(d, 0.5f), hn::Mul(stiffness, natural_length));
  }
  return spring;
}

/// The pull of a spring: `strength` times `along`.
template <class V>
struct Pull {
  V strength;
  Vector3<V> along;
};

template <class V>
HWY_INLINE Vector3<V> operator+(const Vector3<V>& a, const Pull<V>& b) {
  return mul_add(b.strength, b.along, a);
}

template <class V>
HWY_INLINE Vector3<V> operator-(const Vector3<V>& a, const Pull<V>& b) {
  return minus_product(a, b.strength, b.along);
}

template <class V>
HWY_INLINE Vector3<V> force(const Pull<V>& pull) {
  return pull.strength * pull.along;
}

/// Computes the pulls of several springs from a vertex to those at `along`, which move with `rate`.
/// Both are relative to the vertex. Each step is taken for all springs, because the operations of
/// one wait for each other: a processor that looks ahead a spring or two would find little to do.
template <class V, size_t n>
HWY_INLINE void set_strengths(const SpringConstants<V> (&springs)[n], const Vector3<V> (&rate)[n],
                              Pull<V> (&pulls)[n]) {
  V length2[n], inverse[n], stretching[n];
  for (size_t s = 0; s < n; ++s) length2[s] = squared_length(pulls[s].along);
  for (size_t s = 0; s < n; ++s) stretching[s] = dot(pulls[s].along, rate[s]);
  if constexpr (kMayContract<V>) {
    // (k (l - l0) + c dl/dt) / l in fewer operations; `inverse` is 2 / l.
    twice_inverse_square_roots(length2, inverse);
    for (size_t s = 0; s < n; ++s) stretching[s] = hn::Mul(stretching[s], inverse[s]);
    for (size_t s = 0; s < n; ++s)
      stretching[s] = hn::MulSub(springs[s].quarter_damping, stretching[s], springs[s].half_rest);
    for (size_t s = 0; s < n; ++s)
      pulls[s].strength = hn::MulAdd(stretching[s], inverse[s], springs[s].stiffness);
  } else {
    inverse_square_roots(length2, inverse);
    for (size_t s = 0; s < n; ++s) {
      stretching[s] = hn::Mul(stretching[s], inverse[s]);
      const V length = hn::Mul(length2[s], inverse[s]);
      const V elastic = hn::Mul(springs[s].stiffness, hn::Sub(length, springs[s].natural_length));
      const V tension = hn::Add(elastic, hn::Mul(springs[s].damping, stretching[s]));
      pulls[s].strength = hn::Mul(tension, inverse[s]);
    }
  }
}

/// The springs that leave a vertex, in the order in which their pulls are added to its force.
constexpr SpringType kLeaving[kSpringTypes] = {structural_s, flexion_s,    flexion_t,
                                               shear_up,     structural_t, shear_down};

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#endif
