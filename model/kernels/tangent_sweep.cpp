#include "model/kernels/tangent_sweep.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "model/kernels/spring_reach.h"

// This source is compiled once for each instruction set, in a namespace of its own.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/kernels/tangent_sweep.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "model/kernels/row_sweep-inl.h"

#ifndef CLOTHFIT_MODEL_KERNELS_TANGENT_SWEEP_ONCE
#define CLOTHFIT_MODEL_KERNELS_TANGENT_SWEEP_ONCE
// The compiler must inline these: in calls, vectors would go through memory.
#define CLOTHFIT_INLINE __attribute__((always_inline))
namespace clothfit {
namespace {

using ConstVectors = std::array<const double*, 3>;
using MutableVectors = std::array<double*, 3>;

/// The springs of one type and the state in which they are differentiated.
struct LineariseArrays {
  std::ptrdiff_t count, offset;  ///< springs may leave vertices 0 to count - 1 for `offset` further
  ConstVectors position_m, velocity_m_per_s;
  double natural_length_m, stiffness_n_per_m, damping_ns_per_m;
  const double *natural_length_factor, *stiffness_factor;  ///< or null
};

template <class L>
struct TangentArrays {
  using Number = typename L::Number;
  Mesh mesh;
  std::array<LineariseArrays, kSpringTypes> from;
  const LaneSprings<L>& springs;                              ///< along the directions
  bool any_spring;                                            ///< whether these are not all zero
  std::array<const Number*, 3> position_m, velocity_m_per_s;  ///< along the directions
  Number* scratch;
};

template <class L>
struct TangentEuler {
  using Number = typename L::Number;
  std::array<Number*, 3> position_m, velocity_m_per_s;
  std::array<const Number*, 3> gravity_m_per_s2;
  std::array<const Number*, 3> effect_force_n;  ///< or null
  const double* inverse_mass_per_kg;
  double time_step_s;
};

/// One coordinate.
struct MotionArrays {
  std::ptrdiff_t count;
  double time_step_s, gravity_m_per_s2;
  const double *inverse_mass_per_kg, *velocity_m_per_s, *driven_velocity_m_per_s, *by_position;
  double *by_velocity, *by_force, *by_mass;
};

/// Ends of springs that are fewer vertices apart share vectors.
constexpr std::ptrdiff_t kNear = 8;

struct TransposedArrays {
  const double* exists;  ///< 1 where a spring leaves, else 0
  ConstVectors by_force;
  MutableVectors by_position, by_velocity;  ///< added to
  MutableVectors by_along, by_rate;         ///< scratch over all vertices
  double *by_natural_length, *by_stiffness, *by_damping;
};

}  // namespace
}  // namespace clothfit
#endif

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

/// Calls `visit(tag, first)` over 0 to count - 1: whole vectors first, then single numbers.
template <class Visit>
HWY_INLINE void for_vectors(std::ptrdiff_t count, const Visit& visit) {
  const hn::ScalableTag<double> d;
  const hn::CappedTag<double, 1> single;
  const auto step = static_cast<std::ptrdiff_t>(hn::Lanes(d));
  std::ptrdiff_t e = 0;
  for (; e + step <= count; e += step) visit(d, e);
  for (; e < count; ++e) visit(single, e);
}

/// The parts of the derivatives of springs' forces.
template <class V>
struct SpringDerivatives {
  Vector3<V> u, w;
  V tension_ratio, elongation, stretching, stiffness;
};

