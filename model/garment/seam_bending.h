#pragma once

#include <vector>

#include "model/fabric/measured_fabric.h"
#include "model/garment/garment_mesh.h"
#include "model/sheet/plate_bending.h"

namespace clothfit {

/// Returns the rows that bending across the seams adds to bending_matrix() of a garment's cloth.
/// A seam bends as uncut cloth does: with x_a and x_b one spacing h beside a joint x of its sides,
/// square to it,
///
///   E = 1/2 sum over joints B l h |(x_a - 2 x + x_b) / h^2|^2,
///
/// l being the seam's length at the joint and B the mean of both sides' stiffness along warp and
/// weft. Joints whose neighbours lie outside the cloth, as at the tip of a dart, are left out.
BendingMatrix seam_bending(const GarmentMesh& mesh, const std::vector<MeasuredFabric>& fabrics);

}  // namespace clothfit
