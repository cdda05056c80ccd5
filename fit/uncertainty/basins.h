#pragma once

#include <vector>

#include "data/fit_result.h"
#include "fit/uncertainty/uncertainty.h"

namespace clothfit {

/// What a search found, after refinement where there was one.
struct Candidate {
  Eigen::VectorXd values;
  double cost = 0;  ///< as the search has it: Objective::mean_length
  int runs = 0;     ///< of the search that ended near it
  bool refined = false;
};

/// Candidates that ended in the same place, put together; best first. Two are in one place unless
/// some parameter of the physics that is determined differs by more than 5 % and by more than three
/// of the sigmas at the optimum `values`.
std::vector<Basin> basins_of(const ParameterSpace& space, std::vector<Candidate> candidates,
                             const Eigen::VectorXd& values, const Uncertainty& uncertainty);

}  // namespace clothfit
