#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <random>

#include "model/cloth/cloth.h"

namespace clothfit {

/// Draws uniform numbers that are the same with every standard library, whose distributions are
/// not.
class Uniform {
 public:
  explicit Uniform(std::uint64_t seed) : rng_(seed) {}
  double operator()(double lower, double upper) {
    return lower + (upper - lower) * static_cast<double>(rng_() >> 11) * 0x1p-53;
  }
  Eigen::Matrix3Xd vectors(Eigen::Index count, double size) {
    Eigen::Matrix3Xd result(3, count);
    for (double& value : result.reshaped()) value = (*this)(-size, size);
    return result;
  }
  Eigen::Matrix3d rotation() {
    return Eigen::Quaterniond(Eigen::Vector4d(vectors(4, 1).topRows<1>().transpose()).normalized())
        .toRotationMatrix();
  }

 private:
  std::mt19937_64 rng_;
};

/// Makes the mesh of the bundled recordings' cloth: 0.4 m, 25 g, cotton-like.
inline Mesh square_mesh(int vertices_per_side) {
  return {.columns = vertices_per_side, .rows = vertices_per_side, .width_m = 0.4, .height_m = 0.4};
}

inline constexpr double kSquareClothDensity_kg_per_m2 = 0.025 / 0.16;

inline Cloth square_cloth(int vertices_per_side) {
  const Mesh mesh = square_mesh(vertices_per_side);
  return Cloth::of(mesh, masses_by_area(mesh, 0.025));
}

inline Fabric cotton() {
  return {.tension_warp_n_per_m = 60,
          .tension_weft_n_per_m = 45,
          .shear_n_per_m = 6,
          .flexion_warp_n_per_m = 2,
          .flexion_weft_n_per_m = 1.5,
          .damping_warp_s = 1e-3,
          .damping_weft_s = 1e-3};
}

inline Fabric random_fabric(Uniform& uniform) {
  return {.tension_warp_n_per_m = uniform(10, 200),
          .tension_weft_n_per_m = uniform(10, 200),
          .shear_n_per_m = uniform(0, 60),
          .flexion_warp_n_per_m = uniform(0, 20),
          .flexion_weft_n_per_m = uniform(0, 20),
          .damping_warp_s = uniform(0, 3e-3),
          .damping_weft_s = uniform(0, 3e-3)};
}

/// Returns the flat cloth with every vertex moved by up to `share` of a spacing, in all three
/// directions.
inline Eigen::Matrix3Xd crumpled(const Mesh& mesh, double share, Uniform& uniform) {
  return flat_positions(mesh) +
         uniform.vectors(mesh.vertex_count(),
                         share * std::min(mesh.spacing_s_m(), mesh.spacing_t_m()));
}

/// Returns the flat cloth hung up: s to the right along x, t down along -z.
inline Eigen::Matrix3Xd hung_flat(const Mesh& mesh) {
  const Eigen::Matrix3Xd flat = flat_positions(mesh);
  Eigen::Matrix3Xd hung(3, flat.cols());
  hung << flat.row(0), Eigen::RowVectorXd::Zero(flat.cols()), -flat.row(1);
  return hung;
}

}  // namespace clothfit
