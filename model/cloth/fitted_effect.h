#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "model/topology/mesh.h"

namespace clothfit {

/// An effect's values as a fit has found them, and the cloth and recording that it was fitted to.
/// EffectDescription::in_words tells them in quantities of people.
struct FittedEffect {
  struct HeldPlace {
    Eigen::Vector2d at_m = Eigen::Vector2d::Zero();  ///< (s, t) on the flat cloth
    bool driven = false;                             ///< it follows a motion of its own
  };

  std::string mode;                      ///< the one to tell of, by its name in the description
  std::map<std::string, double> values;  ///< of every parameter, those of other modes too
  Mesh mesh;
  Eigen::VectorXd mass_kg;  ///< of every vertex, as stated
  Eigen::Vector3d gravity_m_per_s2{0, 0, -9.81};
  std::vector<HeldPlace> held;         ///< in the order of Cloth::held
  double begin_s = 0, end_s = 0;       ///< times of the first and the last frame
  double frame_interval_s = 1.0 / 60;  ///< median

  /// Returns the value of a parameter, which must be there.
  double value(const std::string& parameter) const { return values.at(parameter); }
  /// Returns the vector of the parameters NAME_x, NAME_y, NAME_z.
  Eigen::Vector3d vector(const std::string& name) const {
    return {value(name + "_x"), value(name + "_y"), value(name + "_z")};
  }

  double duration_s() const { return end_s - begin_s; }
  double gravity() const { return gravity_m_per_s2.norm(); }
  double areal_density_kg_per_m2() const { return mass_kg.sum() / (mesh.width_m * mesh.height_m); }
  /// Returns the cloth's weight per area (Pa).
  double weight_pa() const { return areal_density_kg_per_m2() * gravity(); }
};

}  // namespace clothfit
