#include "model/kernels/cloth_sweep.h"

#include <algorithm>
#include <utility>

// This source is compiled once for each instruction set, in a namespace of its own.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/kernels/cloth_sweep.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "model/kernels/single_sweep-inl.h"
#include "model/kernels/spring_pull-inl.h"
#include "model/kernels/sweep_arrays.h"

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

/// Sweeps one row that has `kBelow` rows below it, or more.
template <class L, int kBelow, bool kFactors, class Sink>
HWY_INLINE void sweep_row(const SweepArrays<L>& arrays,
                          const SpringConstants<Vector<L>> (&constants)[kSpringTypes],
                          std::ptrdiff_t i, std::ptrdiff_t lane, const Sink& sink) {
  using Number = typename L::Number;
  using V = Vector<L>;
  const Tag<L> d;
  const std::ptrdiff_t columns = arrays.mesh.columns, width = columns * L::kCount;
  // These are copies, because the compiler must assume that a store changes what `arrays` holds.
  const std::array<const Number*, 3> positions = arrays.position_m;
  const std::array<const Number*, 3> velocities = arrays.velocity_m_per_s;
  const std::array<Number*, 3> from_above = scratch_rows(arrays, 0);
  const std::array<Number*, 3> from_two_above = scratch_rows(arrays, i % 2 == 0 ? 1 : 2);

  // The springs of kLeaving that this row has, and the constants of their types.
  constexpr size_t kCount = kBelow == 2 ? 6 : kBelow == 1 ? 5 : 2;
  constexpr size_t kTwoDown = 2, kDownLeft = kBelow == 2 ? 3 : 2, kDown = kDownLeft + 1,
                   kDownRight = kDownLeft + 2;
  SpringType types[kCount];
  SpringConstants<V> springs[kCount];
  for (size_t s = 0; s < kCount; ++s) {
    types[s] = kLeaving[kBelow == 1 && s >= kTwoDown ? s + 1 : s];
    springs[s] = constants[types[s]];
  }
  const Pull<V> none{hn::Zero(d), zero(d)};
  // Pulls of the vertices just passed to the right, and below to the right.
  Pull<V> right = none, right_two = none, right_two_next = none, down_right = none;
  Vector3<V> to_below = zero(d);  // sum so far for the vertex below the one just passed
  for (std::ptrdiff_t j = 0; j < columns; ++j) {
    const std::ptrdiff_t at = j * L::kCount + lane, self = i * width + at;
    const std::ptrdiff_t vertex = i * columns + j;
    // A spring that would cross the cloth's edge ends where it begins: it pulls with zero.
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
      SpringConstants<V> scaled[kCount];
      for (size_t s = 0; s < kCount; ++s) {
        const auto of_spring = [&](const auto& factors)
                                   HWY_ATTR { return hn::Set(d, factors[types[s]][vertex]); };
        scaled[s] = spring_constants(
            hn::Mul(springs[s].stiffness, of_spring(arrays.factors->stiffness)), springs[s].damping,
            hn::Mul(springs[s].natural_length, of_spring(arrays.factors->natural_length)));
      }
      set_strengths(scaled, rate, pulls);
    } else {
      set_strengths(springs, rate, pulls);
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
    sink(d, vertex, self, sum, velocity, position);
  }
  if constexpr (kBelow >= 1) store(to_below, d, from_above, (columns - 1) * L::kCount + lane);
}

