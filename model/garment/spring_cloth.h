#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "model/garment/garment_mesh.h"
#include "model/sheet/cloth_energy.h"

namespace clothfit {

/// The springs of [lethanh2007, section 3], energies per area at a strain of 1. The paper gives no
/// numbers. Its stiffness constants k are energies per spring; here they are proportional to the
/// area that a spring stands for, so that meshes of any spacing are of the same cloth.
struct PaperSprings {
  double tension_n_per_m = 500, shear_n_per_m = 50, bending_n_per_m = 5;
  double areal_density_kg_per_m2 = 0.15;

  void validate() const;  ///< throws InputError
};

/// The energy of a garment's springs and weight [lethanh2007, equation 8],
///
///   E = 1/2 sum k (l / L - 1)^2 - sum m g . x,
///
/// with L the length of a spring in the flat cloth. Springs of tension lie along the sides of
/// squares and triangles, those of shear along both diagonals of squares. Springs of bending join
/// the corners opposite a side that two triangles share [lethanh2007, figure 3], as far apart as in
/// the triangles laid flat; across seams too. Resistance to bending sets in with the fourth power
/// of the angle.
class SpringCloth : public ClothEnergy {
 public:
  enum class Type { tension, shear, bending };
  struct Spring {
    Type type = Type::tension;
    int a = 0, b = 0;
    double length_m = 0, stiffness_j = 0;
  };

  /// `particle_of`: of every vertex of the mesh; those of a seam that is sewn share one.
  SpringCloth(const GarmentMesh& mesh, const std::vector<int>& particle_of,
              const PaperSprings& springs);

  const std::vector<Spring>& springs() const { return springs_; }
  /// Returns the mean of |l - L| over all springs: the paper's average spring error.
  double spring_error_m(const Eigen::Matrix3Xd& position_m) const;

  const Eigen::VectorXd& mass_kg() const override { return mass_kg_; }
  void set_gravity(const Eigen::Vector3d& gravity_m_per_s2) override {
    gravity_m_per_s2_ = gravity_m_per_s2;
  }
  double weight_n() const override { return mass_kg_.sum() * gravity_m_per_s2_.norm(); }
  double energy_and_gradient(const Eigen::Matrix3Xd& position_m,
                             Eigen::Matrix3Xd& gradient_n) const override;
  const std::vector<Pair>& pairs() const override { return pairs_; }
  void second_derivative(const Eigen::Matrix3Xd& position_m, Curvature curvature,
                         std::vector<Eigen::Matrix3d>& blocks) const override;

 private:
  void add_bending(const ClothMesh& cloth, const std::vector<int>& particle_of,
                   double bending_n_per_m);
  void find_pairs();
  void add_spring(Type type, int a, int b, double length_m, double stiffness_j);

  std::vector<Spring> springs_;
  std::vector<Pair> pairs_;
  std::vector<std::array<int, 3>> blocks_of_;  ///< of each spring: of a, of b, of both
  Eigen::VectorXd mass_kg_;
  Eigen::Vector3d gravity_m_per_s2_{0, 0, -9.81};
};

}  // namespace clothfit
