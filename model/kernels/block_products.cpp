#include "model/kernels/block_products.h"

#include <type_traits>

// This source is compiled once for each instruction set, in a namespace of its own.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/kernels/block_products.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "model/kernels/lane_vector-inl.h"

#ifndef CLOTHFIT_MODEL_KERNELS_BLOCK_PRODUCTS_ONCE
#define CLOTHFIT_MODEL_KERNELS_BLOCK_PRODUCTS_ONCE
namespace clothfit {
namespace {

template <class L>
using ConstVectors = std::array<const typename L::Number*, 3>;
template <class L>
using MutableVectors = std::array<typename L::Number*, 3>;

}  // namespace
}  // namespace clothfit
#endif

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

/// Calls `visit(first)` for each vector of the lanes, with the place of its first number.
template <class L, class Visit>
HWY_INLINE void for_parts(const Visit& visit) {
  const auto step = static_cast<std::ptrdiff_t>(hn::Lanes(Tag<L>()));
  for (std::ptrdiff_t lane = 0; lane < L::kCount; lane += step) visit(lane);
}

/// Returns the number in every lane.
template <class L>
HWY_INLINE Vector<L> set(double number) {
  return hn::Set(Tag<L>(), static_cast<typename L::Number>(number));
}

/// Returns a b + c, a vector times a number.
template <class L>
HWY_INLINE Vector3<Vector<L>> scaled_sum(const Eigen::Vector3d& a, const Vector<L>& b,
                                         const Vector3<Vector<L>>& c) {
  return {rounded_mul_add(set<L>(a.x()), b, c.x), rounded_mul_add(set<L>(a.y()), b, c.y),
          rounded_mul_add(set<L>(a.z()), b, c.z)};
}

/// Returns a . b + c.
template <class L>
HWY_INLINE Vector<L> product_sum(const Eigen::Vector3d& a, const Vector3<Vector<L>>& b,
                                 const Vector<L>& c) {
  return rounded_mul_add(
      set<L>(a.z()), b.z,
      rounded_mul_add(set<L>(a.y()), b.y, rounded_mul_add(set<L>(a.x()), b.x, c)));
}

/// Returns A b + c.
template <class L>
HWY_INLINE Vector3<Vector<L>> product_sum(const Eigen::Matrix3d& a, const Vector3<Vector<L>>& b,
                                          const Vector3<Vector<L>>& c) {
  return scaled_sum<L>(a.col(2), b.z,
                       scaled_sum<L>(a.col(1), b.y, scaled_sum<L>(a.col(0), b.x, c)));
}

template <class L>
HWY_INLINE void add_motion_products(std::span<const MotionBlock> blocks, ConstVectors<L> position_m,
                                    ConstVectors<L> velocity_m_per_s, MutableVectors<L> action) {
  const Tag<L> d;
  for (const MotionBlock& block : blocks) {
    const bool by_velocity = !block.by_velocity.isZero(0);
    for_parts<L>([&](std::ptrdiff_t lane) HWY_ATTR {
      const std::ptrdiff_t of = L::kCount * block.of + lane, on = L::kCount * block.on + lane;
      Vector3<Vector<L>> sum =
          product_sum<L>(block.by_position, load(d, position_m, of), load(d, action, on));
      if (by_velocity) sum = product_sum<L>(block.by_velocity, load(d, velocity_m_per_s, of), sum);
      store(sum, d, action, on);
    });
  }
}

template <class L>
HWY_INLINE void add_spring_products(std::span<const SpringJacobian> springs,
                                    const typename L::Number* tension_n, ConstVectors<L> position_m,
                                    ConstVectors<L> velocity_m_per_s, MutableVectors<L> action) {
  const Tag<L> d;
  for (size_t n = 0; n < springs.size(); ++n) {
    const SpringJacobian& spring = springs[n];
    for_parts<L>([&](std::ptrdiff_t lane) HWY_ATTR {
      const std::ptrdiff_t a = L::kCount * spring.a + lane, b = L::kCount * spring.b + lane;
      const auto along = load(d, position_m, b) - load(d, position_m, a);
      const auto rate = load(d, velocity_m_per_s, b) - load(d, velocity_m_per_s, a);
      const Vector<L> stretching = product_sum<L>(spring.direction, rate, hn::Zero(d));
      const Vector<L> more =
          hn::LoadU(d, tension_n + L::kCount * static_cast<std::ptrdiff_t>(n) + lane);
      const Vector<L> tension =
          product_sum<L>(spring.w_n_per_m, along,
                         rounded_mul_add(set<L>(spring.damping_ns_per_m), stretching, more));
      const auto turned = set<L>(spring.tension_ratio_n_per_m) * along;
      const auto pull = scaled_sum<L>(spring.direction, tension, turned);
      store(load(d, action, a) + pull, d, action, a);
      store(load(d, action, b) - pull, d, action, b);
    });
  }
}

