#pragma once

#include <Eigen/Core>

#include "model/fabric/spring_vector.h"

namespace clothfit {

/// The set `fabric` as numbers, both ways, and the continuum that it amounts to.

inline constexpr int kFabricNumbers = 7;
/// Numbers in the order of the struct: tension warp, weft; shear; flexion warp, weft; damping warp,
/// weft.
using FabricVector = Eigen::Matrix<double, kFabricNumbers, 1>;
FabricVector to_vector(const Fabric& fabric);
Fabric fabric_of(const FabricVector& numbers);

/// Returns d springs / d fabric at `fabric`; natural lengths are the mesh's, limits none.
Eigen::Matrix<double, kSpringNumbers, kFabricNumbers> springs_by_fabric(const Fabric& fabric);

/// Finds the fabric nearest to given springs of a mesh. It has their stiffnesses (the mean of both
/// for shear) and the retardation times that come closest to their dampings in least squares (N
/// s/m). Natural lengths other than the mesh's and critical elongations are beyond the set: they
/// stay in the differences. There is no such fabric where dampings ask for a time of springs
/// without stiffness, or for one below 0.
Nearest<Fabric> nearest_fabric(const SpringParameters& springs, const Mesh& mesh);

/// Returns d fabric / d springs at `springs`, whose nearest fabric is usable.
Eigen::Matrix<double, kFabricNumbers, kSpringNumbers> fabric_by_springs(
    const SpringParameters& springs);

/// In-plane stiffness (N/m) of the continuum that a square lattice of a fabric's springs amounts
/// to. It holds away from the edges, whatever the spacing:  C11 = k1 + k23 + 4 k5,  C22 = k0 + k23
/// + 4 k4, C12 = C33 = k23. Axis 1 is s (weft), 2 is t (warp); C33 belongs to the shear angle. The
/// springs are at rest in the flat cloth; Cauchy's relation C12 = C33 holds for every lattice of
/// such springs.
struct Continuum {
  double c11_n_per_m = 0;
  double c22_n_per_m = 0;
  double c12_n_per_m = 0;
  double c33_n_per_m = 0;
};
Continuum continuum(const Fabric& fabric);

}  // namespace clothfit
