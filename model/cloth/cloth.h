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
/// (bilinear in its mesh cell) at its (s, t). At a vertex that is the vertex itself.
struct HeldVertexWeights {
  struct Weight {
    int vertex = 0;
    double weight = 0;
  };
  std::vector<Weight> weights;  ///< sum to 1
  /// Place of the point at a time (world, m); empty: it stays where the start shape has it.
  std::function<Eigen::Vector3d(double time_s)> motion;
  /// Says that the motion only gives the place in the start shape: nothing drives the point.
  bool rests = false;
};

/// Returns the point of `mesh` at material coordinates (s, t), which must lie on the cloth.
HeldVertexWeights held_at(const Mesh& mesh, double s_m, double t_m);

/// The constants of all simulations of one fit: mesh, masses, held points, strain limit, effects.
struct Cloth {
  Mesh mesh;
  SpringNet springs;
  Eigen::VectorXd mass_kg;  ///< per vertex, > 0
  std::vector<HeldVertexWeights> held;
  StrainLimit strain_limit;
  std::shared_ptr<const Obstacle> obstacle;  ///< for contact_mesh; none unless set
  std::vector<EffectDescription> effect_descriptions;
  std::vector<std::shared_ptr<const Effect>> effects;  ///< in the order of the descriptions

  /// Makes the cloth of a mesh with its springs, without held points or effects.
  static Cloth of(const Mesh& mesh, Eigen::VectorXd mass_kg);

  size_t spring_count() const;
};

/// The numbers that may change between simulations.
struct ParameterSet {
  SpringParameters springs;
  Eigen::Vector3d gravity_m_per_s2{0, 0, -9.81};
  std::vector<std::vector<double>> effects;  ///< parameters of each effect of the cloth
  Eigen::Matrix3Xd start_position_m;         ///< 3 x vertices, world
  Eigen::Matrix3Xd start_velocity_m_per_s;   ///< the same; empty: at rest
  /// Memory of each effect of the cloth at the start (EffectMemory's numbers). Empty, as a whole or
  /// for an effect: nothing.
  std::vector<Eigen::VectorXd> start_effect_memory;
  /// Shift added to the motion of each held point (world, m). Empty, as a whole or for a point:
  /// nothing. A point without a motion of its own ignores it: the start shape says where it stays.
  std::vector<std::function<Eigen::Vector3d(double time_s)>> held_shift;
};

/// Returns the place of a held point with a motion of its own at `time_s`. That is `motion_m`, the
/// motion's place then, plus the set's shift. Without a shift these are the bits of `motion_m`.
Eigen::Vector3d shifted(const Eigen::Vector3d& motion_m, const ParameterSet& set, size_t held,
                        double time_s);

}  // namespace clothfit
