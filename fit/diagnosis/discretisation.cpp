#include "fit/diagnosis/discretisation.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/horizons.h"
#include "fit/identify.h"
#include "fit/problem/mesh_ladder.h"
#include "fit/problem/parameterised_model.h"
#include "fit/refine/other_mesh.h"

namespace clothfit {
DiagnosisSetup with_other_mesh(const DiagnosisSetup& setup) {
  int least = kSmallestMesh;
  for (const FitInput& input : setup.inputs)
    if (input.recording.start == StartKind::unknown)
      least = std::max(least, vertices_for_start(setup.options.start_nodes));
  DiagnosisSetup other = setup;
  std::tie(other.columns, other.rows) = other_mesh_of(setup.columns, setup.rows, least);
  return other;
}

FittedModel lead_to_mesh(const DiagnosisSetup& other, const FittedModel& model, double share,
                         const FittedModel& shorter, const ProgressCallback& progress,
                         bool own_only) {
  const FittedModel own = share < 1 ? shortened(model, share) : model;
  FittedModel fitted =
      model_at(other, model.hypotheses, shorter.parts.empty() ? model.values() : shorter.values());
  StageOptions stage;
  stage.rounds = 1;
  stage.own_only = own_only;
  if (share < 1) stage.least_decrease = 0;
  // A start in motion has hundreds of directions. Where its parameters stand matters little, for
  // what they change is fitted along. So updated derivatives do, which lead near the optimum for
  // some runs.
  stage.unrefined = std::ranges::any_of(
      fitted.problems, [](const auto& problem) { return problem->start == StartKind::unknown; });
  for (size_t n = 0; n < fitted.parts.size(); ++n) {
    PooledPart& part = fitted.parts[n];
    part.frames = own.parts[n].frames;
    const TrajectoryObjective objective = fitted.objective(n);
    if (own.parts[n].linear.usable) {
      part.linear.residual = objective.residuals({part.values}).front();
      part.linear.residual_by_coordinate = own.parts[n].linear.residual_by_coordinate;
      part.linear.usable = part.linear.residual.size() == objective.residual_count();
      part.borrowed = true;
    }
    stage.unrefined = stage.unrefined && part.linear.usable;
    if (share < 1) stage.least_decrease += kUnrefinedDecrease * objective.residual_count();
  }
  refine_model(fitted, other, stage, progress);
  return fitted;
}

FittedModel fit_on_mesh(const DiagnosisSetup& other, const FittedModel& model,
                        const ProgressCallback& progress, bool own_only) {
  FittedModel fitted;
  for (const double share : shares_from(kFirstOnMesh)) {
    fitted = lead_to_mesh(other, model, share, fitted, progress, own_only);
    if (!fitted.usable()) break;
  }
  return fitted;
}

std::vector<DiscretisationError> discretisation_errors(const DiagnosisSetup& setup,
                                                       const FittedModel& model) {
  std::vector<DiscretisationError> errors;
  for (const PooledPart& part : model.parts)
    errors.push_back({.expected = {}, .directions = {part.linear.residual.size(), 0}});
  const auto add = [&](size_t n, const Eigen::VectorXd& direction) {
    Eigen::MatrixXd& directions = errors[n].directions;
    directions.conservativeResize(Eigen::NoChange, directions.cols() + 1);
    directions.rightCols(1) = direction;
  };
  for (size_t n = 0; n < model.parts.size(); ++n) {
    // An expected error of first order is known to half of itself.
    constexpr double kKnownTo = 0.5;
    const PooledPart& part = model.parts[n];
    const TrajectoryObjective half(*model.problems[n], part.frames, part.steps.times(0.5));
    const Eigen::VectorXd residual = half.residuals({part.values}).front();
    if (residual.size() != part.linear.residual.size()) continue;
    errors[n].expected = 2 * (residual - part.linear.residual);
    add(n, kKnownTo * errors[n].expected);
  }
  if (setup.options.spring_set == SpringSet::fabric) {
    const DiagnosisSetup other = with_other_mesh(setup);
    const double finer = static_cast<double>(other.columns - 1) / (setup.columns - 1);
    const FittedModel there = fit_on_mesh(other, model);
    for (size_t n = 0; there.usable() && n < there.parts.size(); ++n) {
      const Eigen::VectorXd& own = model.parts[n].linear.residual;
      const Eigen::VectorXd& residual = there.parts[n].linear.residual;
      // The error is of second order in the spacing: a coarser mesh errs four times as much.
      if (residual.size() == own.size()) add(n, (finer < 1 ? 1.0 / 3 : 4.0 / 3) * (residual - own));
    }
  }
  return errors;
}

void refine_with_discretisation(FittedModel& model, const DiagnosisSetup& setup,
                                const ProgressCallback& progress) {
  if (model.usable() && model.misfits_grossly()) {
    for (PooledPart& part : model.parts) {
      part.correction.resize(0);
      part.directions.resize(part.linear.residual.size(), 0);
      part.amplitudes.resize(0);
    }
    refine_model(model, setup, kNearEnough, progress);
    if (!model.usable() || model.misfits_grossly()) return;
  }
  std::vector<DiscretisationError> errors = discretisation_errors(setup, model);
  for (size_t n = 0; n < errors.size(); ++n) {
    model.parts[n].amplitudes = Eigen::VectorXd::Zero(errors[n].directions.cols());
    model.parts[n].correction = std::move(errors[n].expected);
    model.parts[n].directions = std::move(errors[n].directions);
  }
  for (;;) {
    refine_model(model, setup, {}, progress);
    if (!model.usable()) return;
    bool believable = true;
    for (PooledPart& part : model.parts) {
      std::vector<int> kept;
      for (int k = 0; k < part.amplitudes.size(); ++k)
        if (std::abs(part.amplitudes[k]) < kCriteria.believable_error) kept.push_back(k);
      if (std::ssize(kept) == part.amplitudes.size()) continue;
      believable = false;
      // The first direction is the step's, where an error of it is expected.
      if (kept.empty() || kept.front() > 0) part.correction.resize(0);
      part.directions = Eigen::MatrixXd(part.directions(Eigen::all, kept));
      part.amplitudes = Eigen::VectorXd(part.amplitudes(kept));
    }
    if (believable) return;
  }
}

}  // namespace clothfit