/// Returns the derivatives for the springs that leave the vertices from `e` on. All are zero for a
/// spring that has no direction.
template <class D>
HWY_INLINE SpringDerivatives<hn::Vec<D>> differentiate(D d, const LineariseArrays& from,
                                                       std::ptrdiff_t e) {
  using V = hn::Vec<D>;
  V natural = hn::Set(d, from.natural_length_m), stiffness = hn::Set(d, from.stiffness_n_per_m);
  if (from.stiffness_factor != nullptr) {
    natural = hn::Mul(natural, hn::LoadU(d, from.natural_length_factor + e));
    stiffness = hn::Mul(stiffness, hn::LoadU(d, from.stiffness_factor + e));
  }
  const V damping = hn::Set(d, from.damping_ns_per_m);
  const Vector3<V> along = load(d, from.position_m, e + from.offset) - load(d, from.position_m, e);
  const Vector3<V> rate =
      load(d, from.velocity_m_per_s, e + from.offset) - load(d, from.velocity_m_per_s, e);
  const V length2 = dot(along, along);
  const V inverse =
      hn::IfThenElseZero(hn::Gt(length2, hn::Set(d, 1e-280)), inverse_square_root(length2));
  const Vector3<V> u = inverse * along;
  const V stretching = dot(u, rate);
  const V elongation = hn::Sub(hn::Mul(length2, inverse), natural);
  const V tension = hn::Add(hn::Mul(stiffness, elongation), hn::Mul(damping, stretching));
  const V ratio = hn::Mul(tension, inverse);
  const Vector3<V> across = rate - stretching * u;
  return {.u = u,
          .w = hn::Sub(stiffness, ratio) * u + hn::Mul(damping, inverse) * across,
          .tension_ratio = ratio,
          .elongation = elongation,
          .stretching = stretching,
          .stiffness = stiffness};
}

/// Says how the types' constants change the tensions: not at all, all alike, or by factors.
enum class Constants { still, change, change_by_factors };

/// The derivative of a vertex's position and velocity.
template <class L>
struct Motion {
  Vector3<Vector<L>> position, velocity;
};

template <class V>
HWY_INLINE Vector3<V> rounded_mul_add(const V& a, const Vector3<V>& b, const Vector3<V>& c) {
  return {rounded_mul_add(a, b.x, c.x), rounded_mul_add(a, b.y, c.y), rounded_mul_add(a, b.z, c.z)};
}

template <class V>
HWY_INLINE V rounded_dot(const Vector3<V>& a, const Vector3<V>& b) {
  return rounded_mul_add(a.z, b.z, rounded_mul_add(a.y, b.y, hn::Mul(a.x, b.x)));
}

/// The derivatives of the springs that leave eight neighbouring vertices.
template <class Number>
struct Chunk {
  static constexpr std::ptrdiff_t kVertices = 8;
  alignas(64) Number direction[kSpringTypes][3][kVertices];
  alignas(64) Number w[kSpringTypes][3][kVertices];
  alignas(64) Number tension_ratio[kSpringTypes][kVertices], elongation[kSpringTypes][kVertices],
      stretching[kSpringTypes][kVertices], stiffness[kSpringTypes][kVertices];
};

template <class D>
HWY_INLINE void store_as(const hn::Vec<D>& v, D d, double* to) {
  hn::StoreU(v, d, to);
}
template <class D>
HWY_INLINE void store_as(const hn::Vec<D>& v, D, float* to) {
  const hn::Rebind<float, D> narrow;
  hn::StoreU(hn::DemoteTo(narrow, v), narrow, to);
}

template <class Number>
HWY_INLINE void fill(const std::array<LineariseArrays, kSpringTypes>& from, std::ptrdiff_t first,
                     Chunk<Number>& chunk) {
  const hn::CappedTag<double, Chunk<Number>::kVertices> d;
  for (size_t type = 0; type < kSpringTypes; ++type) {
    if (first >= from[type].count) continue;
    for (std::ptrdiff_t n = 0; n < Chunk<Number>::kVertices;
         n += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
      const auto spring = differentiate(d, from[type], first + n);
      store_as(spring.u.x, d, chunk.direction[type][0] + n);
      store_as(spring.u.y, d, chunk.direction[type][1] + n);
      store_as(spring.u.z, d, chunk.direction[type][2] + n);
      store_as(spring.w.x, d, chunk.w[type][0] + n);
      store_as(spring.w.y, d, chunk.w[type][1] + n);
      store_as(spring.w.z, d, chunk.w[type][2] + n);
      store_as(spring.tension_ratio, d, chunk.tension_ratio[type] + n);
      store_as(spring.elongation, d, chunk.elongation[type] + n);
      store_as(spring.stretching, d, chunk.stretching[type] + n);
      store_as(spring.stiffness, d, chunk.stiffness[type] + n);
    }
  }
}

