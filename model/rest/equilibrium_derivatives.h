#pragma once

#include <span>
#include <vector>

#include "model/rest/hanging_energy.h"

namespace clothfit {

/// A direction in the space of an equilibrium's inputs: the rate at which each changes.
struct EquilibriumDirection {
  std::array<double, kSpringTypes> stiffness_n_per_m{};
  std::array<double, kSpringTypes> natural_length_m{};
  Eigen::Vector3d gravity_m_per_s2 = Eigen::Vector3d::Zero();
  Eigen::VectorXd mass_kg;         ///< per vertex; empty: none changes
  Eigen::Matrix3Xd held_target_m;  ///< 3 x held; empty: none moves
};

enum class DerivativeReason {
  found,
  singular,  ///< some motion costs no energy: turning about a single held point, or slack cloth
  unstable   ///< some motion lowers the energy: a saddle, such as a sheet kept flat by symmetry
};

struct EquilibriumDerivatives {
  DerivativeReason reason = DerivativeReason::singular;
  std::vector<Eigen::Matrix3Xd>
      position_m;  ///< of each direction, 3 x vertices; empty unless found
  bool usable() const { return reason == DerivativeReason::found; }
};

/// Returns how the equilibrium `position_m` moves with the parameters, by the implicit function
/// theorem. With the gradient g of the energy and the held points A x = c,
///
///   H dx + A' dl = -(dg/dp) dp,   A dx = dc,
///
/// H being the exact second derivative. A sparse L D L' factorisation solves this on the null space
/// of A (three unknowns per vertex: some ten milliseconds for 17 x 17, seconds for 100 x 100). The
/// result is as good as the equilibrium: its imbalance should be far below the default, 1e-8 or so.
EquilibriumDerivatives equilibrium_derivatives(const HangingCloth& cloth,
                                               const std::vector<HeldVertexWeights>& held,
                                               const Eigen::Matrix3Xd& position_m,
                                               std::span<const EquilibriumDirection> directions);

}  // namespace clothfit
