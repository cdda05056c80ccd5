#pragma once

#include <Eigen/Core>
#include <vector>

#include "model/kernels/block_products.h"
#include "model/topology/mesh.h"

namespace clothfit {

/// Numbers of the parameters that a simulation depends on: the springs' constants, gravity, then
/// the effect's own.
struct ParameterNumber {
  static constexpr int natural_length(int type) { return type; }
  static constexpr int stiffness(int type) { return kSpringTypes + type; }
  static constexpr int damping(int type) { return 2 * kSpringTypes + type; }
  static constexpr int gravity(int axis) { return 3 * kSpringTypes + axis; }
  static constexpr int own(int parameter) { return 3 * kSpringTypes + 3 + parameter; }
};

/// The derivatives of an effect's action on one simulation, as lists of small blocks. Tangents and
/// the adjoint multiply by them. `on` names the target: a vertex where forces are, a held point
/// where the supports are. Several blocks in the same place add up.
struct EffectLinearisation {
  using ByMotion = MotionBlock;
  using BySpring = SpringJacobian;
  /// The derivative of the tension of spring `spring` of `by_spring` by a parameter, and by a
  /// number that is remembered.
  struct TensionByParameter {
    int spring, parameter;  ///< a ParameterNumber
    double derivative;
  };
  struct TensionByMemory {
    int spring, number;
    double derivative;
  };
  struct ByParameter {
    int on, parameter;  ///< a ParameterNumber
    Eigen::Vector3d derivative;
  };
  struct ByMemory {
    int on, number;
    Eigen::Vector3d derivative;
  };
  /// By the force on the same vertex, or the pull on the same held point.
  using ByForce = ForceBlock;
  /// By the mass of the same vertex (1/kg times the action).
  struct ByMass {
    int on;
    Eigen::Vector3d derivative;
  };
  std::vector<ByMotion> by_motion;
  std::vector<BySpring> by_spring;
  std::vector<TensionByParameter> tension_by_parameter;
  std::vector<TensionByMemory> tension_by_memory;
  std::vector<ByParameter> by_parameter;
  std::vector<ByMemory> by_memory;
  std::vector<ByForce> by_force;
  std::vector<ByMass> by_mass;

  // These give the memory after the step; without an entry a number stays as it is.
  struct MemoryByMotion {
    int number, of;
    Eigen::RowVector3d by_position, by_velocity;
  };
  struct MemoryByParameter {
    int number, parameter;
    double derivative;
  };
  struct MemoryByMemory {
    int number, of;
    double derivative;
  };
  struct MemoryByForce {
    int number, of;  ///< of: held point
    Eigen::RowVector3d derivative;
  };
  std::vector<MemoryByMotion> memory_by_motion;
  std::vector<MemoryByParameter> memory_by_parameter;
  std::vector<MemoryByMemory> memory_by_memory;
  std::vector<MemoryByForce> memory_by_force;

  /// Parameter numbers whose derivatives are looked at; others may be left out. Empty: all.
  std::vector<bool> looked_at;

  bool asks_for(int parameter) const {
    return looked_at.empty() || looked_at[static_cast<size_t>(parameter)];
  }

  void clear() {
    by_motion.clear();
    by_spring.clear();
    tension_by_parameter.clear();
    tension_by_memory.clear();
    by_parameter.clear();
    by_memory.clear();
    by_force.clear();
    by_mass.clear();
    memory_by_motion.clear();
    memory_by_parameter.clear();
    memory_by_memory.clear();
    memory_by_force.clear();
  }
};

}  // namespace clothfit
