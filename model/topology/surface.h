#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <span>

namespace clothfit {

/// Says how a cloth's surface runs between the vertices of its mesh.
enum class SurfaceInterpolation {
  bicubic,  ///< tensor product of natural cubic splines; error O(spacing^4) away from the edges
  bilinear  ///< straight between neighbours; error O(spacing^2): 0.1 to 0.4 mm on a 17 x 17 cloth
};

/// The quantity that weights on the vertices give at a point. It is the point's place x; the
/// surface's slope there along s or t (m/m), tangent to the cloth and of length 1 where it is not
/// stretched; or a second derivative (1/m), the turn of the slopes.
enum class SurfaceQuantity { place, by_s, by_t, by_ss, by_st, by_tt };

/// The derivatives among these quantities, in that order.
inline constexpr std::array kSurfaceDerivatives{SurfaceQuantity::by_s, SurfaceQuantity::by_t,
                                                SurfaceQuantity::by_ss, SurfaceQuantity::by_st,
                                                SurfaceQuantity::by_tt};

/// The observed points of a cloth, as weights on the vertices of a mesh:
///
///   x(s, t) = sum_i sum_j R_i(t) C_j(s) P[i, j]
///
/// where R_i and C_j are the cardinal functions of the one-dimensional interpolation along the rows
/// (t) and columns (s) of evenly spaced vertices: 1 at their own vertex, 0 at all others. The
/// natural cubic spline is the interpolating curve of least bending, straight at and beyond its
/// ends [deboor1978]; with two vertices it is the straight line. The operator is linear in the
/// vertices and knows nothing of their positions, so it is made once per mesh and list of points.
///
/// Vertex [i, j] (row i along t, column j along s) has index i * columns + j.
struct Surface {
  using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  int columns = 0;         ///< >= 2
  int rows = 0;            ///< >= 2
  Weights row_weights;     ///< points x rows, R_i(t) of each point, compressed
  Weights column_weights;  ///< points x columns, C_j(s) of each point, compressed

  int points() const { return static_cast<int>(row_weights.rows()); }
  int vertices() const { return columns * rows; }

  /// Returns positions of the points, 3 x points, from those of the vertices, 3 x vertices.
  Eigen::Matrix3Xd evaluate(const Eigen::Matrix3Xd& positions) const;
};

/// Makes the weights of `points` on a mesh of `columns` x `rows` vertices over a cloth of `width_m`
/// x `height_m`. `points` are 2 x M, s in row 0, t in row 1, metres. They lie on the cloth; up to a
/// micrometre outside, which reading a marker file lets pass, counts as the edge. Weights below
/// 1e-12 of the point's largest are left out: a point at a vertex has one, and far vertices of
/// large meshes none (the weights fall by 0.27 from vertex to vertex). For a derivative, R_i or C_j
/// or both are differentiated. Away from the edges the bicubic surface's slopes err by
/// O(spacing^3), its second derivatives by O(spacing^2); on an edge natural splines do not bend:
/// x_ss or x_tt is nothing.
Surface make_surface(int columns, int rows, double width_m, double height_m,
                     const Eigen::Matrix2Xd& points,
                     SurfaceInterpolation interpolation = SurfaceInterpolation::bicubic,
                     SurfaceQuantity quantity = SurfaceQuantity::place);

/// Interpolates `width` fields at once, their values stored side by side. Vertex k's are [k *
/// width, (k + 1) * width), point p's likewise. With `width` 3 that is a 3 x N matrix; with the
/// number of lanes it is one coordinate of many simulations. Each field is summed in the same order
/// whatever `width` is, so lanes and single runs agree to the last bit.
void interpolate(const Surface& surface, int width, std::span<const double> vertex_values,
                 std::span<double> point_values);

/// Returns the whole operator as one matrix, points x vertices: R_i(t) C_j(s) at [point, i *
/// columns + j]. For Jacobians: d x(point) / d P[i, j] is that entry times the identity.
Surface::Weights vertex_weights(const Surface& surface);

}  // namespace clothfit
