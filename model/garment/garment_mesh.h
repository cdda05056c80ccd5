#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "data/sewing_pattern.h"
#include "model/topology/cloth_mesh.h"
#include "model/topology/correspondence.h"

namespace clothfit {

/// The mesh of a pattern: its panels side by side in one flat cloth, the warp of each along t, and
/// the pairs of vertices that seams join. Corners of outlines are vertices at every spacing.
struct GarmentMesh {
  ClothMesh cloth;
  std::vector<int> panel_of;         ///< of every vertex
  std::vector<int> fabric_of;        ///< of every vertex
  std::vector<double> panel_left_m;  ///< by which each panel is moved along s in the flat cloth
  /// Vertices of each seam, both sides' from end to end.
  std::vector<std::vector<std::array<int, 2>>> seams;
  std::vector<std::vector<double>>
      seam_length_m;          ///< that each pair stands for, mean of both sides
  Eigen::Matrix3Xd placed_m;  ///< 3 x vertices: where the panels wait around the body

  /// Vertices that seams make one have the same number here, the others one of their own: from 0
  /// on, in the order of the vertices.
  std::vector<int> particle_of;
  int particles = 0;
};

/// Meshes a pattern's panels with lattices of `spacing_m`. Both sides of a seam have as many
/// vertices. `pattern` has passed check_pattern(). Throws InputError for an outline that its
/// spacing cannot mesh.
GarmentMesh mesh_garment(const Pattern& pattern, double spacing_m);

/// Returns where the vertices of a mesh lie in the triangles of a coarser one of the same pattern:
/// each in its own panel.
Correspondence correspond(const GarmentMesh& fine, const GarmentMesh& coarse);

}  // namespace clothfit
