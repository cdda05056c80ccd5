#pragma once

#include <vector>

#include "model/cloth/cloth.h"
#include "model/rest/hanging_energy.h"

namespace clothfit {

/// Returns a mesh with half as many cells along each side (rounded up). A side with fewer than
/// `least` vertices stays.
Mesh coarser_mesh(const Mesh& mesh, int least);

/// Puts the same cloth on another mesh. Its springs are of the same continuum, natural lengths in
/// the same ratio to the flat ones, each vertex's mass given to the corners of the cell it lies in.
HangingCloth on_mesh(const HangingCloth& cloth, const Mesh& mesh);

/// Returns the same points of the cloth on another mesh.
std::vector<HeldVertexWeights> on_mesh(const std::vector<HeldVertexWeights>& held, const Mesh& from,
                                       const Mesh& to);

/// Returns positions of another mesh's vertices on a shape, 3 x vertices. Each keeps its
/// barycentric coordinates in the triangle of the flat cloth that it lies in [lethanh2007, equation
/// 12]. Cells are cut along `shear_down`.
Eigen::Matrix3Xd transfer_shape(const Mesh& from, const Eigen::Matrix3Xd& position_m,
                                const Mesh& to);

}  // namespace clothfit
