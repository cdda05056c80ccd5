#pragma once

#include <array>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/rest/mesh_field.h"

namespace clothfit {

/// Springs and weight of a hanging cloth: all inputs of its equilibrium besides held points.
struct HangingCloth {
  Mesh mesh;
  std::array<double, kSpringTypes> natural_length_m{};   ///< > 0
  std::array<double, kSpringTypes> stiffness_n_per_m{};  ///< >= 0
  Eigen::VectorXd mass_kg;                               ///< per vertex, > 0
  Eigen::Vector3d gravity_m_per_s2{0, 0, -9.81};

  /// Makes the model's cloth: E = sum k (l - l0)^2 / 2 - sum m g . x.
  static HangingCloth of(const Cloth& cloth, const ParameterSet& parameters);

  /// Makes the cloth with the energy of the second founding paper [lethanh2007, equation 8],
  ///
  ///   E = 1/2 sum k (l / L - 1)^2 + C_g sum m g (z - Z0),
  ///
  /// whose constants k are energies (J): k (l / L - 1)^2 = (k / L^2) (l - L)^2, so it is the
  /// model's energy with other stiffness values. L is the springs' length in the flat cloth. Z0
  /// adds a constant and is zero here.
  static HangingCloth of_equation8(const Mesh& mesh,
                                   const std::array<double, kSpringTypes>& constant_j,
                                   double density_constant, Eigen::VectorXd mass_kg,
                                   double gravity_m_per_s2 = 9.81);

  double weight_n() const { return mass_kg.sum() * gravity_m_per_s2.norm(); }
};

/// Says how a spring's second derivative treats the transverse part k (1 - l0 / l). It is negative
/// for compressed springs.
enum class Curvature {
  exact,
  clamped  ///< taken for zero where it is negative: positive semidefinite
};

/// The energy's second derivative at one shape, spring by spring:
///
///   f_a = -f_b = transverse (v_b - v_a) + longitudinal (d . (v_b - v_a)) d,   d = x_b - x_a
///   transverse = k (1 - l0 / l),   longitudinal = k l0 / l^3
///
/// There is one plane per spring type. A spring is indexed by the vertex in whose row and column it
/// starts; `shear_up`, which starts a row below, by the vertex above.
struct EnergyTangent {
  MeshField position_m;
  std::array<Eigen::ArrayXd, kSpringTypes> transverse_n_per_m;
  std::array<Eigen::ArrayXd, kSpringTypes> longitudinal_n_per_m3;
};

/// Springs whose stiffness is a symmetric matrix: f_a = -f_b = K (v_b - v_a). Components xx, yy,
/// zz, xy, xz, yz, a plane each, of every type; indices as in EnergyTangent.
struct MatrixSprings {
  FieldLayout layout;
  std::array<std::array<Eigen::ArrayXd, 6>, kSpringTypes> stiffness_n_per_m;
};

/// Multiplies the springs with `direction`; `scratch` is kept from call to call.
void multiply(const EnergyTangent& tangent, const MeshField& direction, MeshField& product,
              std::vector<std::vector<double>>& scratch);
void multiply(const MatrixSprings& springs, const MeshField& direction, MeshField& product,
              std::vector<std::vector<double>>& scratch);

/// Computes energy, gradient and second derivative over the mesh. A row of vertices at a time is
/// computed in the processor's vectors, blocks of rows in parallel. The arithmetic is strict IEEE
/// in a fixed order: the same bits for any number of threads and on every instruction set, as the
/// time step has them. Held points are not known here.
///
/// Holds scratch memory: one object per caller.
class HangingEnergy {
 public:
  explicit HangingEnergy(HangingCloth cloth);

  const HangingCloth& cloth() const { return cloth_; }
  const FieldLayout& layout() const { return layout_; }

  /// Returns the energy (J); its derivative by the positions (N) goes to `gradient_n`.
  double energy_and_gradient(const MeshField& position_m, MeshField& gradient_n);

  void linearise(const MeshField& position_m, Curvature curvature, EnergyTangent& tangent);

  /// Multiplies the second derivative with `direction`.
  void multiply(const EnergyTangent& tangent, const MeshField& direction, MeshField& product) {
    clothfit::multiply(tangent, direction, product, scratch_);
  }

 private:
  HangingCloth cloth_;
  FieldLayout layout_;
  Eigen::ArrayXd mass_kg_;                    ///< in the layout
  std::vector<std::vector<double>> scratch_;  ///< per block of rows
  std::vector<double> block_energy_j_;
};

}  // namespace clothfit
