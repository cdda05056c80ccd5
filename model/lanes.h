#pragma once

#include <Eigen/Core>
#include <array>

namespace clothfit {

/// Several simulations run side by side, one parameter set each: number l of every group of
/// kLanes neighbouring doubles belongs to lane l. Lanes never exchange anything, so a lane's result
/// does not depend on what the others carry.
inline constexpr int kLanes = 8;

/// One coordinate of every vertex in every lane: kLanes x vertices, lane index fastest.
using LaneArray = Eigen::Array<double, kLanes, Eigen::Dynamic>;

/// A number in every lane.
using LaneValue = Eigen::Array<double, kLanes, 1>;

/// A vector at every vertex in every lane.
struct LaneVectors {
  LaneArray x, y, z;

  static LaneVectors zero(int vertices) {
    return {LaneArray::Zero(kLanes, vertices), LaneArray::Zero(kLanes, vertices),
            LaneArray::Zero(kLanes, vertices)};
  }
  void set_zero() {
    x.setZero();
    y.setZero();
    z.setZero();
  }
  std::array<double*, 3> data() { return {x.data(), y.data(), z.data()}; }
  std::array<const double*, 3> data() const { return {x.data(), y.data(), z.data()}; }
  int vertices() const { return static_cast<int>(x.cols()); }
  Eigen::Matrix3Xd lane(int l) const {
    Eigen::Matrix3Xd result(3, x.cols());
    result << x.row(l).matrix(), y.row(l).matrix(), z.row(l).matrix();
    return result;
  }
  void set_lane(int l, const Eigen::Matrix3Xd& values) {
    x.row(l) = values.row(0).array();
    y.row(l) = values.row(1).array();
    z.row(l) = values.row(2).array();
  }
};

}  // namespace clothfit
