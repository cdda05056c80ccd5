#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace clothfit {

/// A regular grid of masses on a rectangular cloth. Vertex [i, j] (row i along t, column j along s)
/// lies at (s, t) = (j * width / (columns - 1), i * height / (rows - 1)) of the flat cloth and has
/// index i * columns + j.
struct Mesh {
  int columns = 0;      ///< >= 2
  int rows = 0;         ///< >= 2
  double width_m = 0;   ///< along s, > 0
  double height_m = 0;  ///< along t, > 0

  int vertex_count() const { return columns * rows; }
  int vertex(int i, int j) const { return i * columns + j; }
  double spacing_s_m() const { return width_m / (columns - 1); }
  double spacing_t_m() const { return height_m / (rows - 1); }
};

/// The six spring types of the founding paper [louchet1995, section 2.1].
inline constexpr int kSpringTypes = 6;
enum SpringType : int {
  structural_t = 0,  ///< [i, j] - [i+1, j]
  structural_s = 1,  ///< [i, j] - [i, j+1]
  shear_down = 2,    ///< [i, j] - [i+1, j+1]
  shear_up = 3,      ///< [i+1, j] - [i, j+1]
  flexion_t = 4,     ///< [i, j] - [i+2, j]
  flexion_s = 5      ///< [i, j] - [i, j+2]
};

struct Spring {
  int a = 0;
  int b = 0;  ///< differs from `a`
};

/// The springs of a mesh, one list per type, each in row-major order of its first vertex.
using SpringNet = std::array<std::vector<Spring>, kSpringTypes>;
SpringNet make_springs(const Mesh& mesh);

/// Returns the length of each type's springs in the flat, unstretched cloth (m).
std::array<double, kSpringTypes> flat_lengths(const Mesh& mesh);

/// Returns the flat, unstretched cloth in its own plane: columns (s, t, 0), 3 x vertices.
Eigen::Matrix3Xd flat_positions(const Mesh& mesh);

/// Returns a cloth's mass on its vertices `by_area`. An edge vertex carries half, a corner a
/// quarter of what an inner one does.
Eigen::VectorXd masses_by_area(const Mesh& mesh, double mass_kg);

/// Returns a cloth's mass on its vertices `equal`, as in the founding paper: every vertex of
/// `reference` carries mass / vertices. Another mesh has the same distribution over the cloth: the
/// inner vertices' m0 / a^2 per area, and the surplus of the reference's border along the edges (m0
/// / 2 per spacing) and at the corners (m0 / 4). The masses sum to `mass_kg` on every mesh.
Eigen::VectorXd masses_equal(const Mesh& mesh, const Mesh& reference, double mass_kg);

}  // namespace clothfit
