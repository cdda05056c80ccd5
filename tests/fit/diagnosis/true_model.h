#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "fit/diagnosis/discretisation.h"
#include "fit/diagnosis/fitted_model.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/simulation.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {

/// Returns the air's drag, which a synthetic cloth may have and its recording does not declare.
inline Hypothesis drag_hypothesis() {
  return {.effect = "viscous_damping", .mode = "", .amplitudes = {"rate"}};
}

/// Returns the model of synthetic recordings of a cloth where the truth is, linearised over their
/// fitted frames. `hypotheses` say what it knows of drag; what else they name is neutral.
inline FittedModel true_model(const DiagnosisSetup& setup, const SyntheticCloth& cloth,
                              const std::vector<Hypothesis>& hypotheses = {}) {
  constexpr double kTimeStep_s = 1.0 / 60 / 150;
  NamedValues truth = named(cloth.fabric);
  truth["viscous_damping.rate"] = cloth.drag_rate_per_s;
  FittedModel model =
      model_at(setup, hypotheses, std::vector<NamedValues>(setup.inputs.size(), truth));
  for (size_t n = 0; n < model.parts.size(); ++n) {
    const FitProblem& problem = *model.problems[n];
    PooledPart& part = model.parts[n];
    part.steps = time_steps_of_run(problem.cloth, parameter_set(problem, part.values), kTimeStep_s);
  }
  linearise_model(model);
  EXPECT_TRUE(model.usable());
  return model;
}

/// Returns the same model where it stands, which may err as its discretisation does. The truth has
/// the same steps, so nothing is expected.
inline FittedModel that_may_err(const DiagnosisSetup& setup, FittedModel model) {
  std::vector<DiscretisationError> errors = discretisation_errors(setup, model);
  for (size_t n = 0; n < model.parts.size(); ++n) {
    model.parts[n].amplitudes = Eigen::VectorXd::Zero(errors[n].directions.cols());
    model.parts[n].directions = std::move(errors[n].directions);
  }
  return model;
}

}  // namespace clothfit
