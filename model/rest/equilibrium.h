#pragma once

#include <functional>
#include <span>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/rest/hanging_energy.h"
#include "model/rest/minimise.h"

namespace clothfit {

/// Says how the minimum of the energy is looked for. All methods end by the same rule.
enum class EquilibriumMethod {
  conjugate_gradient,  ///< on the cloth's own mesh alone: the reference
  cascade,             ///< conjugate gradients from a coarse mesh to ever finer ones [lethanh2007]
  multigrid_newton  ///< Newton's method on the same meshes, each start twice as fine: the fastest
};

struct EquilibriumOptions {
  EquilibriumMethod method = EquilibriumMethod::multigrid_newton;
  /// Forces that count as balanced; > 0. It is the 2-norm of the residual force on all vertices, as
  /// a share of the cloth's weight. n vertices that each lack the share e of their own weight give
  /// e / sqrt(n), so larger meshes deserve less.
  double tolerance = 1e-3;
  /// Tolerance on meshes that only start the next one.
  double coarse_tolerance = 1e-3;
  int coarsest_vertices = 12;    ///< >= 4: a mesh with a longer side is made coarser
  int most_iterations = 200000;  ///< >= 1; on each mesh
  /// Called before each iteration with the mesh and the residual force, as a share of the weight;
  /// `false` cancels.
  std::function<bool(const Mesh& mesh, int iteration, double imbalance)> go_on;

  void validate() const;  ///< throws InputError
};

struct EquilibriumResult {
  MinimiseReason reason = MinimiseReason::iterations_used_up;  ///< on the cloth's own mesh
  Eigen::Matrix3Xd position_m;                                 ///< 3 x vertices, world
  double energy_j = 0;
  double imbalance = 0;  ///< measured by the rule: residual force, as a share of the weight
  int iterations = 0;    ///< on the cloth's own mesh, as the next two
  int evaluations = 0;   ///< of energy and gradient
  int products = 0;      ///< of the second derivative with a vector

  struct Stage {
    Mesh mesh;
    MinimiseResult work;
  };
  std::vector<Stage> stages;  ///< coarsest mesh first, the cloth's own last

  bool usable() const { return reason == MinimiseReason::converged; }
};

/// Says in one line, for a person, how a search for equilibrium ended.
const char* describe(MinimiseReason reason);

/// Finds a shape in which springs and weight are balanced. Held points are where `motion` has them
/// at `time_s` (those without one where `start_position_m` has them). The shape is a local minimum
/// of the energy near the path from `parameters.start_position_m` downhill; cloth without bending
/// stiffness has many. A start of perfect symmetry may end in a saddle of the energy: a flat
/// vertical sheet stays flat.
///
/// Dampers play no part; effects and the strain limit are left out. The bits are the same for any
/// number of threads. Throws InputError where nothing is held, where no spring has stiffness, and
/// for numbers that are none; that the cloth falls apart is a reason.
EquilibriumResult find_equilibrium(const Cloth& cloth, const ParameterSet& parameters,
                                   const EquilibriumOptions& options = {}, double time_s = 0);

/// Finds it for any HangingCloth, such as that of equation 8. `held_target_m`: 3 x held.
EquilibriumResult find_equilibrium(const HangingCloth& cloth,
                                   const std::vector<HeldVertexWeights>& held,
                                   const Eigen::Matrix3Xd& held_target_m,
                                   const Eigen::Matrix3Xd& start_position_m,
                                   const EquilibriumOptions& options = {});

/// Returns where the held points belong at `time_s`, the set's shifts added: 3 x held.
Eigen::Matrix3Xd held_targets_m(const Cloth& cloth, const ParameterSet& parameters, double time_s);

}  // namespace clothfit