template <Constants constants, class L, class Sink>
HWY_INLINE void sweep_tangents(const TangentArrays<L>& arrays, const Sink& sink) {
  using Number = typename L::Number;
  using V = Vector<L>;
  constexpr std::ptrdiff_t kLaneCount = L::kCount;
  const Tag<L> d;
  const std::array<const Number*, 3> positions = arrays.position_m,
                                     velocities = arrays.velocity_m_per_s;
  const std::array<LineariseArrays, kSpringTypes> from = arrays.from;
  std::fill_n(arrays.scratch, kRowSweepScratchRows * arrays.mesh.columns * kLaneCount, Number{0});
  Chunk<Number> chunk;
  std::array<Number, kSpringTypes> damping_ns_per_m;
  for (size_t type = 0; type < kSpringTypes; ++type)
    damping_ns_per_m[type] = static_cast<Number>(from[type].damping_ns_per_m);
  for (std::ptrdiff_t lane = 0; lane < kLaneCount;
       lane += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    V by_natural[kSpringTypes], by_stiffness[kSpringTypes], by_damping[kSpringTypes];
    for (size_t type = 0; type < kSpringTypes; ++type) {
      by_natural[type] = hn::LoadU(d, arrays.springs.natural_length_m[type].data() + lane);
      by_stiffness[type] = hn::LoadU(d, arrays.springs.stiffness_n_per_m[type].data() + lane);
      by_damping[type] = hn::LoadU(d, arrays.springs.damping_ns_per_m[type].data() + lane);
    }
    const auto motion_at = [&](std::ptrdiff_t element) HWY_ATTR CLOTHFIT_INLINE {
      return Motion<L>{load(d, positions, element), load(d, velocities, element)};
    };
    const auto here_at = [&](std::ptrdiff_t vertex, std::ptrdiff_t self) HWY_ATTR CLOTHFIT_INLINE {
      if (vertex % Chunk<Number>::kVertices == 0) fill(from, vertex, chunk);
      return motion_at(self);
    };
    const auto pull_to = [&](size_t type, std::ptrdiff_t vertex, const Motion<L>& here,
                             std::ptrdiff_t element) HWY_ATTR CLOTHFIT_INLINE {
      const std::ptrdiff_t n = vertex % Chunk<Number>::kVertices;
      const auto at = [&](const Number* of) HWY_ATTR CLOTHFIT_INLINE { return hn::Set(d, of[n]); };
      const Motion<L> there = motion_at(element);
      const Vector3<V> along = there.position - here.position;
      const Vector3<V> rate = there.velocity - here.velocity;
      const Vector3<V> u{at(chunk.direction[type][0]), at(chunk.direction[type][1]),
                         at(chunk.direction[type][2])};
      const Vector3<V> w{at(chunk.w[type][0]), at(chunk.w[type][1]), at(chunk.w[type][2])};
      V tension = rounded_mul_add(hn::Set(d, damping_ns_per_m[type]), rounded_dot(u, rate),
                                  rounded_dot(w, along));
      if constexpr (constants != Constants::still) {
        V natural = by_natural[type], stiffness = by_stiffness[type];
        if constexpr (constants == Constants::change_by_factors) {
          natural = hn::Mul(
              natural, hn::Set(d, static_cast<Number>(from[type].natural_length_factor[vertex])));
          stiffness = hn::Mul(stiffness,
                              hn::Set(d, static_cast<Number>(from[type].stiffness_factor[vertex])));
        }
        tension = rounded_mul_add(at(chunk.elongation[type]), stiffness, tension);
        tension = rounded_mul_add(at(chunk.stretching[type]), by_damping[type], tension);
        tension = hn::Sub(tension, hn::Mul(at(chunk.stiffness[type]), natural));
      }
      return rounded_mul_add(tension, u, at(chunk.tension_ratio[type]) * along);
    };
    sweep_rows<L>(arrays.mesh, lane, arrays.scratch, here_at, pull_to, sink);
  }
}

