#pragma once

#include <Eigen/SparseCore>
#include <array>
#include <vector>

#include "model/fabric/measured_fabric.h"
#include "model/topology/cloth_mesh.h"

namespace clothfit {

/// A second derivative of a field over the flat cloth, from its values at some vertices.
struct SecondDifference {
  enum Of { weft, warp, twist };  ///< by_ss, by_tt, by_st
  Of of = weft;
  std::vector<int> vertex;
  std::vector<double> per_m2;  ///< coefficients of the values
  double area_m2 = 0;          ///< for which it stands
};

/// Returns the second differences of a mesh. Together they stand for all of the cloth, but for
/// what lies across free edges of squares, which carry no moment.
///
/// Inside the lattice they are central, the mixed ones one per square, as in the effect
/// `bending_energy`. At vertices of triangles they come from the quadratic polynomial that fits the
/// vertices around best: exact for quadratic fields.
///
/// At a `clamped` vertex (one entry per vertex; empty: none) value and slope are known. The field
/// is then the displacement from the clamp's plane, which vanishes there with its slopes, and the
/// polynomial has its quadratic part only.
std::vector<SecondDifference> second_differences(const ClothMesh& mesh,
                                                 const std::vector<bool>& clamped = {});

/// Returns the matrix D, differences x vertices, of the energy of bending (D in (N/m)^(1/2)),
///
///   E = 1/2 sum over axes |D x|^2 = 1/2 integral B_s |x_ss|^2 + B_t |x_tt|^2 + 2 B_st |x_st|^2 dA
///
/// with B_s the stiffness along the weft, B_t along the warp and B_st their geometric mean, which
/// an isotropic plate without lateral contraction has [timoshenko1959]. Where vertices are clamped,
/// x is the displacement from the plane of the clamps; else also the place, for D sees no linear
/// field. A sum of squares keeps the digits that x' D' D x loses on fine meshes.
using BendingMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;
BendingMatrix bending_matrix(const ClothMesh& mesh, const MeasuredFabric& fabric,
                             const std::vector<bool>& clamped = {});
/// The same for a cloth of several fabrics: `fabric_of` has one index of `fabrics` per vertex.
BendingMatrix bending_matrix(const ClothMesh& mesh, const std::vector<MeasuredFabric>& fabrics,
                             const std::vector<int>& fabric_of,
                             const std::vector<bool>& clamped = {});

}  // namespace clothfit
