#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/cloth/effect.h"

namespace clothfit {

/// What a parameter is of: the fabric's springs, an effect, how the scene was placed, an effect of
/// the measurement, where the cloth was when the recording began, or what the measured motion of
/// its held points was off by.
enum class ParameterRole { springs, effect, placement, measurement, start, drive };

/// Whether it says something of the cloth's physics, which is what searches look for.
inline bool is_physical(ParameterRole role) {
  return role == ParameterRole::springs || role == ParameterRole::effect;
}

/// Whether reports list it: of a start or of a drive there may be hundreds.
inline bool is_listed(ParameterRole role) {
  return role != ParameterRole::start && role != ParameterRole::drive;
}

/// A number that a fit may change.
struct FitParameter {
  std::string name;
  std::string unit;
  ParameterRole role = ParameterRole::springs;
  ParameterScale scale = ParameterScale::linear;
  double lower = 0;    ///< widest bounds, in `unit`
  double upper = 0;    ///< > lower
  double start = 0;    ///< where a fit begins unless a search finds better
  double typical = 1;  ///< for linear parameters: the size of a change that matters
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
  /// d value / d coordinate of each parameter at `values`.
  Eigen::VectorXd value_by_coordinate(const Eigen::VectorXd& values) const;
};

/// Where a number of the model comes from: a parameter of the fit, or a constant.
struct Binding {
  int parameter = -1;  ///< index into the space, or -1
  double constant = 0;
  double value(const Eigen::VectorXd& values) const {
    return parameter >= 0 ? values[parameter] : constant;
  }
};

/// Gaussian knowledge about some parameters that comes from elsewhere, such as the direction of
/// gravity in the camera's axes from world placement:  sqrt_information * (values[indices] - mean)
/// is standard normal.
struct GaussianPrior {
  std::vector<int> indices;
  Eigen::VectorXd mean;
  Eigen::MatrixXd sqrt_information;
  Eigen::VectorXd residual(const Eigen::VectorXd& values) const;
};

}  // namespace clothfit