template <class L, class Sink>
HWY_INLINE void sweep_tangents(const TangentArrays<L>& arrays, const Sink& sink) {
  if (!arrays.any_spring)
    sweep_tangents<Constants::still>(arrays, sink);
  else if (arrays.from[0].stiffness_factor == nullptr)
    sweep_tangents<Constants::change>(arrays, sink);
  else
    sweep_tangents<Constants::change_by_factors>(arrays, sink);
}

template <class L>
HWY_INLINE void add_tangents(const TangentArrays<L>& arrays,
                             const std::array<typename L::Number*, 3>& force_n) {
  using V = Vector<L>;
  const Tag<L> d;
  const std::array<typename L::Number*, 3> out = force_n;
  sweep_tangents(arrays,
                 [&](std::ptrdiff_t, std::ptrdiff_t self, const Motion<L>&, const Vector3<V>& sum)
                     HWY_ATTR { store(load(d, out, self) + sum, d, out, self); });
}

void add_tangents_exact(const TangentArrays<ExactLanes>& arrays,
                        const std::array<double*, 3>& force_n) {
  add_tangents(arrays, force_n);
}
void add_tangents_fast(const TangentArrays<FastLanes>& arrays,
                       const std::array<float*, 3>& force_n) {
  add_tangents(arrays, force_n);
}

template <class L>
HWY_INLINE void step_tangents(const TangentArrays<L>& arrays, const TangentEuler<L>& euler) {
  using Number = typename L::Number;
  using V = Vector<L>;
  const Tag<L> d;
  const TangentEuler<L> to = euler;
  const V h = hn::Set(d, static_cast<Number>(to.time_step_s));
  const bool any_effect = to.effect_force_n[0] != nullptr;
  sweep_tangents(arrays, [&](std::ptrdiff_t vertex, std::ptrdiff_t self, const Motion<L>& motion,
                             const Vector3<V>& springs) HWY_ATTR {
    const Vector3<V> sum = any_effect ? springs + load(d, to.effect_force_n, self) : springs;
    const Vector3<V> gravity = load(d, to.gravity_m_per_s2, self % L::kCount);
    const V inverse_mass = hn::Set(d, static_cast<Number>(to.inverse_mass_per_kg[vertex]));
    const Vector3<V> velocity =
        rounded_mul_add(h, rounded_mul_add(inverse_mass, sum, gravity), motion.velocity);
    store(velocity, d, to.velocity_m_per_s, self);
    store(rounded_mul_add(h, velocity, motion.position), d, to.position_m, self);
  });
}

void step_tangents_exact(const TangentArrays<ExactLanes>& arrays,
                         const TangentEuler<ExactLanes>& euler) {
  step_tangents(arrays, euler);
}
void step_tangents_fast(const TangentArrays<FastLanes>& arrays,
                        const TangentEuler<FastLanes>& euler) {
  step_tangents(arrays, euler);
}

