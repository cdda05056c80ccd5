#pragma once

#include <vector>

#include "data/fit_result.h"
#include "fit/uncertainty/uncertainty.h"

namespace clothfit {

/// An optimum that a search found, after refinement where there was one.
struct Candidate {
  Eigen::VectorXd values;
  double cost = 0;  ///< as the search measures it: Objective::mean_length
  int runs = 0;     ///< of the search that ended near it
  bool refined = false;
};

/// Puts candidates together that ended in the same place, best first. Two are in one place unless
/// some determined parameter of the physics differs: by more than 5 %, and by more than three of
/// the sigmas at the optimum `values`.
std::vector<Basin> basins_of(const ParameterSpace& space, std::vector<Candidate> candidates,
                             const Eigen::VectorXd& values, const Uncertainty& uncertainty);

}  // namespace clothfit
