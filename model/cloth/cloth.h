#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "model/cloth/effect.h"
#include "model/fabric/fabric.h"
#include "model/kernels/strain_limit.h"
#include "model/topology/mesh.h"
#include "model/topology/obstacle.h"

namespace clothfit {

/// A prescribed point of the cloth. It constrains the surface interpolated between the vertices
/// (bilinear in its mesh cell) at its (s, t); at a vertex that is the vertex itself.
struct HeldVertexWeights {
  struct Weight {
    int vertex = 0;
    double weight = 0;
  };
  std::vector<Weight> weights;  ///< sum to 1
  /// Where the point is at a time (world, m); empty: it stays where the start shape has it.
  std::function<Eigen::Vector3d(double time_s)> motion;
  /// That motion only says where the start shape has the point: nothing drives it.
  bool rests = false;
};

/// The point of `mesh` at material coordinates (s, t), which must lie on the cloth.
HeldVertexWeights held_at(const Mesh& mesh, double s_m, double t_m);

/// What does not change between the simulations of one fit: mesh, masses, held points, strain
/// limit, effects.
struct Cloth {
  Mesh mesh;
  SpringNet springs;
  Eigen::VectorXd mass_kg;  ///< per vertex, > 0
  std::vector<HeldVertexWeights> held;
  StrainLimit strain_limit;
  std::shared_ptr<const Obstacle> obstacle;  ///< what contact_mesh feels; none unless set
  std::vector<EffectDescription> effect_descriptions;
  std::vector<std::shared_ptr<const Effect>> effects;  ///< in the order of the descriptions

  /// A cloth of a mesh with its springs, without held points or effects.
  static Cloth of(const Mesh& mesh, Eigen::VectorXd mass_kg);

  size_t spring_count() const;
};

/// What may change between simulations.
struct ParameterSet {
  SpringParameters springs;
  Eigen::Vector3d gravity_m_per_s2{0, 0, -9.81};
  std::vector<std::vector<double>> effects;  ///< parameters of each effect of the cloth
  Eigen::Matrix3Xd start_position_m;         ///< 3 x vertices, world
  Eigen::Matrix3Xd start_velocity_m_per_s;   ///< the same; empty: at rest
  /// What each effect of the cloth remembers at the start (EffectMemory's numbers); empty, as a
  /// whole or for an effect: nothing.
  std::vector<Eigen::VectorXd> start_effect_memory;
  /// Of each held point, what is added to its motion (world, m); empty, as a whole or for a point:
  /// nothing. A point without a motion of its own ignores it: the start shape says where it stays.
  std::vector<std::function<Eigen::Vector3d(double time_s)>> held_shift;
};

/// Where a set wants a held point with a motion of its own at `time_s`: at `motion_m`, where that
/// motion has it then, and the set's shift added. Without one these are the bits of `motion_m`.
Eigen::Vector3d shifted(const Eigen::Vector3d& motion_m, const ParameterSet& set, size_t held,
                        double time_s);

}  // namespace clothfit
