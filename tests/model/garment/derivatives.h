#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <random>
#include <vector>

#include "model/sheet/block_energy.h"

namespace clothfit {

/// Returns positions that are each moved by up to `by_m` along each axis, always the same way.
inline Eigen::Matrix3Xd shaken(Eigen::Matrix3Xd position_m, double by_m) {
  std::mt19937 random(5);
  for (double& x : position_m.reshaped()) x += by_m * (static_cast<double>(random()) / 0x1p31 - 1);
  return position_m;
}

/// Expects gradient and second derivative as differences give them.
inline void expect_derivatives(const BlockEnergy& energy, const Eigen::Matrix3Xd& position_m,
                               double relative) {
  Eigen::Matrix3Xd gradient, above, below;
  energy.energy_and_gradient(position_m, gradient);
  std::vector<Eigen::Matrix3d> blocks;
  energy.second_derivative(position_m, Curvature::exact, blocks);
  const Eigen::Matrix3Xd direction = shaken(Eigen::Matrix3Xd::Zero(3, position_m.cols()), 1);
  Eigen::Matrix3Xd product = Eigen::Matrix3Xd::Zero(3, position_m.cols());
  for (size_t p = 0; p < blocks.size(); ++p) {
    const auto [low, high] = energy.pairs()[p];
    product.col(high) += blocks[p] * direction.col(low);
    if (low != high) product.col(low) += blocks[p].transpose() * direction.col(high);
  }
  constexpr double kStep_m = 1e-7;
  const double up = energy.energy_and_gradient(position_m + kStep_m * direction, above),
               down = energy.energy_and_gradient(position_m - kStep_m * direction, below);
  EXPECT_NEAR((up - down) / (2 * kStep_m), gradient.cwiseProduct(direction).sum(),
              1e-6 * gradient.norm() * direction.norm());
  EXPECT_LT((product - (above - below) / (2 * kStep_m)).norm(), relative * product.norm());
}

}  // namespace clothfit
