#include "model/kernels/tangent_sweep.h"

#include <algorithm>
#include <cmath>

#include "model/kernels/spring_reach.h"

// This source is compiled once for each instruction set, in a namespace of its own.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/kernels/tangent_sweep.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "model/kernels/row_sweep-inl.h"

#ifndef CLOTHFIT_MODEL_KERNELS_TANGENT_SWEEP_ONCE
#define CLOTHFIT_MODEL_KERNELS_TANGENT_SWEEP_ONCE
namespace clothfit {
namespace {

using ConstVectors = std::array<const double*, 3>;
using MutableVectors = std::array<double*, 3>;

/// One type's springs, in arrays over the vertices they leave.
struct TypeArrays {
  const double* exists;
  MutableVectors direction, w;
  double *tension_ratio, *elongation_m, *stretching_m_per_s, *stiffness;
};

/// What the coefficients of one type are computed from.
struct LineariseArrays {
  std::ptrdiff_t count, offset;  ///< springs may leave vertices 0 to count - 1 for `offset` further
  ConstVectors position_m, velocity_m_per_s;
  double natural_length_m, stiffness_n_per_m, damping_ns_per_m;
  const double *natural_length_factor, *stiffness_factor;  ///< or null
};

struct TangentArrays {
  Mesh mesh;
  std::array<TypeArrays, kSpringTypes> types;
  std::array<double, kSpringTypes> damping_ns_per_m;
  const LaneSprings<>& springs;  ///< along the directions
  bool any_spring;               ///< whether these are not all zero
  const SpringFactors<SingleLane>* factors;
  ConstVectors position_m, velocity_m_per_s;  ///< along the directions
  double* scratch;
};

struct TangentEuler {
  MutableVectors position_m, velocity_m_per_s;
  ConstVectors gravity_m_per_s2;
  ConstVectors effect_force_n;  ///< or null
  const double* inverse_mass_per_kg;
  double time_step_s;
};

struct TransposedArrays {
  std::ptrdiff_t count, offset;
  double damping_ns_per_m;
  ConstVectors by_force;
  MutableVectors by_along, by_rate;  ///< scratch over all vertices
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

void linearise(const LineariseArrays& from, const TypeArrays& to) {
  for_vectors(from.count, [&](auto d, std::ptrdiff_t e) HWY_ATTR {
    using V = hn::Vec<decltype(d)>;
    const auto constant = [&](double value, const double* factor) HWY_ATTR {
      const V all = hn::Set(d, value);
      return factor == nullptr ? all : hn::Mul(all, hn::LoadU(d, factor + e));
    };
    const V natural = constant(from.natural_length_m, from.natural_length_factor);
    const V stiffness = constant(from.stiffness_n_per_m, from.stiffness_factor);
    const V damping = hn::Set(d, from.damping_ns_per_m);
    const Vector3<V> along =
        load(d, from.position_m, e + from.offset) - load(d, from.position_m, e);
    const Vector3<V> rate =
        load(d, from.velocity_m_per_s, e + from.offset) - load(d, from.velocity_m_per_s, e);
    const V length2 = dot(along, along);
    const V inverse = inverse_square_root(length2);
    const V length = hn::Mul(length2, inverse);
    const Vector3<V> u = inverse * along;
    const V stretching = dot(u, rate);
    const V elongation = hn::Sub(length, natural);
    const V tension = hn::Add(hn::Mul(stiffness, elongation), hn::Mul(damping, stretching));
    const V ratio = hn::Mul(tension, inverse);
    const Vector3<V> across = rate - stretching * u;
    const Vector3<V> w = hn::Sub(stiffness, ratio) * u + hn::Mul(damping, inverse) * across;
    // Nothing where there is no spring, or one that has no direction.
    const auto there = hn::And(hn::Gt(hn::LoadU(d, to.exists + e), hn::Zero(d)),
                               hn::Gt(length2, hn::Set(d, 1e-280)));
    const auto keep = [&](const V& v, double* array)
                          HWY_ATTR { hn::StoreU(hn::IfThenElseZero(there, v), d, array + e); };
    const auto keep3 = [&](const Vector3<V>& v, const MutableVectors& arrays) HWY_ATTR {
      keep(v.x, arrays[0]);
      keep(v.y, arrays[1]);
      keep(v.z, arrays[2]);
    };
    keep3(u, to.direction);
    keep3(w, to.w);
    keep(ratio, to.tension_ratio);
    keep(elongation, to.elongation_m);
    keep(stretching, to.stretching_m_per_s);
    keep(stiffness, to.stiffness);
  });
}

/// How the types' constants change the tensions: not at all, each spring's alike, or by factors.
enum class Constants { still, change, change_by_factors };

/// The derivative of a vertex's position and velocity.
struct Motion {
  Vector3<Vector<ExactLanes>> position, velocity;
};

template <class V>
HWY_INLINE Vector3<V> fused(const V& a, const Vector3<V>& b, const Vector3<V>& c) {
  return {hn::MulAdd(a, b.x, c.x), hn::MulAdd(a, b.y, c.y), hn::MulAdd(a, b.z, c.z)};
}

template <class V>
HWY_INLINE V fused_dot(const Vector3<V>& a, const Vector3<V>& b) {
  return hn::MulAdd(a.z, b.z, hn::MulAdd(a.y, b.y, hn::Mul(a.x, b.x)));
}

template <Constants constants, class Sink>
HWY_INLINE void sweep_tangents(const TangentArrays& arrays, const Sink& sink) {
  using L = ExactLanes;
  using V = Vector<L>;
  const Tag<L> d;
  const ConstVectors positions = arrays.position_m, velocities = arrays.velocity_m_per_s;
  const std::array<TypeArrays, kSpringTypes> types = arrays.types;
  std::fill_n(arrays.scratch, kScratchRows * arrays.mesh.columns * kLanes, 0.0);
  for (std::ptrdiff_t lane = 0; lane < kLanes; lane += static_cast<std::ptrdiff_t>(hn::Lanes(d))) {
    V dampings[kSpringTypes], by_natural[kSpringTypes], by_stiffness[kSpringTypes],
        by_damping[kSpringTypes];
    for (size_t type = 0; type < kSpringTypes; ++type) {
      dampings[type] = hn::Set(d, arrays.damping_ns_per_m[type]);
      by_natural[type] = hn::LoadU(d, arrays.springs.natural_length_m[type].data() + lane);
      by_stiffness[type] = hn::LoadU(d, arrays.springs.stiffness_n_per_m[type].data() + lane);
      by_damping[type] = hn::LoadU(d, arrays.springs.damping_ns_per_m[type].data() + lane);
    }
    const auto motion_at = [&](std::ptrdiff_t element) HWY_ATTR {
      return Motion{load(d, positions, element), load(d, velocities, element)};
    };
    const auto pull_to = [&](size_t type, std::ptrdiff_t vertex, const Motion& here,
                             std::ptrdiff_t element) HWY_ATTR {
      const TypeArrays& of = types[type];
      const auto at = [&](const double* array) HWY_ATTR { return hn::Set(d, array[vertex]); };
      const Motion there = motion_at(element);
      const Vector3<V> along = there.position - here.position;
      const Vector3<V> rate = there.velocity - here.velocity;
      const Vector3<V> u{at(of.direction[0]), at(of.direction[1]), at(of.direction[2])};
      const Vector3<V> w{at(of.w[0]), at(of.w[1]), at(of.w[2])};
      V tension = hn::MulAdd(dampings[type], fused_dot(u, rate), fused_dot(w, along));
      if constexpr (constants != Constants::still) {
        V natural = by_natural[type], stiffness = by_stiffness[type];
        if constexpr (constants == Constants::change_by_factors) {
          natural = hn::Mul(natural, hn::Set(d, arrays.factors->natural_length[type][vertex]));
          stiffness = hn::Mul(stiffness, hn::Set(d, arrays.factors->stiffness[type][vertex]));
        }
        tension = hn::MulAdd(at(of.elongation_m), stiffness, tension);
        tension = hn::MulAdd(at(of.stretching_m_per_s), by_damping[type], tension);
        tension = hn::NegMulAdd(at(of.stiffness), natural, tension);
      }
      return fused(tension, u, at(of.tension_ratio) * along);
    };
    sweep_rows<L>(arrays.mesh, lane, arrays.scratch, motion_at, pull_to, sink);
  }
}

template <class Sink>
HWY_INLINE void sweep_tangents(const TangentArrays& arrays, const Sink& sink) {
  if (!arrays.any_spring)
    sweep_tangents<Constants::still>(arrays, sink);
  else if (arrays.factors == nullptr)
    sweep_tangents<Constants::change>(arrays, sink);
  else
    sweep_tangents<Constants::change_by_factors>(arrays, sink);
}

void add_tangents(const TangentArrays& arrays, const MutableVectors& force_n) {
  using V = Vector<ExactLanes>;
  const Tag<ExactLanes> d;
  const MutableVectors out = force_n;
  sweep_tangents(arrays,
                 [&](std::ptrdiff_t, std::ptrdiff_t self, const Motion&, const Vector3<V>& sum)
                     HWY_ATTR { store(load(d, out, self) + sum, d, out, self); });
}

void step_tangents(const TangentArrays& arrays, const TangentEuler& euler) {
  using V = Vector<ExactLanes>;
  const Tag<ExactLanes> d;
  const TangentEuler to = euler;
  const V h = hn::Set(d, to.time_step_s);
  const bool any_effect = to.effect_force_n[0] != nullptr;
  sweep_tangents(arrays, [&](std::ptrdiff_t vertex, std::ptrdiff_t self, const Motion& motion,
                             const Vector3<V>& springs) HWY_ATTR {
    const Vector3<V> sum = any_effect ? springs + load(d, to.effect_force_n, self) : springs;
    const Vector3<V> gravity = load(d, to.gravity_m_per_s2, self % kLanes);
    const V inverse_mass = hn::Set(d, to.inverse_mass_per_kg[vertex]);
    const Vector3<V> velocity = fused(h, fused(inverse_mass, sum, gravity), motion.velocity);
    store(velocity, d, to.velocity_m_per_s, self);
    store(fused(h, velocity, motion.position), d, to.position_m, self);
  });
}

void transpose(const TypeArrays& of, const TransposedArrays& arrays) {
  for_vectors(arrays.count, [&](auto d, std::ptrdiff_t e) HWY_ATTR {
    using V = hn::Vec<decltype(d)>;
    // What the force pulls one end with it pulls the other against.
    const Vector3<V> by_force =
        load(d, arrays.by_force, e) - load(d, arrays.by_force, e + arrays.offset);
    const auto at = [&](const double* array) HWY_ATTR { return hn::LoadU(d, array + e); };
    const Vector3<V> u = load(d, of.direction, e), w = load(d, of.w, e);
    const V by_tension = dot(u, by_force);
    store(at(of.tension_ratio) * by_force + by_tension * w, d, arrays.by_along, e);
    store(hn::Mul(hn::Set(d, arrays.damping_ns_per_m), by_tension) * u, d, arrays.by_rate, e);
    const auto add = [&](const V& v, double* array) HWY_ATTR {
      hn::StoreU(hn::Add(hn::LoadU(d, array + e), v), d, array + e);
    };
    add(hn::Mul(by_tension, at(of.elongation_m)), arrays.by_stiffness);
    add(hn::Mul(by_tension, at(of.stretching_m_per_s)), arrays.by_damping);
    add(hn::Neg(hn::Mul(by_tension, at(of.stiffness))), arrays.by_natural_length);
  });
}

/// to[v] += share[v - offset] - share[v], shares of vertices 0 to count - 1.
void scatter(std::ptrdiff_t count, std::ptrdiff_t offset, const MutableVectors& share,
             const MutableVectors& to) {
  for (size_t axis = 0; axis < 3; ++axis) {
    const double* const from = share[axis];
    double* const sum = to[axis];
    for_vectors(count, [&](auto d, std::ptrdiff_t e) HWY_ATTR {
      hn::StoreU(hn::Sub(hn::LoadU(d, sum + e), hn::LoadU(d, from + e)), d, sum + e);
    });
    for_vectors(count, [&](auto d, std::ptrdiff_t e) HWY_ATTR {
      hn::StoreU(hn::Add(hn::LoadU(d, sum + offset + e), hn::LoadU(d, from + e)), d,
                 sum + offset + e);
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

HWY_EXPORT(linearise);
HWY_EXPORT(add_tangents);
HWY_EXPORT(step_tangents);
HWY_EXPORT(transpose);
HWY_EXPORT(scatter);

constexpr size_t kScratchRows = 9;  // as sweep_rows needs

TypeArrays arrays_of(TangentSweep::Coefficients& c) {
  const auto three = [](std::array<std::vector<double>, 3>& v) {
    return MutableVectors{v[0].data(), v[1].data(), v[2].data()};
  };
  return {.exists = c.exists.data(),
          .direction = three(c.direction),
          .w = three(c.w),
          .tension_ratio = c.tension_ratio.data(),
          .elongation_m = c.elongation_m.data(),
          .stretching_m_per_s = c.stretching_m_per_s.data(),
          .stiffness = c.stiffness.data()};
}

bool any_change(const LaneSprings<>& springs) {
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
    Coefficients& c = coefficients_[type];
    const std::vector<double> none(vertices, 0.0);
    c = {none, {none, none, none}, {none, none, none}, none, none, none, none};
    for (int i = 0; i < mesh.rows; ++i)
      for (int j = 0; j < mesh.columns; ++j)
        if (kSpringReach[type].leaves(mesh, i, j))
          c.exists[static_cast<size_t>(mesh.vertex(i, j))] = 1;
  }
  scratch_.resize(
      std::max(kScratchRows * static_cast<size_t>(mesh.columns) * kLanes, 6 * vertices));
}

void TangentSweep::linearise(const LaneSprings<SingleLane>& springs,
                             const LaneVectors<SingleLane>& position_m,
                             const LaneVectors<SingleLane>& velocity_m_per_s,
                             const SpringFactors<SingleLane>* factors) {
  factors_ = factors;
  for (size_t type = 0; type < kSpringTypes; ++type) {
    damping_ns_per_m_[type] = springs.damping_ns_per_m[type][0];
    const std::ptrdiff_t offset = kSpringReach[type].offset(mesh_);
    const LineariseArrays from{
        .count = std::max<std::ptrdiff_t>(mesh_.vertex_count() - offset, 0),
        .offset = offset,
        .position_m = position_m.data(),
        .velocity_m_per_s = velocity_m_per_s.data(),
        .natural_length_m = springs.natural_length_m[type][0],
        .stiffness_n_per_m = springs.stiffness_n_per_m[type][0],
        .damping_ns_per_m = springs.damping_ns_per_m[type][0],
        .natural_length_factor =
            factors != nullptr ? factors->natural_length[type].data() : nullptr,
        .stiffness_factor = factors != nullptr ? factors->stiffness[type].data() : nullptr};
    HWY_DYNAMIC_DISPATCH(linearise)(from, arrays_of(coefficients_[type]));
  }
}

namespace {

TangentArrays tangent_arrays(const Mesh& mesh,
                             std::array<TangentSweep::Coefficients, kSpringTypes>& coefficients,
                             const std::array<double, kSpringTypes>& damping_ns_per_m,
                             const LaneSprings<>& springs, const SpringFactors<SingleLane>* factors,
                             const LaneVectors<>& position_m, const LaneVectors<>& velocity_m_per_s,
                             std::vector<double>& scratch) {
  TangentArrays arrays{.mesh = mesh,
                       .types = {},
                       .damping_ns_per_m = damping_ns_per_m,
                       .springs = springs,
                       .any_spring = any_change(springs),
                       .factors = factors,
                       .position_m = position_m.data(),
                       .velocity_m_per_s = velocity_m_per_s.data(),
                       .scratch = scratch.data()};
  for (size_t type = 0; type < kSpringTypes; ++type)
    arrays.types[type] = arrays_of(coefficients[type]);
  return arrays;
}

}  // namespace

void TangentSweep::step_euler(const LaneSprings<>& springs, const LaneVector<>& gravity,
                              const Eigen::VectorXd& inverse_mass_per_kg,
                              const LaneVectors<>* effect_force_n, double time_step_s,
                              LaneVectors<>& position_m, LaneVectors<>& velocity_m_per_s) {
  const TangentEuler euler{
      .position_m = position_m.data(),
      .velocity_m_per_s = velocity_m_per_s.data(),
      .gravity_m_per_s2 = {gravity.x.data(), gravity.y.data(), gravity.z.data()},
      .effect_force_n = effect_force_n != nullptr ? effect_force_n->data() : ConstVectors{},
      .inverse_mass_per_kg = inverse_mass_per_kg.data(),
      .time_step_s = time_step_s};
  HWY_DYNAMIC_DISPATCH(step_tangents)
  (tangent_arrays(mesh_, coefficients_, damping_ns_per_m_, springs, factors_, position_m,
                  velocity_m_per_s, scratch_),
   euler);
}

void TangentSweep::add_spring_forces(const LaneSprings<>& springs, const LaneVectors<>& position_m,
                                     const LaneVectors<>& velocity_m_per_s,
                                     LaneVectors<>& force_n) {
  HWY_DYNAMIC_DISPATCH(add_tangents)
  (tangent_arrays(mesh_, coefficients_, damping_ns_per_m_, springs, factors_, position_m,
                  velocity_m_per_s, scratch_),
   force_n.data());
}

void TangentSweep::add_transposed(const LaneVectors<SingleLane>& by_force,
                                  LaneVectors<SingleLane>& by_position,
                                  LaneVectors<SingleLane>& by_velocity,
                                  SpringGradients& by_springs) {
  const std::ptrdiff_t vertices = mesh_.vertex_count();
  const auto scratch = [&](std::ptrdiff_t n) {
    double* const first = scratch_.data() + 3 * n * vertices;
    return MutableVectors{first, first + vertices, first + 2 * vertices};
  };
  for (size_t type = 0; type < kSpringTypes; ++type) {
    const std::ptrdiff_t offset = kSpringReach[type].offset(mesh_);
    const TransposedArrays arrays{.count = std::max<std::ptrdiff_t>(vertices - offset, 0),
                                  .offset = offset,
                                  .damping_ns_per_m = damping_ns_per_m_[type],
                                  .by_force = by_force.data(),
                                  .by_along = scratch(0),
                                  .by_rate = scratch(1),
                                  .by_natural_length = by_springs.natural_length_m[type].data(),
                                  .by_stiffness = by_springs.stiffness_n_per_m[type].data(),
                                  .by_damping = by_springs.damping_ns_per_m[type].data()};
    HWY_DYNAMIC_DISPATCH(transpose)(arrays_of(coefficients_[type]), arrays);
    HWY_DYNAMIC_DISPATCH(scatter)(arrays.count, offset, arrays.by_along, by_position.data());
    HWY_DYNAMIC_DISPATCH(scatter)(arrays.count, offset, arrays.by_rate, by_velocity.data());
  }
}

}  // namespace clothfit
#endif
