#include "model/kernels/cloth_sweep.h"

#include <algorithm>
#include <utility>

// This source is compiled once for each instruction set, in a namespace of its own.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/kernels/cloth_sweep.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "model/kernels/lane_vector-inl.h"

#ifndef CLOTHFIT_MODEL_KERNELS_CLOTH_SWEEP_ONCE
#define CLOTHFIT_MODEL_KERNELS_CLOTH_SWEEP_ONCE
namespace clothfit {
namespace {

/// What a sweep works on; element (vertex * kCount + lane) of each array is one vertex in one lane.
template <class L>
struct SweepArrays {
  using Number = typename L::Number;
  Mesh mesh;
  const LaneSprings<L>& springs;
  const SpringFactors<L>* factors;  ///< or null
  std::array<const Number*, 3> position_m;
  std::array<const Number*, 3> velocity_m_per_s;
  Number* scratch;  ///< of scratch_size
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

/// Forces that arrive from one row above, and twice those from two rows above: one for the row at
/// hand, one for the next. A vertex before the first takes what an absent spring sends to the left.
constexpr int kScratchVectors = 3;

template <class L>
constexpr std::ptrdiff_t scratch_size(const Mesh& mesh) {
  return std::ptrdiff_t{3} * kScratchVectors * (mesh.columns + 1) * L::kCount;
}

template <class L>
std::array<typename L::Number*, 3> scratch_rows(const SweepArrays<L>& arrays, int n) {
  const std::ptrdiff_t width = (arrays.mesh.columns + 1) * L::kCount;
  typename L::Number* const x = arrays.scratch + 3 * n * width + L::kCount;
  return {x, x + width, x + 2 * width};
}

}  // namespace
}  // namespace clothfit
#endif

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

template <class L>
struct SpringConstants {
  Vector<L> stiffness, damping, natural_length;
  Vector<L> quarter_damping, half_rest;  ///< of `float`: c / 4, k l0 / 2
};

template <class L>
HWY_INLINE SpringConstants<L> spring_constants(const Vector<L>& stiffness, const Vector<L>& damping,
                                               const Vector<L>& natural_length) {
  SpringConstants<L> spring{stiffness, damping, natural_length, damping, stiffness};
  if constexpr (kMayContract<Vector<L>>) {
    const Tag<L> d;
    spring.quarter_damping = hn::Mul(hn::Set(d, 0.25f), damping);
    spring.half_rest = hn::Mul(hn::Set(d, 0.5f), hn::Mul(stiffness, natural_length));
  }
  return spring;
}

/// What a spring exerts: `strength` times `along`.
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

/// The pulls of several springs from a vertex to those at `along`, which move with `rate`, both
/// relative to its own. Step by step for all of them: a spring's operations wait for each other, so
/// that a processor that looks ahead a spring or two would find little to do.
template <class L, size_t n>
HWY_INLINE void set_strengths(const SpringConstants<L> (&springs)[n],
                              const Vector3<Vector<L>> (&rate)[n], Pull<Vector<L>> (&pulls)[n]) {
  using V = Vector<L>;
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

/// One row of a sweep, with `kBelow` rows below it, or more.
template <class L, int kBelow, bool kFactors, class Sink>
HWY_INLINE void sweep_row(const SweepArrays<L>& arrays,
                          const SpringConstants<L> (&constants)[kSpringTypes], std::ptrdiff_t i,
                          std::ptrdiff_t lane, const Sink& sink) {
  using Number = typename L::Number;
  using V = Vector<L>;
  const Tag<L> d;
  const std::ptrdiff_t columns = arrays.mesh.columns, width = columns * L::kCount;
  // Copies, because the compiler must take a store for one that may change what `arrays` holds.
  const std::array<const Number*, 3> positions = arrays.position_m;
  const std::array<const Number*, 3> velocities = arrays.velocity_m_per_s;
  const std::array<Number*, 3> from_above = scratch_rows(arrays, 0);
  const std::array<Number*, 3> from_two_above = scratch_rows(arrays, i % 2 == 0 ? 1 : 2);

  // Those of kLeaving that this row has, and the constants of their types.
  constexpr size_t kCount = kBelow == 2 ? 6 : kBelow == 1 ? 5 : 2;
  constexpr size_t kTwoDown = 2, kDownLeft = kBelow == 2 ? 3 : 2, kDown = kDownLeft + 1,
                   kDownRight = kDownLeft + 2;
  SpringType types[kCount];
  SpringConstants<L> springs[kCount];
  for (size_t s = 0; s < kCount; ++s) {
    types[s] = kLeaving[kBelow == 1 && s >= kTwoDown ? s + 1 : s];
    springs[s] = constants[types[s]];
  }
  const Pull<V> none{hn::Zero(d), zero(d)};
  // What the vertices just passed sent to the right, and below to the right.
  Pull<V> right = none, right_two = none, right_two_next = none, down_right = none;
  Vector3<V> to_below = zero(d);  // what the vertex below the one just passed has got so far
  for (std::ptrdiff_t j = 0; j < columns; ++j) {
    const std::ptrdiff_t at = j * L::kCount + lane, self = i * width + at;
    const std::ptrdiff_t vertex = i * columns + j;
    // A spring that the cloth's edge leaves no room for ends where it begins: it pulls with zero.
    const std::ptrdiff_t one_right = j + 1 < columns ? L::kCount : 0;
    std::ptrdiff_t to[kCount];
    to[0] = self + one_right;
    to[1] = self + (j + 2 < columns ? 2 * L::kCount : 0);
    if constexpr (kBelow == 2) to[kTwoDown] = self + 2 * width;
    if constexpr (kBelow >= 1) {
      to[kDownLeft] = self + (j > 0 ? width - L::kCount : 0);
      to[kDown] = self + width;
      to[kDownRight] = self + (j + 1 < columns ? width + L::kCount : 0);
    }
    const Vector3<V> position = load(d, positions, self), velocity = load(d, velocities, self);
    Pull<V> pulls[kCount];
    Vector3<V> rate[kCount];
    for (size_t s = 0; s < kCount; ++s) {
      pulls[s].along = load(d, positions, to[s]) - position;
      rate[s] = load(d, velocities, to[s]) - velocity;
    }
    if constexpr (kFactors) {
      SpringConstants<L> scaled[kCount];
      for (size_t s = 0; s < kCount; ++s) {
        const auto of_spring = [&](const auto& factors)
                                   HWY_ATTR { return hn::Set(d, factors[types[s]][vertex]); };
        scaled[s] = spring_constants<L>(
            hn::Mul(springs[s].stiffness, of_spring(arrays.factors->stiffness)), springs[s].damping,
            hn::Mul(springs[s].natural_length, of_spring(arrays.factors->natural_length)));
      }
      set_strengths<L>(scaled, rate, pulls);
    } else {
      set_strengths<L>(springs, rate, pulls);
    }

    Vector3<V> sum = zero(d) - (load(d, from_above, at) + load(d, from_two_above, at));
    sum = sum - right;
    sum = sum - right_two;
    right_two = right_two_next;
    for (size_t s = 0; s < kCount; ++s) sum = sum + pulls[s];
    right = pulls[0];
    right_two_next = pulls[1];
    if constexpr (kBelow == 2) store(force(pulls[kTwoDown]), d, from_two_above, at);
    if constexpr (kBelow >= 1) {
      store(to_below + pulls[kDownLeft], d, from_above, at - L::kCount);
      to_below = force(pulls[kDown]) + down_right;
      down_right = pulls[kDownRight];
    }
    sink(vertex, self, sum, velocity, position);
  }
  if constexpr (kBelow >= 1) store(to_below, d, from_above, (columns - 1) * L::kCount + lane);
}

/// Calls `sink(vertex, element, force, velocity, position)` for every vertex in row-major order,
/// for as many lanes at once as a vector holds. The sink may move the vertex: no spring of a later
/// one reaches back to it.
template <class L, bool kFactors, class Sink>
HWY_INLINE void sweep(const SweepArrays<L>& arrays, const Sink& sink) {
  const Tag<L> d;
  const std::ptrdiff_t rows = arrays.mesh.rows;
  std::fill_n(arrays.scratch, scratch_size<L>(arrays.mesh), typename L::Number{0});
  for (std::ptrdiff_t lane = 0; lane < L::kCount;
       lane += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    SpringConstants<L> constants[kSpringTypes];
    for (size_t type = 0; type < kSpringTypes; ++type)
      constants[type] =
          spring_constants<L>(hn::LoadU(d, arrays.springs.stiffness_n_per_m[type].data() + lane),
                              hn::LoadU(d, arrays.springs.damping_ns_per_m[type].data() + lane),
                              hn::LoadU(d, arrays.springs.natural_length_m[type].data() + lane));
    std::ptrdiff_t i = 0;
    for (; i + 2 < rows; ++i) sweep_row<L, 2, kFactors>(arrays, constants, i, lane, sink);
    for (; i + 1 < rows; ++i) sweep_row<L, 1, kFactors>(arrays, constants, i, lane, sink);
    sweep_row<L, 0, kFactors>(arrays, constants, i, lane, sink);
  }
}

template <class L, class Sink>
HWY_INLINE void sweep(const SweepArrays<L>& arrays, const Sink& sink) {
  if (arrays.factors != nullptr)
    sweep<L, true>(arrays, sink);
  else
    sweep<L, false>(arrays, sink);
}

template <class L>
HWY_INLINE void add_forces(const SweepArrays<L>& arrays,
                           const std::array<typename L::Number*, 3>& force_n) {
  using V = Vector<L>;
  const Tag<L> d;
  const std::array<typename L::Number*, 3> out = force_n;
  sweep(arrays, [&](std::ptrdiff_t, std::ptrdiff_t self, const Vector3<V>& sum, const Vector3<V>&,
                    const Vector3<V>&) HWY_ATTR { store(load(d, out, self) + sum, d, out, self); });
}

template <class L>
HWY_INLINE void step_euler(const SweepArrays<L>& arrays, const EulerArrays<L>& euler) {
  using Number = typename L::Number;
  using V = Vector<L>;
  const Tag<L> d;
  const EulerArrays<L> to = euler;
  const V h = hn::Set(d, static_cast<Number>(to.time_step_s));
  const bool any_effect = to.effect_force_n[0] != nullptr;
  sweep(arrays, [&](std::ptrdiff_t vertex, std::ptrdiff_t self, const Vector3<V>& springs,
                    const Vector3<V>& velocity, const Vector3<V>& position) HWY_ATTR {
    const Vector3<V> sum = any_effect ? springs + load(d, to.effect_force_n, self) : springs;
    const Vector3<V> gravity = load(d, to.gravity_m_per_s2, self % L::kCount);
    const V inverse_mass = hn::Set(d, static_cast<Number>(to.inverse_mass_per_kg[vertex]));
    const Vector3<V> new_velocity = mul_add(h, mul_add(inverse_mass, sum, gravity), velocity);
    store(new_velocity, d, to.velocity_m_per_s, self);
    store(mul_add(h, new_velocity, position), d, to.position_m, self);
  });
}

void add_forces_exact(const SweepArrays<ExactLanes>& arrays,
                      const std::array<double*, 3>& force_n) {
  add_forces(arrays, force_n);
}
void add_forces_fast(const SweepArrays<FastLanes>& arrays, const std::array<float*, 3>& force_n) {
  add_forces(arrays, force_n);
}
void add_forces_single(const SweepArrays<SingleLane>& arrays,
                       const std::array<double*, 3>& force_n) {
  add_forces(arrays, force_n);
}
void step_euler_single(const SweepArrays<SingleLane>& arrays,
                       const EulerArrays<SingleLane>& euler) {
  step_euler(arrays, euler);
}
void step_euler_exact(const SweepArrays<ExactLanes>& arrays, const EulerArrays<ExactLanes>& euler) {
  step_euler(arrays, euler);
}
void step_euler_fast(const SweepArrays<FastLanes>& arrays, const EulerArrays<FastLanes>& euler) {
  step_euler(arrays, euler);
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace clothfit {
namespace {

HWY_EXPORT(add_forces_exact);
HWY_EXPORT(add_forces_fast);
HWY_EXPORT(step_euler_exact);
HWY_EXPORT(add_forces_single);
HWY_EXPORT(step_euler_single);
HWY_EXPORT(step_euler_fast);

void add_forces(const SweepArrays<ExactLanes>& arrays, const std::array<double*, 3>& force_n) {
  HWY_DYNAMIC_DISPATCH(add_forces_exact)(arrays, force_n);
}
void add_forces(const SweepArrays<FastLanes>& arrays, const std::array<float*, 3>& force_n) {
  HWY_DYNAMIC_DISPATCH(add_forces_fast)(arrays, force_n);
}
void step_euler(const SweepArrays<ExactLanes>& arrays, const EulerArrays<ExactLanes>& euler) {
  HWY_DYNAMIC_DISPATCH(step_euler_exact)(arrays, euler);
}
void step_euler(const SweepArrays<FastLanes>& arrays, const EulerArrays<FastLanes>& euler) {
  HWY_DYNAMIC_DISPATCH(step_euler_fast)(arrays, euler);
}
void add_forces(const SweepArrays<SingleLane>& arrays, const std::array<double*, 3>& force_n) {
  HWY_DYNAMIC_DISPATCH(add_forces_single)(arrays, force_n);
}
void step_euler(const SweepArrays<SingleLane>& arrays, const EulerArrays<SingleLane>& euler) {
  HWY_DYNAMIC_DISPATCH(step_euler_single)(arrays, euler);
}

}  // namespace

template <class L>
ClothSweep<L>::ClothSweep(const Mesh& mesh)
    : mesh_(mesh), scratch_(static_cast<size_t>(scratch_size<L>(mesh))) {}

template <class L>
void ClothSweep<L>::add_spring_forces(const LaneSprings<L>& springs,
                                      const LaneVectors<L>& position_m,
                                      const LaneVectors<L>& velocity_m_per_s,
                                      LaneVectors<L>& force_n, const SpringFactors<L>* factors) {
  const SweepArrays<L> arrays{
      mesh_, springs, factors, position_m.data(), velocity_m_per_s.data(), scratch_.data()};
  add_forces(arrays, force_n.data());
}

template <class L>
void ClothSweep<L>::step_euler(const LaneSprings<L>& springs, const LaneVector<L>& gravity,
                               const Eigen::VectorXd& inverse_mass_per_kg,
                               const LaneVectors<L>* effect_force_n, double time_step_s,
                               LaneVectors<L>& position_m, LaneVectors<L>& velocity_m_per_s,
                               const SpringFactors<L>* factors) {
  using Number = typename L::Number;
  const SweepArrays<L> arrays{mesh_,
                              springs,
                              factors,
                              std::as_const(position_m).data(),
                              std::as_const(velocity_m_per_s).data(),
                              scratch_.data()};
  const EulerArrays<L> euler{
      .position_m = position_m.data(),
      .velocity_m_per_s = velocity_m_per_s.data(),
      .gravity_m_per_s2 = {gravity.x.data(), gravity.y.data(), gravity.z.data()},
      .effect_force_n =
          effect_force_n != nullptr ? effect_force_n->data() : std::array<const Number*, 3>{},
      .inverse_mass_per_kg = inverse_mass_per_kg.data(),
      .time_step_s = time_step_s};
  clothfit::step_euler(arrays, euler);
}

template class ClothSweep<ExactLanes>;
template class ClothSweep<FastLanes>;
template class ClothSweep<SingleLane>;

}  // namespace clothfit
#endif
