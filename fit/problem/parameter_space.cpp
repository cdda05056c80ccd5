#include "fit/problem/parameter_space.h"

#include <cmath>

namespace clothfit {

int ParameterSpace::index(const std::string& name) const {
  for (int p = 0; p < size(); ++p)
    if (parameters[static_cast<size_t>(p)].name == name) return p;
  return -1;
}

Eigen::VectorXd ParameterSpace::start() const {
  Eigen::VectorXd values(size());
  for (int p = 0; p < size(); ++p) values[p] = parameters[static_cast<size_t>(p)].start;
  return values;
}

Eigen::VectorXd ParameterSpace::coordinates(const Eigen::VectorXd& values) const {
  Eigen::VectorXd result(size());
  for (int p = 0; p < size(); ++p) {
    const FitParameter& parameter = parameters[static_cast<size_t>(p)];
    result[p] = parameter.scale == ParameterScale::logarithmic ? std::log(values[p])
                                                               : values[p] / parameter.typical;
  }
  return result;
}

Eigen::VectorXd ParameterSpace::values(const Eigen::VectorXd& coordinates) const {
  Eigen::VectorXd result(size());
  for (int p = 0; p < size(); ++p) {
    const FitParameter& parameter = parameters[static_cast<size_t>(p)];
    result[p] = parameter.scale == ParameterScale::logarithmic ? std::exp(coordinates[p])
                                                               : coordinates[p] * parameter.typical;
  }
  return result;
}

Eigen::VectorXd ParameterSpace::value_by_coordinate(const Eigen::VectorXd& values) const {
  Eigen::VectorXd result(size());
  for (int p = 0; p < size(); ++p) {
    const FitParameter& parameter = parameters[static_cast<size_t>(p)];
    result[p] = parameter.scale == ParameterScale::logarithmic ? values[p] : parameter.typical;
  }
  return result;
}

Eigen::VectorXd GaussianPrior::residual(const Eigen::VectorXd& values) const {
  Eigen::VectorXd difference = -mean;
  for (size_t n = 0; n < indices.size(); ++n)
    difference[static_cast<Eigen::Index>(n)] += values[indices[n]];
  return sqrt_information * difference;
}

}  // namespace clothfit