void transpose(const LineariseArrays& from, const TransposedArrays& arrays) {
  for_vectors(from.count, [&](auto d, std::ptrdiff_t e) HWY_ATTR {
    using V = hn::Vec<decltype(d)>;
    const auto spring = differentiate(d, from, e);
    // The force pulls its two ends against each other; nothing where no spring leaves.
    const V exists = hn::LoadU(d, arrays.exists + e);
    const Vector3<V> by_force =
        exists * (load(d, arrays.by_force, e) - load(d, arrays.by_force, e + from.offset));
    const V by_tension = dot(spring.u, by_force);
    const auto share = [&](const Vector3<V>& by, const MutableVectors& kept,
                           const MutableVectors& to) HWY_ATTR CLOTHFIT_INLINE {
      store(load(d, to, e) - by, d, to, e);
      // The other end waits where it is so near that the next vector is the same memory.
      if (from.offset >= kNear)
        store(load(d, to, e + from.offset) + by, d, to, e + from.offset);
      else
        store(by, d, kept, e);
    };
    share(spring.tension_ratio * by_force + by_tension * spring.w, arrays.by_along,
          arrays.by_position);
    share(hn::Mul(hn::Set(d, from.damping_ns_per_m), by_tension) * spring.u, arrays.by_rate,
          arrays.by_velocity);
    const auto add = [&](const V& v, double* array) HWY_ATTR CLOTHFIT_INLINE {
      hn::StoreU(hn::Add(hn::LoadU(d, array + e), v), d, array + e);
    };
    add(hn::Mul(by_tension, spring.elongation), arrays.by_stiffness);
    add(hn::Mul(by_tension, spring.stretching), arrays.by_damping);
    add(hn::Neg(hn::Mul(by_tension, spring.stiffness)), arrays.by_natural_length);
  });
}

void take_back(const MotionArrays& arrays) {
  for_vectors(arrays.count, [&](auto d, std::ptrdiff_t e) HWY_ATTR {
    using V = hn::Vec<decltype(d)>;
    const auto at = [&](const double* array)
                        HWY_ATTR CLOTHFIT_INLINE { return hn::LoadU(d, array + e); };
    const V h = hn::Set(d, arrays.time_step_s);
    const V by_velocity = rounded_mul_add(h, at(arrays.by_position), at(arrays.by_velocity));
    const V by_force = hn::Mul(hn::Mul(h, at(arrays.inverse_mass_per_kg)), by_velocity);
    const V acceleration =
        hn::Sub(hn::Mul(hn::Sub(at(arrays.driven_velocity_m_per_s), at(arrays.velocity_m_per_s)),
                        hn::Set(d, 1 / arrays.time_step_s)),
                hn::Set(d, arrays.gravity_m_per_s2));
    hn::StoreU(by_velocity, d, arrays.by_velocity + e);
    hn::StoreU(by_force, d, arrays.by_force + e);
    // F / m is the acceleration less gravity.
    hn::StoreU(hn::Sub(at(arrays.by_mass), hn::Mul(by_force, acceleration)), d, arrays.by_mass + e);
  });
}