/// Calls `sink(tag, vertex, element, force, velocity, position)` for every vertex in row-major
/// order. A call takes as many lanes as a vector holds. The sink may move the vertex: no spring of
/// a later one reaches back to it.
template <class L, bool kFactors, class Sink>
HWY_INLINE void sweep(const SweepArrays<L>& arrays, const Sink& sink) {
  const Tag<L> d;
  const std::ptrdiff_t rows = arrays.mesh.rows;
  std::fill_n(arrays.scratch, scratch_size<L>(arrays.mesh), typename L::Number{0});
  for (std::ptrdiff_t lane = 0; lane < L::kCount;
       lane += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    SpringConstants<Vector<L>> constants[kSpringTypes];
    for (size_t type = 0; type < kSpringTypes; ++type)
      constants[type] =
          spring_constants(hn::LoadU(d, arrays.springs.stiffness_n_per_m[type].data() + lane),
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
  const bool any_factors = arrays.factors != nullptr;
  if constexpr (L::kCount == 1)
    any_factors ? sweep_single<true>(arrays, sink) : sweep_single<false>(arrays, sink);
  else
    any_factors ? sweep<L, true>(arrays, sink) : sweep<L, false>(arrays, sink);
}

template <class L>
HWY_INLINE void add_forces(const SweepArrays<L>& arrays,
                           const std::array<typename L::Number*, 3>& force_n) {
  const std::array<typename L::Number*, 3> out = force_n;
  sweep(arrays, [&](auto d, std::ptrdiff_t, std::ptrdiff_t self, const auto& sum, const auto&,
                    const auto&) HWY_ATTR { store(load(d, out, self) + sum, d, out, self); });
}

template <class L>
HWY_INLINE void step_euler(const SweepArrays<L>& arrays, const EulerArrays<L>& euler) {
  using Number = typename L::Number;
  const EulerArrays<L> to = euler;
  const bool any_effect = to.effect_force_n[0] != nullptr;
  const std::ptrdiff_t vertices = arrays.mesh.vertex_count();
  sweep(arrays, [&](auto d, std::ptrdiff_t vertex, std::ptrdiff_t self, const auto& springs,
                    const auto& velocity, const auto& position) HWY_ATTR {
    using V = hn::Vec<decltype(d)>;
    const V h = hn::Set(d, static_cast<Number>(to.time_step_s));
    const Vector3<V> sum = any_effect ? springs + load(d, to.effect_force_n, self) : springs;
    Vector3<V> gravity;
    V inverse_mass;
    if constexpr (L::kCount == 1) {
      gravity = {hn::Set(d, *to.gravity_m_per_s2[0]), hn::Set(d, *to.gravity_m_per_s2[1]),
                 hn::Set(d, *to.gravity_m_per_s2[2])};
      const auto size = static_cast<std::ptrdiff_t>(hn::Lanes(d));
      if (vertex + size <= vertices) {
        inverse_mass = hn::LoadU(d, to.inverse_mass_per_kg + vertex);
      } else {
        double last[kMostVertices] = {};
        std::copy(to.inverse_mass_per_kg + vertex, to.inverse_mass_per_kg + vertices, last);
        inverse_mass = hn::LoadU(d, last);
      }
    } else {
      gravity = load(d, to.gravity_m_per_s2, self % L::kCount);
      inverse_mass = hn::Set(d, static_cast<Number>(to.inverse_mass_per_kg[vertex]));
    }
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
    : mesh_(mesh), scratch_(static_cast<size_t>(scratch_size<L>(mesh))) {
  if (L::kCount > 1) return;
  for (size_t type = 0; type < kSpringTypes; ++type) {
    leaving_[type].resize(static_cast<size_t>(mesh.vertex_count()) + 8);  // masks load 8 bytes
    for (int i = 0; i < mesh.rows; ++i)
      for (int j = 0; j < mesh.columns; ++j)
        for (int k = 0; k < kMostVertices && kSpringReach[type].leaves(mesh, i, j); ++k)
          if (k <= mesh.vertex(i, j))
            leaving_[type][static_cast<size_t>(mesh.vertex(i, j) - k)] |=
                static_cast<std::uint8_t>(1 << k);
  }
}

template <class L>
void ClothSweep<L>::add_spring_forces(const LaneSprings<L>& springs,
                                      const LaneVectors<L>& position_m,
                                      const LaneVectors<L>& velocity_m_per_s,
                                      LaneVectors<L>& force_n, const SpringFactors<L>* factors) {
  const SweepArrays<L> arrays{
      mesh_,           springs, factors, position_m.data(), velocity_m_per_s.data(),
      scratch_.data(), leaving_};
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
                              scratch_.data(),
                              leaving_};
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
