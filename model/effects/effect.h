#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model/lanes.h"
#include "model/mesh.h"

namespace clothfit {

/// How a fit walks along a parameter.
enum class ParameterScale { linear, logarithmic };

/// A parameter of an effect. At `neutral` the effect leaves the trajectory bit-equal. Three named
/// NAME_x, NAME_y, NAME_z are a vector's, which a recording may declare as NAME: [x, y, z].
struct EffectParameter {
  std::string name;
  std::string unit;
  double neutral = 0;
  double lower = 0;  ///< bounds of a fit
  double upper = 0;
  double typical = 1;  ///< size of a change that matters, for scaling
  ParameterScale scale = ParameterScale::linear;
};

struct EffectDescription {
  std::string name;
  std::string summary;  ///< one line for a person, with the equation
  std::vector<EffectParameter> parameters;
};

/// What an effect may look at: the state at the beginning of a step.
struct EffectScene {
  const Mesh& mesh;
  const LaneVectors<>& position_m;
  const LaneVectors<>& velocity_m_per_s;
  const Eigen::VectorXd& mass_kg;  ///< per vertex
  double time_s = 0;
};

/// One physical effect beyond springs, dampers along them, and gravity.
class Effect {
 public:
  virtual ~Effect() = default;

  /// Adds the effect's force to `force_n`. `parameters[p]` holds parameter p in every lane.
  virtual void add_force(const EffectScene& scene, const std::vector<LaneValue<>>& parameters,
                         LaneVectors<>& force_n) const = 0;

  /// Upper bound of the rate (1/s) at which the effect damps a velocity, for the choice of a stable
  /// time step. `parameters` in the description's order.
  virtual double damping_rate_per_s(const Mesh& mesh, const Eigen::VectorXd& mass_kg,
                                    const std::vector<double>& parameters) const = 0;
};

}  // namespace clothfit