/// to[v + offset] += share[v] for v from 0 to count - 1.
void shift_and_add(std::ptrdiff_t count, std::ptrdiff_t offset, const MutableVectors& share,
                   const MutableVectors& to) {
  for (size_t axis = 0; axis < 3; ++axis) {
    const double* const from = share[axis];
    double* const sum = to[axis] + offset;
    for_vectors(count, [&](auto d, std::ptrdiff_t e) HWY_ATTR {
      hn::StoreU(hn::Add(hn::LoadU(d, sum + e), hn::LoadU(d, from + e)), d, sum + e);
    });
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace clothfit {
namespace {

HWY_EXPORT(add_tangents_exact);
HWY_EXPORT(add_tangents_fast);
HWY_EXPORT(step_tangents_exact);
HWY_EXPORT(step_tangents_fast);
HWY_EXPORT(transpose);
HWY_EXPORT(shift_and_add);
HWY_EXPORT(take_back);

template <class L>
bool any_change(const LaneSprings<L>& springs) {
  bool any = false;
  for (size_t type = 0; type < kSpringTypes; ++type)
    any = any || (springs.natural_length_m[type] != 0).any() ||
          (springs.stiffness_n_per_m[type] != 0).any() ||
          (springs.damping_ns_per_m[type] != 0).any();
  return any;
}

}  // namespace

TangentSweep::SpringGradients TangentSweep::SpringGradients::zero(const Mesh& mesh) {
  SpringGradients gradients;
  gradients.natural_length_m.fill(
      std::vector<double>(static_cast<size_t>(mesh.vertex_count()), 0.0));
  gradients.stiffness_n_per_m = gradients.damping_ns_per_m = gradients.natural_length_m;
  return gradients;
}

TangentSweep::TangentSweep(const Mesh& mesh) : mesh_(mesh) {
  const auto vertices = static_cast<size_t>(mesh.vertex_count());
  for (size_t type = 0; type < kSpringTypes; ++type) {
    exists_[type].resize(vertices);
    for (int i = 0; i < mesh.rows; ++i)
      for (int j = 0; j < mesh.columns; ++j)
        exists_[type][static_cast<size_t>(mesh.vertex(i, j))] =
            kSpringReach[type].leaves(mesh, i, j) ? 1 : 0;
  }
  const size_t row = kRowSweepScratchRows * static_cast<size_t>(mesh.columns);
  scratch_.resize(std::max(row * ExactLanes::kCount, 6 * vertices));
  fast_scratch_.resize(row * FastLanes::kCount);
}

namespace {

LineariseArrays linearise_arrays(const Mesh& mesh, size_t type, const TangentSweep::State& at) {
  const std::ptrdiff_t offset = kSpringReach[type].offset(mesh);
  const bool factors = at.factors != nullptr;
  return {.count = std::max<std::ptrdiff_t>(mesh.vertex_count() - offset, 0),
          .offset = offset,
          .position_m = at.position_m.data(),
          .velocity_m_per_s = at.velocity_m_per_s.data(),
          .natural_length_m = at.springs.natural_length_m[type][0],
          .stiffness_n_per_m = at.springs.stiffness_n_per_m[type][0],
          .damping_ns_per_m = at.springs.damping_ns_per_m[type][0],
          .natural_length_factor = factors ? at.factors->natural_length[type].data() : nullptr,
          .stiffness_factor = factors ? at.factors->stiffness[type].data() : nullptr};
}

template <class L>
TangentArrays<L> tangent_arrays(const Mesh& mesh, const TangentSweep::State& at,
                                const LaneSprings<L>& springs, const LaneVectors<L>& position_m,
                                const LaneVectors<L>& velocity_m_per_s,
                                typename L::Number* scratch) {
  TangentArrays<L> arrays{.mesh = mesh,
                          .from = {},
                          .springs = springs,
                          .any_spring = any_change(springs),
                          .position_m = position_m.data(),
                          .velocity_m_per_s = velocity_m_per_s.data(),
                          .scratch = scratch};
  for (size_t type = 0; type < kSpringTypes; ++type)
    arrays.from[type] = linearise_arrays(mesh, type, at);
  return arrays;
}

}  // namespace

template <class L>
void TangentSweep::step_euler(const State& at, const LaneSprings<L>& springs,
                              const LaneVector<L>& gravity,
                              const Eigen::VectorXd& inverse_mass_per_kg,
                              const LaneVectors<L>* effect_force_n, double time_step_s,
                              LaneVectors<L>& position_m, LaneVectors<L>& velocity_m_per_s) {
  TangentEuler<L> euler{.position_m = position_m.data(),
                        .velocity_m_per_s = velocity_m_per_s.data(),
                        .gravity_m_per_s2 = {gravity.x.data(), gravity.y.data(), gravity.z.data()},
                        .effect_force_n = {},
                        .inverse_mass_per_kg = inverse_mass_per_kg.data(),
                        .time_step_s = time_step_s};
  if (effect_force_n != nullptr) euler.effect_force_n = effect_force_n->data();
  const auto arrays = [&](typename L::Number* scratch) {
    return tangent_arrays<L>(mesh_, at, springs, position_m, velocity_m_per_s, scratch);
  };
  if constexpr (std::is_same_v<L, ExactLanes>)
    HWY_DYNAMIC_DISPATCH(step_tangents_exact)(arrays(scratch_.data()), euler);
  else
    HWY_DYNAMIC_DISPATCH(step_tangents_fast)(arrays(fast_scratch_.data()), euler);
}

template <class L>
void TangentSweep::add_spring_forces(const State& at, const LaneSprings<L>& springs,
                                     const LaneVectors<L>& position_m,
                                     const LaneVectors<L>& velocity_m_per_s,
                                     LaneVectors<L>& force_n) {
  const auto arrays = [&](typename L::Number* scratch) {
    return tangent_arrays<L>(mesh_, at, springs, position_m, velocity_m_per_s, scratch);
  };
  if constexpr (std::is_same_v<L, ExactLanes>)
    HWY_DYNAMIC_DISPATCH(add_tangents_exact)(arrays(scratch_.data()), force_n.data());
  else
    HWY_DYNAMIC_DISPATCH(add_tangents_fast)(arrays(fast_scratch_.data()), force_n.data());
}

#define CLOTHFIT_INSTANTIATE(L)                                                               \
  template void TangentSweep::step_euler(                                                     \
      const State&, const LaneSprings<L>&, const LaneVector<L>&, const Eigen::VectorXd&,      \
      const LaneVectors<L>*, double, LaneVectors<L>&, LaneVectors<L>&);                       \
  template void TangentSweep::add_spring_forces(const State&, const LaneSprings<L>&,          \
                                                const LaneVectors<L>&, const LaneVectors<L>&, \
                                                LaneVectors<L>&);
CLOTHFIT_INSTANTIATE(ExactLanes)
CLOTHFIT_INSTANTIATE(FastLanes)
#undef CLOTHFIT_INSTANTIATE

void TangentSweep::add_transposed(const State& at, const LaneVectors<SingleLane>& by_force,
                                  LaneVectors<SingleLane>& by_position,
                                  LaneVectors<SingleLane>& by_velocity,
                                  SpringGradients& by_springs) {
  const std::ptrdiff_t vertices = mesh_.vertex_count();
  const auto scratch = [&](std::ptrdiff_t n) {
    double* const first = scratch_.data() + 3 * n * vertices;
    return MutableVectors{first, first + vertices, first + 2 * vertices};
  };
  for (size_t type = 0; type < kSpringTypes; ++type) {
    const LineariseArrays from = linearise_arrays(mesh_, type, at);
    const TransposedArrays arrays{.exists = exists_[type].data(),
                                  .by_force = by_force.data(),
                                  .by_position = by_position.data(),
                                  .by_velocity = by_velocity.data(),
                                  .by_along = scratch(0),
                                  .by_rate = scratch(1),
                                  .by_natural_length = by_springs.natural_length_m[type].data(),
                                  .by_stiffness = by_springs.stiffness_n_per_m[type].data(),
                                  .by_damping = by_springs.damping_ns_per_m[type].data()};
    HWY_DYNAMIC_DISPATCH(transpose)(from, arrays);
    if (from.offset >= kNear) continue;
    HWY_DYNAMIC_DISPATCH(shift_and_add)
    (from.count, from.offset, arrays.by_along, by_position.data());
    HWY_DYNAMIC_DISPATCH(shift_and_add)
    (from.count, from.offset, arrays.by_rate, by_velocity.data());
  }
}

void TangentSweep::take_back_motion(double time_step_s, double gravity_m_per_s2,
                                    const Eigen::VectorXd& inverse_mass_per_kg,
                                    const LaneArray<SingleLane>& velocity_m_per_s,
                                    const LaneArray<SingleLane>& driven_velocity_m_per_s,
                                    const LaneArray<SingleLane>& by_position,
                                    LaneArray<SingleLane>& by_velocity,
                                    LaneArray<SingleLane>& by_force, Eigen::VectorXd& by_mass) {
  HWY_DYNAMIC_DISPATCH(take_back)
  ({.count = by_mass.size(),
    .time_step_s = time_step_s,
    .gravity_m_per_s2 = gravity_m_per_s2,
    .inverse_mass_per_kg = inverse_mass_per_kg.data(),
    .velocity_m_per_s = velocity_m_per_s.data(),
    .driven_velocity_m_per_s = driven_velocity_m_per_s.data(),
    .by_position = by_position.data(),
    .by_velocity = by_velocity.data(),
    .by_force = by_force.data(),
    .by_mass = by_mass.data()});
}

}  // namespace clothfit
#endif
