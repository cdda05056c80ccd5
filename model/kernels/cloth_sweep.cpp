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
  Number* scratch;  ///< kScratchRows rows of columns x kCount
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

/// Three coordinates of the forces that arrive from one row above, and twice three of those from
/// two rows above: one for the row at hand, one for the next.
constexpr int kScratchRows = 9;

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
};

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

/// The pull of a spring to a vertex at `along` that moves with `rate`, both relative to its own.
template <class L>
HWY_INLINE Pull<Vector<L>> pull(const SpringConstants<L>& spring, const Vector3<Vector<L>>& along,
                                const Vector3<Vector<L>>& rate) {
  using V = Vector<L>;
  const V length2 = squared_length(along);
  const V inverse = inverse_square_root(length2);
  if constexpr (kMayContract<V>) {
    // (k (l - l0) + c dl/dt) / l in fewer operations.
    const V stretching = hn::Mul(dot(along, rate), inverse);
    const V against =
        hn::MulSub(spring.damping, stretching, hn::Mul(spring.stiffness, spring.natural_length));
    return {hn::MulAdd(against, inverse, spring.stiffness), along};
  } else {
    const V length = hn::Mul(length2, inverse);
    const V stretching = hn::Mul(dot(along, rate), inverse);
    const V tension = hn::Add(hn::Mul(spring.stiffness, hn::Sub(length, spring.natural_length)),
                              hn::Mul(spring.damping, stretching));
    return {hn::Mul(tension, inverse), along};
  }
}

/// Calls `sink(vertex, element, force, velocity, position)` for every vertex in row-major order,
/// for as many lanes at once as a vector holds. The sink may move the vertex: no spring of a later
/// one reaches back to it.
template <class L, bool kFactors, class Sink>
HWY_INLINE void sweep(const SweepArrays<L>& arrays, const Sink& sink) {
  using Number = typename L::Number;
  using V = Vector<L>;
  const Tag<L> d;
  constexpr std::ptrdiff_t kLanes = L::kCount;
  const std::ptrdiff_t columns = arrays.mesh.columns, rows = arrays.mesh.rows;
  const std::ptrdiff_t width = columns * kLanes;
  // Copies, because the compiler must take a store for one that may change what `arrays` holds.
  const std::array<const Number*, 3> positions = arrays.position_m;
  const std::array<const Number*, 3> velocities = arrays.velocity_m_per_s;
  Number* const scratch = arrays.scratch;
  const auto scratch_rows = [&](int n) HWY_ATTR {
    return std::array<Number*, 3>{scratch + n * width, scratch + (n + 1) * width,
                                  scratch + (n + 2) * width};
  };
  std::fill_n(scratch, kScratchRows * width, Number{0});
  const std::array<Number*, 3> from_above = scratch_rows(0);
  const Pull<V> none{hn::Zero(d), zero(d)};

  for (std::ptrdiff_t lane = 0; lane < kLanes; lane += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    SpringConstants<L> constants[kSpringTypes];
    for (size_t type = 0; type < kSpringTypes; ++type)
      constants[type] = {hn::LoadU(d, arrays.springs.stiffness_n_per_m[type].data() + lane),
                         hn::LoadU(d, arrays.springs.damping_ns_per_m[type].data() + lane),
                         hn::LoadU(d, arrays.springs.natural_length_m[type].data() + lane)};
    for (std::ptrdiff_t i = 0; i < rows; ++i) {
      const std::array<Number*, 3> from_two_above = scratch_rows(i % 2 == 0 ? 3 : 6);
      const bool one_below = i + 1 < rows, two_below = i + 2 < rows;
      // What the vertices just passed sent to the right, and below to the right.
      Pull<V> right = none, right_two = none, right_two_next = none, down_right = none;
      Vector3<V> to_below = zero(d);  // what the vertex below the one just passed has got so far
      for (std::ptrdiff_t j = 0; j < columns; ++j) {
        const std::ptrdiff_t at = j * kLanes + lane, self = i * width + at;
        const std::ptrdiff_t vertex = i * columns + j;
        const Vector3<V> position = load(d, positions, self), velocity = load(d, velocities, self);
        const auto pull_to = [&](size_t type, std::ptrdiff_t offset) HWY_ATTR {
          SpringConstants<L> spring = constants[type];
          if constexpr (kFactors) {
            const SpringFactors<L>& factors = *arrays.factors;
            spring.stiffness =
                hn::Mul(spring.stiffness, hn::Set(d, factors.stiffness[type][vertex]));
            spring.natural_length =
                hn::Mul(spring.natural_length, hn::Set(d, factors.natural_length[type][vertex]));
          }
          return pull(spring, load(d, positions, self + offset) - position,
                      load(d, velocities, self + offset) - velocity);
        };
        Vector3<V> sum = zero(d) - (load(d, from_above, at) + load(d, from_two_above, at));
        sum = sum - right;
        sum = sum - right_two;
        right_two = right_two_next;
        if (j + 1 < columns) {
          right = pull_to(structural_s, kLanes);
          sum = sum + right;
        }
        if (j + 2 < columns) {
          right_two_next = pull_to(flexion_s, 2 * kLanes);
          sum = sum + right_two_next;
        }
        if (two_below) {
          const Pull<V> down_two = pull_to(flexion_t, 2 * width);
          sum = sum + down_two;
          store(force(down_two), d, from_two_above, at);
        }
        if (one_below) {
          if (j > 0) {
            const Pull<V> down_left = pull_to(shear_up, width - kLanes);
            sum = sum + down_left;
            store(to_below + down_left, d, from_above, at - kLanes);
          }
          const Pull<V> down = pull_to(structural_t, width);
          sum = sum + down;
          to_below = force(down) + down_right;
          if (j + 1 < columns) {
            down_right = pull_to(shear_down, width + kLanes);
            sum = sum + down_right;
          } else {
            store(to_below, d, from_above, at);
          }
        }
        sink(vertex, self, sum, velocity, position);
      }
    }
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
    : mesh_(mesh), scratch_(static_cast<size_t>(kScratchRows * mesh.columns) * L::kCount) {}

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
