#include "model/sheet/plate_bending.h"

#include <Eigen/QR>
#include <cmath>
#include <map>
#include <set>

namespace clothfit {
namespace {

/// What lies around a vertex.
struct Surroundings {
  std::set<int> neighbours;                                      ///< in a cell with it
  double triangle_area_m2 = 0;                                   ///< its share of triangles
  int before_s = -1, after_s = -1, before_t = -1, after_t = -1;  ///< along the edges of squares
};

std::vector<Surroundings> surroundings_of(const ClothMesh& mesh) {
  std::vector<Surroundings> all(static_cast<size_t>(mesh.vertex_count()));
  for (const ClothCell& cell : mesh.cells) {
    const auto corners = static_cast<size_t>(cell.corners);
    for (size_t k = 0; k < corners; ++k) {
      Surroundings& here = all[static_cast<size_t>(cell.vertex[k])];
      for (size_t other = 1; other < corners; ++other)
        here.neighbours.insert(cell.vertex[(k + other) % corners]);
      if (cell.corners == 3) here.triangle_area_m2 += cell.area_m2 / 3;
    }
    if (cell.corners != 4) continue;
    // A square's corners run from its lower left one.
    const auto& [a, b, c, d] = cell.vertex;
    const auto at = [&](int v) -> Surroundings& { return all[static_cast<size_t>(v)]; };
    for (const auto& [left, right] : {std::array{a, b}, {d, c}})
      at(left).after_s = right, at(right).before_s = left;
    for (const auto& [below, above] : {std::array{a, d}, {b, c}})
      at(below).after_t = above, at(above).before_t = below;
  }
  return all;
}

/// Returns the vertices within two cells' reach of `vertex`, itself left out. Fewer than five
/// numbers do not fit the quadratic polynomial; then it reaches farther.
std::vector<int> around(int vertex, const std::vector<Surroundings>& surroundings, int reach) {
  std::set<int> found{vertex};
  for (int n = 0; n < reach; ++n) {
    const std::set<int> inner = found;
    for (const int v : inner)
      found.insert(surroundings[static_cast<size_t>(v)].neighbours.begin(),
                   surroundings[static_cast<size_t>(v)].neighbours.end());
  }
  found.erase(vertex);
  return {found.begin(), found.end()};
}

/// Adds the differences by the polynomial c_1 ds + c_2 dt + c_3 ds^2 / 2 + c_4 ds dt + c_5 dt^2 / 2
/// that fits the values around best, less that at the vertex. Near vertices count more. That of a
/// clamped vertex begins at c_3.
void add_fitted(int vertex, bool is_clamped, const ClothMesh& mesh,
                const std::vector<Surroundings>& surroundings,
                std::vector<SecondDifference>& differences) {
  constexpr int kFarthest = 4;
  const int first = is_clamped ? 2 : 0, numbers = 5 - first;
  const double unit_m = mesh.spacing_m;
  Eigen::MatrixXd coefficients;
  std::vector<int> others;
  for (int reach = is_clamped ? 1 : 2; reach <= kFarthest && coefficients.size() == 0; ++reach) {
    others = around(vertex, surroundings, reach);
    Eigen::MatrixXd powers(others.size(), 5);
    Eigen::VectorXd weight(others.size());
    for (Eigen::Index k = 0; k < powers.rows(); ++k) {
      const Eigen::Vector2d d =
          (mesh.material_m.col(others[static_cast<size_t>(k)]) - mesh.material_m.col(vertex)) /
          unit_m;
      weight[k] = 1 / d.norm();
      powers.row(k) << d.x(), d.y(), 0.5 * d.x() * d.x(), d.x() * d.y(), 0.5 * d.y() * d.y();
    }
    const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> fit(weight.asDiagonal() *
                                                                      powers.rightCols(numbers));
    if (fit.rank() == numbers) coefficients = fit.pseudoInverse() * weight.asDiagonal();
  }
  if (coefficients.size() == 0) return;  // a cloth of so few vertices has no second derivative
  const Surroundings& here = surroundings[static_cast<size_t>(vertex)];
  for (const auto& [of, row, area_m2] :
       {std::tuple{SecondDifference::weft, 2, mesh.area_m2[vertex]},
        {SecondDifference::twist, 3, here.triangle_area_m2},
        {SecondDifference::warp, 4, mesh.area_m2[vertex]}}) {
    SecondDifference difference{.of = of, .vertex = others, .per_m2 = {}, .area_m2 = area_m2};
    const Eigen::RowVectorXd c = coefficients.row(row - first) / (unit_m * unit_m);
    difference.per_m2.assign(c.begin(), c.end());
    difference.vertex.push_back(vertex);
    difference.per_m2.push_back(-c.sum());
    differences.push_back(std::move(difference));
  }
}

}  // namespace

std::vector<SecondDifference> second_differences(const ClothMesh& mesh,
                                                 const std::vector<bool>& clamped) {
  const std::vector<Surroundings> surroundings = surroundings_of(mesh);
  const double c = 1 / (mesh.spacing_m * mesh.spacing_m);
  std::vector<SecondDifference> differences;
  for (const ClothCell& cell : mesh.cells)
    if (cell.corners == 4)
      differences.push_back({.of = SecondDifference::twist,
                             .vertex = {cell.vertex.begin(), cell.vertex.end()},
                             .per_m2 = {c, -c, c, -c},
                             .area_m2 = cell.area_m2});
  for (int v = 0; v < mesh.vertex_count(); ++v) {
    const Surroundings& here = surroundings[static_cast<size_t>(v)];
    const bool is_clamped = !clamped.empty() && clamped[static_cast<size_t>(v)];
    if (here.triangle_area_m2 > 0) {
      add_fitted(v, is_clamped, mesh, surroundings, differences);
      continue;
    }
    const auto add = [&](SecondDifference::Of of, int before, int after) {
      if (before >= 0 && after >= 0)
        differences.push_back({.of = of,
                               .vertex = {before, v, after},
                               .per_m2 = {c, -2 * c, c},
                               .area_m2 = mesh.area_m2[v]});
      else if (is_clamped && (before >= 0 || after >= 0))
        differences.push_back({.of = of,
                               .vertex = {std::max(before, after), v},
                               .per_m2 = {2 * c, -2 * c},
                               .area_m2 = mesh.area_m2[v]});
    };
    add(SecondDifference::weft, here.before_s, here.after_s);
    add(SecondDifference::warp, here.before_t, here.after_t);
  }
  return differences;
}

BendingMatrix bending_matrix(const ClothMesh& mesh, const std::vector<MeasuredFabric>& fabrics,
                             const std::vector<int>& fabric_of, const std::vector<bool>& clamped) {
  const std::vector<SecondDifference> differences = second_differences(mesh, clamped);
  std::vector<Eigen::Triplet<double>> entries;
  for (size_t row = 0; row < differences.size(); ++row) {
    const SecondDifference& difference = differences[row];
    const MeasuredFabric& fabric =
        fabrics[static_cast<size_t>(fabric_of[static_cast<size_t>(difference.vertex.front())])];
    const double stiffness_n_m =
        difference.of == SecondDifference::warp ? fabric.bending_warp_n_m
        : difference.of == SecondDifference::weft
            ? fabric.bending_weft_n_m
            : 2 * std::sqrt(fabric.bending_warp_n_m * fabric.bending_weft_n_m);
    const double scale = std::sqrt(stiffness_n_m * difference.area_m2);
    for (size_t k = 0; k < difference.vertex.size(); ++k)
      entries.emplace_back(static_cast<int>(row), difference.vertex[k],
                           scale * difference.per_m2[k]);
  }
  BendingMatrix matrix(static_cast<Eigen::Index>(differences.size()), mesh.vertex_count());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

BendingMatrix bending_matrix(const ClothMesh& mesh, const MeasuredFabric& fabric,
                             const std::vector<bool>& clamped) {
  return bending_matrix(mesh, std::vector{fabric},
                        std::vector<int>(static_cast<size_t>(mesh.vertex_count()), 0), clamped);
}

}  // namespace clothfit
