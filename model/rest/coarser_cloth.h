#pragma once

#include <vector>

#include "model/cloth/cloth.h"
#include "model/rest/hanging_energy.h"

namespace clothfit {

/// Half as many cells along each side of the mesh (rounded up), where a side has at least `least`
/// vertices.
Mesh coarser_mesh(const Mesh& mesh, int least);

/// The same cloth on another mesh: springs of the same continuum, natural lengths in the same ratio
/// to the flat ones, each vertex's mass given to the corners of the cell it lies in.
HangingCloth on_mesh(const HangingCloth& cloth, const Mesh& mesh);

/// The same points of the cloth on another mesh.
std::vector<HeldVertexWeights> on_mesh(const std::vector<HeldVertexWeights>& held, const Mesh& from,
                                       const Mesh& to);

/// Positions of another mesh's vertices on a shape: each keeps its barycentric coordinates in the
/// triangle of the flat cloth that it lies in [lethanh2007, equation 12]. Cells are cut along
/// `shear_down`. 3 x vertices.
Eigen::Matrix3Xd transfer_shape(const Mesh& from, const Eigen::Matrix3Xd& position_m,
                                const Mesh& to);

}  // namespace clothfit
