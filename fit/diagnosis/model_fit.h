#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "fit/diagnosis/term.h"
#include "fit/objective.h"
#include "fit/problem.h"
#include "fit/refine.h"

namespace clothfit {

/// A model of a recording with some effects, fitted to its first frames.
struct ModelFit {
  std::vector<Term> terms;
  std::shared_ptr<const FitProblem> problem;
  Eigen::VectorXd values;
  int frames = 0;  ///< that it was fitted to
  TimeSteps steps = 0;
  Linearisation linear;  ///< there
  bool usable = false;
  bool cancelled = false;

  TrajectoryObjective objective() const { return {*problem, frames, steps}; }
};

/// A problem's parameters at values known by name. Of those that are not known, amplitudes of
/// effects are neutral and others where a fit begins.
Eigen::VectorXd values_of(const FitProblem& problem, const std::map<std::string, double>& known);

std::map<std::string, double> values_by_name(const FitProblem& problem,
                                             const Eigen::VectorXd& values);

/// What all fits of a diagnosis share.
struct DiagnosisSetup {
  const FitInput& input;
  const FitOptions& options;
  int columns = 0, rows = 0;  ///< of the mesh
};

/// The options with the priors of the shapes that terms fit.
FitOptions options_with(FitOptions options, const std::vector<Term>& terms);

/// The model's problem; all constants of its terms are in.
std::shared_ptr<const FitProblem> problem_of(const DiagnosisSetup& setup,
                                             const std::vector<Term>& terms);

/// Refines a model from values known by name over each of the horizons (frames, rising) in turn,
/// and linearises it at the end of the last one.
/// `rounds`: of each refinement (fit/refine.h).
ModelFit fit_model(const DiagnosisSetup& setup, const std::vector<Term>& terms,
                   const std::map<std::string, double>& start, const std::vector<int>& horizons,
                   const ProgressCallback& progress, int rounds = 2);

/// The model as it is, linearised over its first frames.
ModelFit model_at(std::shared_ptr<const FitProblem> problem, std::vector<Term> terms,
                  Eigen::VectorXd values, int frames, const TimeSteps& steps);

}  // namespace clothfit
