#pragma once

#include <Eigen/Core>
#include <array>

#include "model/kernels/aligned_array.h"

namespace clothfit {

/// Several simulations run side by side, one parameter set each. Number l of every group of `count`
/// neighbouring numbers belongs to lane l. Lanes never exchange anything, so a lane's result does
/// not depend on the others.
template <class NumberType, int count>
struct Lanes {
  using Number = NumberType;
  static constexpr int kCount = count;
};

using ExactLanes = Lanes<double, 8>;  ///< strict IEEE, for all results
using FastLanes = Lanes<float, 16>;   ///< estimates and contraction allowed: for screening
using SingleLane = Lanes<double, 1>;  ///< one simulation, `exact` to the same bits

inline constexpr int kLanes = ExactLanes::kCount;

/// One coordinate of every vertex in every lane: lanes x vertices, lane index fastest.
template <class L = ExactLanes>
using LaneArray = AlignedArray<typename L::Number, L::kCount>;

/// A number in every lane.
template <class L = ExactLanes>
using LaneValue = Eigen::Array<typename L::Number, L::kCount, 1>;

/// A vector in every lane.
template <class L = ExactLanes>
struct LaneVector {
  LaneValue<L> x, y, z;
};

/// A vector at every vertex in every lane.
template <class L = ExactLanes>
struct LaneVectors {
  using Number = typename L::Number;
  LaneArray<L> x, y, z;

  static LaneVectors zero(int vertices) {
    return {LaneArray<L>::Zero(L::kCount, vertices), LaneArray<L>::Zero(L::kCount, vertices),
            LaneArray<L>::Zero(L::kCount, vertices)};
  }
  void set_zero() {
    x.setZero();
    y.setZero();
    z.setZero();
  }
  std::array<Number*, 3> data() { return {x.data(), y.data(), z.data()}; }
  std::array<const Number*, 3> data() const { return {x.data(), y.data(), z.data()}; }
  int vertices() const { return static_cast<int>(x.cols()); }
  Eigen::Matrix3Xd lane(int l) const {
    Eigen::Matrix3Xd result(3, x.cols());
    result << x.row(l).matrix().template cast<double>(), y.row(l).matrix().template cast<double>(),
        z.row(l).matrix().template cast<double>();
    return result;
  }
  void set_lane(int l, const Eigen::Matrix3Xd& values) {
    x.row(l) = values.row(0).array().template cast<Number>();
    y.row(l) = values.row(1).array().template cast<Number>();
    z.row(l) = values.row(2).array().template cast<Number>();
  }
};

}  // namespace clothfit
