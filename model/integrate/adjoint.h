#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "model/integrate/simulate.h"
#include "model/kernels/tangent_sweep.h"

namespace clothfit {

/// Inputs of one simulation for single springs, vertices and times.
struct SimulationFields {
  /// Factors on single springs' constants; absent: ones.
  std::shared_ptr<const SpringFactors<SingleLane>> spring_factors;
  /// A force on every vertex (3 x vertices, N) that acts over the interval up to each frame, frame
  /// 0 left out; empty: none.
  std::vector<Eigen::Matrix3Xd> force_n;
};

/// A cost's derivatives by the positions in one frame, 3 x vertices, in the order of the frames.
using CostByPosition =
    std::function<Eigen::Matrix3Xd(int frame, const Eigen::Matrix3Xd& position_m)>;

/// A cost's derivatives by the inputs of a simulation, the paths of held points excepted.
struct CostGradient {
  TangentSweep::SpringGradients by_springs;  ///< by every single spring's constants
  /// Parts that effects add, by their types' constants alone: a ParameterNumber each.
  std::array<double, 3 * kSpringTypes> by_types{};
  std::array<double, kSpringTypes>
      by_longest_m{};          ///< by the longest length of a type under the limit
  Eigen::VectorXd by_mass_kg;  ///< per vertex
  Eigen::Vector3d by_gravity = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd by_start_position, by_start_velocity;  ///< 3 x vertices
  std::vector<Eigen::VectorXd> by_start_effect_memory;    ///< [effect], as in ParameterSet
  std::vector<Eigen::Matrix3Xd> by_force_n;               ///< as SimulationFields::force_n
  std::vector<std::vector<double>> by_effects;            ///< [effect][parameter]
};

struct GradientResult {
  SimulateResult run;
  CostGradient gradient;  ///< without meaning where the run is not usable
};

/// Simulates one parameter set and differentiates a cost of its frames by whole fields. The adjoint
/// of each step is exact for the discrete scheme wherever it is smooth. It costs a few simulations
/// whatever the number of derivatives. The state is kept every sqrt(n) of n steps and computed
/// again between, so memory grows with sqrt(n) states. A run that `stop` ends, asked between steps,
/// is cancelled and has no gradient.
GradientResult simulate_with_gradient(const Cloth& cloth, const ParameterSet& parameters,
                                      const Schedule& schedule, const SimulationFields& fields,
                                      const CostByPosition& cost_by_position,
                                      const StopCheck& stop = {});

/// Runs the simulation alone. What `stop` ends is cancelled and has fewer frames.
SimulateResult simulate_with_fields(const Cloth& cloth, const ParameterSet& parameters,
                                    const Schedule& schedule, const SimulationFields& fields,
                                    const StopCheck& stop = {});

}  // namespace clothfit
