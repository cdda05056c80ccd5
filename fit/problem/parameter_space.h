#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/cloth/effect.h"

namespace clothfit {

/// The part of the model to which a parameter belongs. It is the fabric's springs, an effect, the
/// placement of the scene, an effect of the measurement, the cloth's state when the recording
/// began, or the error of its held points' measured motion.
enum class ParameterRole { springs, effect, placement, measurement, start, drive };

/// Says whether a parameter is one of the cloth's physics, which searches look for.
inline bool is_physical(ParameterRole role) {
  return role == ParameterRole::springs || role == ParameterRole::effect;
}

/// Says whether reports list a parameter; a start or a drive may have hundreds.
inline bool is_listed(ParameterRole role) {
  return role != ParameterRole::start && role != ParameterRole::drive;
}

/// A number that a fit may change.
struct FitParameter {
  std::string name;
  std::string unit;
  ParameterRole role = ParameterRole::springs;
  ParameterScale scale = ParameterScale::linear;
  double lower = 0;         ///< widest bounds, in `unit`
  double upper = 0;         ///< > lower
  double search_lower = 0;  ///< a search looks from here on; 0: from `lower`
  double start = 0;         ///< a fit begins here unless a search finds better
  double typical = 1;       ///< for linear parameters: the size of a change that matters

  double searched_from() const { return search_lower > 0 ? search_lower : lower; }
};

/// The parameters of one fit, in a fixed order. Refinement works in `coordinates`, in which a step
/// of one is large for every parameter: the logarithm of a value, or value / typical.
struct ParameterSpace {
  std::vector<FitParameter> parameters;

  int size() const { return static_cast<int>(parameters.size()); }
  int index(const std::string& name) const;  ///< -1 when there is none
  Eigen::VectorXd start() const;

  Eigen::VectorXd coordinates(const Eigen::VectorXd& values) const;
  Eigen::VectorXd values(const Eigen::VectorXd& coordinates) const;
  /// Returns d value / d coordinate of each parameter at `values`.
  Eigen::VectorXd value_by_coordinate(const Eigen::VectorXd& values) const;
};

/// The source of a number of the model: a parameter of the fit, or a constant.
struct Binding {
  int parameter = -1;  ///< index into the space, or -1
  double constant = 0;
  double value(const Eigen::VectorXd& values) const {
    return parameter >= 0 ? values[parameter] : constant;
  }
};

/// Gaussian knowledge about some parameters that comes from elsewhere. An example is the direction
/// of gravity in the camera's axes from world placement. sqrt_information * (values[indices] -
/// mean) is standard normal.
struct GaussianPrior {
  std::vector<int> indices;
  Eigen::VectorXd mean;
  Eigen::MatrixXd sqrt_information;
  Eigen::VectorXd residual(const Eigen::VectorXd& values) const;
};

}  // namespace clothfit
