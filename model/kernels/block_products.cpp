#include "model/kernels/block_products.h"

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

using ConstVectors = std::array<const double*, 3>;
using MutableVectors = std::array<double*, 3>;

}  // namespace
}  // namespace clothfit
#endif

HWY_BEFORE_NAMESPACE();
namespace clothfit {
namespace {
namespace HWY_NAMESPACE {

using LanesTag = Tag<ExactLanes>;
using LaneNumbers = Vector<ExactLanes>;

/// Calls `visit(first)` for each vector of the lanes, with the place of its first number.
template <class Visit>
HWY_INLINE void for_parts(const Visit& visit) {
  const auto step = static_cast<std::ptrdiff_t>(hn::Lanes(LanesTag()));
  for (std::ptrdiff_t lane = 0; lane < kLanes; lane += step) visit(lane);
}

/// Returns a b + c, a vector times a number.
HWY_INLINE Vector3<LaneNumbers> scaled_sum(const Eigen::Vector3d& a, const LaneNumbers& b,
                                           const Vector3<LaneNumbers>& c) {
  const LanesTag d;
  return {hn::MulAdd(hn::Set(d, a.x()), b, c.x), hn::MulAdd(hn::Set(d, a.y()), b, c.y),
          hn::MulAdd(hn::Set(d, a.z()), b, c.z)};
}

/// Returns a . b + c.
HWY_INLINE LaneNumbers product_sum(const Eigen::Vector3d& a, const Vector3<LaneNumbers>& b,
                                   const LaneNumbers& c) {
  const LanesTag d;
  return hn::MulAdd(hn::Set(d, a.z()), b.z,
                    hn::MulAdd(hn::Set(d, a.y()), b.y, hn::MulAdd(hn::Set(d, a.x()), b.x, c)));
}

/// Returns A b + c.
HWY_INLINE Vector3<LaneNumbers> product_sum(const Eigen::Matrix3d& a, const Vector3<LaneNumbers>& b,
                                            const Vector3<LaneNumbers>& c) {
  return scaled_sum(a.col(2), b.z, scaled_sum(a.col(1), b.y, scaled_sum(a.col(0), b.x, c)));
}

void add_motion_products(std::span<const MotionBlock> blocks, ConstVectors position_m,
                         ConstVectors velocity_m_per_s, MutableVectors action) {
  const LanesTag d;
  for (const MotionBlock& block : blocks) {
    const bool by_velocity = !block.by_velocity.isZero(0);
    for_parts([&](std::ptrdiff_t lane) {
      const std::ptrdiff_t of = kLanes * block.of + lane, on = kLanes * block.on + lane;
      Vector3<LaneNumbers> sum =
          product_sum(block.by_position, load(d, position_m, of), load(d, action, on));
      if (by_velocity) sum = product_sum(block.by_velocity, load(d, velocity_m_per_s, of), sum);
      store(sum, d, action, on);
    });
  }
}

void add_spring_products(std::span<const SpringJacobian> springs, const double* tension_n,
                         ConstVectors position_m, ConstVectors velocity_m_per_s,
                         MutableVectors action) {
  const LanesTag d;
  for (size_t n = 0; n < springs.size(); ++n) {
    const SpringJacobian& spring = springs[n];
    for_parts([&](std::ptrdiff_t lane) {
      const std::ptrdiff_t a = kLanes * spring.a + lane, b = kLanes * spring.b + lane;
      const Vector3<LaneNumbers> along = load(d, position_m, b) - load(d, position_m, a);
      const Vector3<LaneNumbers> rate = load(d, velocity_m_per_s, b) - load(d, velocity_m_per_s, a);
      const LaneNumbers stretching = product_sum(spring.direction, rate, hn::Zero(d));
      const LaneNumbers more =
          hn::LoadU(d, tension_n + kLanes * static_cast<std::ptrdiff_t>(n) + lane);
      const LaneNumbers tension =
          product_sum(spring.w_n_per_m, along,
                      hn::MulAdd(hn::Set(d, spring.damping_ns_per_m), stretching, more));
      const Vector3<LaneNumbers> turned = hn::Set(d, spring.tension_ratio_n_per_m) * along;
      const Vector3<LaneNumbers> pull = scaled_sum(spring.direction, tension, turned);
      store(load(d, action, a) + pull, d, action, a);
      store(load(d, action, b) - pull, d, action, b);
    });
  }
}

void add_force_products(std::span<const ForceBlock> blocks, ConstVectors force_n,
                        MutableVectors action) {
  const LanesTag d;
  for (const ForceBlock& block : blocks)
    for_parts([&](std::ptrdiff_t lane) {
      const std::ptrdiff_t on = kLanes * block.on + lane;
      store(product_sum(block.derivative, load(d, force_n, on), load(d, action, on)), d, action,
            on);
    });
}

}  // namespace HWY_NAMESPACE
}  // namespace
}  // namespace clothfit
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace clothfit {
namespace {
HWY_EXPORT(add_motion_products);
HWY_EXPORT(add_spring_products);
HWY_EXPORT(add_force_products);
}  // namespace

void add_products(std::span<const MotionBlock> blocks, const LaneVectors<>& position_m,
                  const LaneVectors<>& velocity_m_per_s, LaneVectors<>& action) {
  HWY_DYNAMIC_DISPATCH(add_motion_products)
  (blocks, position_m.data(), velocity_m_per_s.data(), action.data());
}

void add_products(std::span<const SpringJacobian> springs, const LaneArray<>& tension_n,
                  const LaneVectors<>& position_m, const LaneVectors<>& velocity_m_per_s,
                  LaneVectors<>& action) {
  HWY_DYNAMIC_DISPATCH(add_spring_products)
  (springs, tension_n.data(), position_m.data(), velocity_m_per_s.data(), action.data());
}

void add_products(std::span<const ForceBlock> blocks, const LaneVectors<>& force_n,
                  LaneVectors<>& action) {
  HWY_DYNAMIC_DISPATCH(add_force_products)(blocks, force_n.data(), action.data());
}

}  // namespace clothfit
#endif