template <class L>
HWY_INLINE void add_force_products(std::span<const ForceBlock> blocks, ConstVectors<L> force_n,
                                   MutableVectors<L> action) {
  const Tag<L> d;
  for (const ForceBlock& block : blocks)
    for_parts<L>([&](std::ptrdiff_t lane) HWY_ATTR {
      const std::ptrdiff_t on = L::kCount * block.on + lane;
      store(product_sum<L>(block.derivative, load(d, force_n, on), load(d, action, on)), d, action,
            on);
    });
}

#define CLOTHFIT_INSTANTIATE(L, name)                                                              \
  void add_motion_products_##name(std::span<const MotionBlock> blocks, ConstVectors<L> position_m, \
                                  ConstVectors<L> velocity_m_per_s, MutableVectors<L> action) {    \
    add_motion_products<L>(blocks, position_m, velocity_m_per_s, action);                          \
  }                                                                                                \
  void add_spring_products_##name(std::span<const SpringJacobian> springs,                         \
                                  const L::Number* tension_n, ConstVectors<L> position_m,          \
                                  ConstVectors<L> velocity_m_per_s, MutableVectors<L> action) {    \
    add_spring_products<L>(springs, tension_n, position_m, velocity_m_per_s, action);              \
  }                                                                                                \
  void add_force_products_##name(std::span<const ForceBlock> blocks, ConstVectors<L> force_n,      \
                                 MutableVectors<L> action) {                                       \
    add_force_products<L>(blocks, force_n, action);                                                \
  }
CLOTHFIT_INSTANTIATE(ExactLanes, exact)
CLOTHFIT_INSTANTIATE(FastLanes, fast)
#undef CLOTHFIT_INSTANTIATE

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace clothfit {
namespace {
HWY_EXPORT(add_motion_products_exact);
HWY_EXPORT(add_motion_products_fast);
HWY_EXPORT(add_spring_products_exact);
HWY_EXPORT(add_spring_products_fast);
HWY_EXPORT(add_force_products_exact);
HWY_EXPORT(add_force_products_fast);
}  // namespace

template <class L>
void add_products(std::span<const MotionBlock> blocks, const LaneVectors<L>& position_m,
                  const LaneVectors<L>& velocity_m_per_s, LaneVectors<L>& action) {
  if constexpr (std::is_same_v<L, ExactLanes>) HWY_DYNAMIC_DISPATCH(add_motion_products_exact)
  (blocks, position_m.data(), velocity_m_per_s.data(), action.data());
  else HWY_DYNAMIC_DISPATCH(add_motion_products_fast)(blocks, position_m.data(),
                                                      velocity_m_per_s.data(), action.data());
}

template <class L>
void add_products(std::span<const SpringJacobian> springs, const LaneArray<L>& tension_n,
                  const LaneVectors<L>& position_m, const LaneVectors<L>& velocity_m_per_s,
                  LaneVectors<L>& action) {
  if constexpr (std::is_same_v<L, ExactLanes>) HWY_DYNAMIC_DISPATCH(add_spring_products_exact)
  (springs, tension_n.data(), position_m.data(), velocity_m_per_s.data(), action.data());
  else HWY_DYNAMIC_DISPATCH(add_spring_products_fast)(springs, tension_n.data(), position_m.data(),
                                                      velocity_m_per_s.data(), action.data());
}

template <class L>
void add_products(std::span<const ForceBlock> blocks, const LaneVectors<L>& force_n,
                  LaneVectors<L>& action) {
  if constexpr (std::is_same_v<L, ExactLanes>)
    HWY_DYNAMIC_DISPATCH(add_force_products_exact)(blocks, force_n.data(), action.data());
  else
    HWY_DYNAMIC_DISPATCH(add_force_products_fast)(blocks, force_n.data(), action.data());
}

#define CLOTHFIT_INSTANTIATE(L)                                                              \
  template void add_products(std::span<const MotionBlock>, const LaneVectors<L>&,            \
                             const LaneVectors<L>&, LaneVectors<L>&);                        \
  template void add_products(std::span<const SpringJacobian>, const LaneArray<L>&,           \
                             const LaneVectors<L>&, const LaneVectors<L>&, LaneVectors<L>&); \
  template void add_products(std::span<const ForceBlock>, const LaneVectors<L>&, LaneVectors<L>&);
CLOTHFIT_INSTANTIATE(ExactLanes)
CLOTHFIT_INSTANTIATE(FastLanes)
#undef CLOTHFIT_INSTANTIATE

}  // namespace clothfit
#endif
