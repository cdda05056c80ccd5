#include "model/garment/seam_bending.h"

#include <cmath>

#include "model/topology/correspondence.h"

namespace clothfit {
namespace {

/// A vertex of a seam's side and what lies around it in the flat cloth.
struct SeamPoint {
  int vertex = 0;
  Eigen::Vector2d beside_m;  ///< one spacing inwards
};

/// Returns the points of one side of a seam. The cloth lies on the left of a side that runs along
/// its outline, on the right of one that runs against it.
std::vector<SeamPoint> points_of(const GarmentMesh& mesh,
                                 const std::vector<std::array<int, 2>>& seam, size_t side) {
  std::vector<SeamPoint> points;
  const auto place = [&](size_t k) -> Eigen::Vector2d {
    return mesh.cloth.material_m.col(seam[k][side]);
  };
  for (size_t k = 0; k < seam.size(); ++k) {
    const size_t before = k > 0 ? k - 1 : 0, after = std::min(k + 1, seam.size() - 1);
    const Eigen::Vector2d along = (place(after) - place(before)).normalized();
    const Eigen::Vector2d left{-along.y(), along.x()};
    points.push_back({seam[k][side], place(k) + mesh.cloth.spacing_m * (side == 0 ? left : -left)});
  }
  return points;
}

double mean_bending_n_m(const MeasuredFabric& fabric) {
  return 0.5 * (fabric.bending_warp_n_m + fabric.bending_weft_n_m);
}

}  // namespace

BendingMatrix seam_bending(const GarmentMesh& mesh, const std::vector<MeasuredFabric>& fabrics) {
  std::array<std::vector<SeamPoint>, 2> sides;
  std::vector<double> length_m;
  for (const std::vector<double>& of_seam : mesh.seam_length_m)
    length_m.insert(length_m.end(), of_seam.begin(), of_seam.end());
  for (const auto& seam : mesh.seams)
    for (size_t side = 0; side < 2; ++side)
      for (const SeamPoint& point : points_of(mesh, seam, side)) sides[side].push_back(point);
  const Eigen::Matrix3Xi triangles = mesh.cloth.triangles();
  std::array<Correspondence, 2> beside;
  const auto count = static_cast<Eigen::Index>(sides[0].size());
  for (size_t side = 0; side < 2; ++side) {
    Eigen::Matrix2Xd point_m(2, count);
    for (Eigen::Index k = 0; k < count; ++k)
      point_m.col(k) = sides[side][static_cast<size_t>(k)].beside_m;
    beside[side] = correspond(point_m, mesh.cloth.material_m, triangles);
  }
  constexpr double kOutside = -1e-6;
  const double h_m = mesh.cloth.spacing_m;
  std::vector<Eigen::Triplet<double>> entries;
  int row = 0;
  for (Eigen::Index k = 0; k < count; ++k) {
    const SeamPoint &a = sides[0][static_cast<size_t>(k)], &b = sides[1][static_cast<size_t>(k)];
    const bool inside =
        std::min(beside[0].weight.col(k).minCoeff(), beside[1].weight.col(k).minCoeff()) > kOutside;
    if (!inside || a.vertex == b.vertex) continue;
    double stiffness_n_m = 0;
    for (const int vertex : {a.vertex, b.vertex})
      stiffness_n_m +=
          0.5 * mean_bending_n_m(
                    fabrics[static_cast<size_t>(mesh.fabric_of[static_cast<size_t>(vertex)])]);
    const double scale =
        std::sqrt(stiffness_n_m * length_m[static_cast<size_t>(k)] * h_m) / (h_m * h_m);
    for (const Correspondence& of : beside)
      for (Eigen::Index corner = 0; corner < 3; ++corner)
        entries.emplace_back(row, of.corner(corner, k), scale * of.weight(corner, k));
    entries.emplace_back(row, a.vertex, -scale);
    entries.emplace_back(row, b.vertex, -scale);
    ++row;
  }
  BendingMatrix matrix(row, mesh.cloth.vertex_count());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace clothfit
