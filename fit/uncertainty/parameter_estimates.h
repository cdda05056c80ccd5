#pragma once

#include <Eigen/Core>
#include <vector>

#include "data/fit_result.h"
#include "fit/interface/fit_options.h"
#include "fit/interface/fit_report.h"
#include "fit/problem/problem.h"
#include "fit/problem/springs_on_limit.h"
#include "fit/refine/other_mesh.h"
#include "fit/uncertainty/parameter_profiles.h"
#include "fit/uncertainty/uncertainty.h"

namespace clothfit {

/// A log-parameter less certain than this (a factor of e^0.7 = 2 either way) is undetermined.
inline constexpr double kUndeterminedLogSigma = 0.7;

/// The estimates that were asked for beside sigma.
struct FurtherLooks {
  std::vector<ParameterProfile> profiles;
  OtherMesh other_mesh;
};

/// Fills the parameter tables of the result from the fitted values. They have value, sigma and
/// intervals, or say why a parameter is undetermined.
void fill_parameters(const FitProblem& problem, const FitOptions& options,
                     const Eigen::VectorXd& values, const Uncertainty& uncertainty,
                     const FurtherLooks& looks, FitResult& result);

/// Says that a stiffness is undetermined where most of its springs sit on their strain limit. Such
/// a spring is as long as the limit allows, however stiff it is.
void explain_by_strain_limit(const FitProblem& problem, const Eigen::VectorXd& values,
                             const SpringsOnLimit& count,
                             std::vector<ParameterEstimate>& parameters);

}  // namespace clothfit
