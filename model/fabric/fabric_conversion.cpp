#include "model/fabric/fabric_conversion.h"

#include <array>
#include <cassert>

#include "data/algebra/dense_factors.h"

namespace clothfit {
namespace {

/// Index of a type's stiffness among the fabric's.
constexpr std::array<int, kSpringTypes> kStiffnessOf = {0, 1, 2, 2, 3, 4};

/// Shares of the warp's and the weft's retardation time in a type's.
using Shares = Eigen::Matrix<double, kSpringTypes, 2>;
Shares damping_shares() {
  return Shares{{1, 0}, {0, 1}, {0.5, 0.5}, {0.5, 0.5}, {1, 0}, {0, 1}};
}

/// damping = times: a row for every type, stiffness times share.
using DampingMatrix = Eigen::Matrix<double, kSpringTypes, 2>;

struct Parts {
  Eigen::Matrix<double, kSpringTypes, 1> stiffness;  ///< of each type in the nearest fabric
  Eigen::Matrix<double, kSpringTypes, 1> damping;
  DampingMatrix by_times;
};

Parts parts_of(const SpringParameters& springs) {
  const auto& k = springs.stiffness_n_per_m;
  Parts parts;
  const double shear = 0.5 * (k[shear_down] + k[shear_up]);
  parts.stiffness << k[0], k[1], shear, shear, k[4], k[5];
  parts.damping =
      Eigen::Map<const Eigen::Matrix<double, kSpringTypes, 1>>(springs.damping_ns_per_m.data());
  parts.by_times = parts.stiffness.asDiagonal() * damping_shares();
  return parts;
}

}  // namespace

FabricVector to_vector(const Fabric& fabric) {
  FabricVector numbers;
  numbers << fabric.tension_warp_n_per_m, fabric.tension_weft_n_per_m, fabric.shear_n_per_m,
      fabric.flexion_warp_n_per_m, fabric.flexion_weft_n_per_m, fabric.damping_warp_s,
      fabric.damping_weft_s;
  return numbers;
}

Fabric fabric_of(const FabricVector& numbers) {
  return {.tension_warp_n_per_m = numbers[0],
          .tension_weft_n_per_m = numbers[1],
          .shear_n_per_m = numbers[2],
          .flexion_warp_n_per_m = numbers[3],
          .flexion_weft_n_per_m = numbers[4],
          .damping_warp_s = numbers[5],
          .damping_weft_s = numbers[6]};
}

Eigen::Matrix<double, kSpringNumbers, kFabricNumbers> springs_by_fabric(const Fabric& fabric) {
  const FabricVector numbers = to_vector(fabric);
  const Shares shares = damping_shares();
  Eigen::Matrix<double, kSpringNumbers, kFabricNumbers> result;
  result.setZero();
  for (int type = 0; type < kSpringTypes; ++type) {
    const int k = kStiffnessOf[static_cast<size_t>(type)];
    result(stiffness_block + type, k) = 1;
    result(damping_block + type, k) = shares.row(type) * numbers.tail<2>();
    result.block<1, 2>(damping_block + type, 5) = numbers[k] * shares.row(type);
  }
  return result;
}

Nearest<Fabric> nearest_fabric(const SpringParameters& springs, const Mesh& mesh) {
  const Parts parts = parts_of(springs);
  Nearest<Fabric> nearest;
  FabricVector numbers;
  numbers << parts.stiffness[0], parts.stiffness[1], parts.stiffness[2], parts.stiffness[4],
      parts.stiffness[5], 0, 0;
  // If no stiffness determines a time, the smallest time is taken.
  const LeastNormFactors solver(parts.by_times);
  numbers.tail<2>() = solver.solve(parts.damping);
  if (solver.rank() == 0 && parts.damping.cwiseAbs().maxCoeff() > 0)
    nearest.reason = "there is damping but no stiffness: no retardation time says that";
  if ((numbers.tail<2>().array() < 0).any())
    nearest.reason = "the retardation times nearest to these dampings are below 0";
  nearest.set = fabric_of(numbers);
  measure_differences(springs, spring_parameters(nearest.set, mesh), nearest);
  return nearest;
}

Eigen::Matrix<double, kFabricNumbers, kSpringNumbers> fabric_by_springs(
    const SpringParameters& springs) {
  Eigen::Matrix<double, kFabricNumbers, kSpringNumbers> result;
  result.setZero();
  for (int type = 0; type < kSpringTypes; ++type) {
    const bool shear = type == shear_down || type == shear_up;
    result(kStiffnessOf[static_cast<size_t>(type)], stiffness_block + type) = shear ? 0.5 : 1;
  }
  // The times x solve A' A x = A' c with A = diag(k) S, so that
  //   A' A dx = dA' (c - A x) + A' (dc - dA x).
  const Parts parts = parts_of(springs);
  const DampingMatrix& a = parts.by_times;
  const Eigen::Matrix2d normal = a.transpose() * a;
  const Eigen::Vector2d times = LeastNormFactors(a).solve(parts.damping);
  const Eigen::Matrix<double, kSpringTypes, 1> left = parts.damping - a * times;
  const Eigen::Matrix2d inverse = LeastNormFactors(normal).pseudo_inverse();
  result.block<2, kSpringTypes>(5, damping_block) = inverse * a.transpose();
  const Shares shares = damping_shares();
  for (int type = 0; type < kSpringTypes; ++type) {
    DampingMatrix da = DampingMatrix::Zero();
    if (type == shear_down || type == shear_up)
      da.middleRows<2>(shear_down) = 0.5 * shares.middleRows<2>(shear_down);
    else
      da.row(type) = shares.row(type);
    result.block<2, 1>(5, stiffness_block + type) =
        inverse * (da.transpose() * left - a.transpose() * (da * times));
  }
  return result;
}

Continuum continuum(const Fabric& fabric) {
  return {.c11_n_per_m =
              fabric.tension_weft_n_per_m + fabric.shear_n_per_m + 4 * fabric.flexion_weft_n_per_m,
          .c22_n_per_m =
              fabric.tension_warp_n_per_m + fabric.shear_n_per_m + 4 * fabric.flexion_warp_n_per_m,
          .c12_n_per_m = fabric.shear_n_per_m,
          .c33_n_per_m = fabric.shear_n_per_m};
}

}  // namespace clothfit
