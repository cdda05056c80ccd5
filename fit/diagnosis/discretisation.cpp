#include "fit/diagnosis/discretisation.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "fit/identify.h"
#include "fit/other_mesh.h"
#include "fit/parameterised_model.h"
#include "fit/prior_cost.h"
#include "fit/uncertainty.h"
#include "model/relax.h"

namespace clothfit {
namespace {

/// Residuals on another mesh, with the parameters that suit it: chord steps from here with the
/// derivatives of the model's own mesh, as long as they lead down. Empty where the other mesh does
/// not run.
Eigen::VectorXd refitted_residual(const ModelFit& model, const TrajectoryObjective& other,
                                  Eigen::VectorXd values) {
  constexpr int kSteps = 4;
  const ParameterSpace& space = other.problem().space;
  const Eigen::MatrixXd& jacobian = model.linear.residual_by_coordinate;
  const Eigen::VectorXd weight =
      huber_weights(model.objective(), model.linear.residual,
                    kHuberScales * std::max(1.0, robust_scale(model.linear.residual)));
  const Eigen::MatrixXd weighted = weight.asDiagonal() * jacobian;
  const auto cost = [&](const Eigen::VectorXd& residual, const PriorCost& prior) {
    return 0.5 * residual.cwiseAbs2().dot(weight) + prior.cost;
  };
  Eigen::VectorXd lower(space.size()), upper(space.size());
  for (int p = 0; p < space.size(); ++p) {
    lower[p] = space.parameters[static_cast<size_t>(p)].lower;
    upper[p] = space.parameters[static_cast<size_t>(p)].upper;
  }
  Eigen::VectorXd residual = other.residuals({values}).front();
  if (residual.size() != jacobian.rows()) return {};
  PriorCost prior = prior_cost(other.problem(), values);
  Eigen::MatrixXd information = weighted.transpose() * jacobian + prior.information;
  information.diagonal() *= 1 + 1e-6;
  const Eigen::LDLT<Eigen::MatrixXd> solver(information);
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::VectorXd change = -solver.solve(weighted.transpose() * residual + prior.gradient);
    const Eigen::VectorXd next =
        space.values(space.coordinates(values) + change).cwiseMax(lower).cwiseMin(upper);
    const Eigen::VectorXd there = other.residuals({next}).front();
    if (there.size() != residual.size()) break;
    const PriorCost prior_there = prior_cost(other.problem(), next);
    if (cost(there, prior_there) >= cost(residual, prior)) break;
    values = next;
    residual = there;
    prior = prior_there;
  }
  return residual;
}

}  // namespace

Eigen::MatrixXd discretisation_directions(const DiagnosisSetup& setup, const ModelFit& model) {
  const FitProblem& problem = *model.problem;
  std::vector<Eigen::VectorXd> directions;
  const auto add = [&](const Eigen::VectorXd& residual, double factor) {
    if (residual.size() == model.linear.residual.size())
      directions.push_back(factor * (residual - model.linear.residual));
  };
  const TrajectoryObjective half(problem, model.frames, model.steps.times(0.5));
  add(half.residuals({model.values}).front(), 2);

  if (problem.spring_set == SpringSet::fabric) {
    int least = kSmallestMesh;
    if (problem.start == StartKind::unknown) least = std::max(least, setup.options.start_nodes + 1);
    DiagnosisSetup other = setup;
    std::tie(other.columns, other.rows) = other_mesh_of(setup.columns, setup.rows, least);
    const auto other_problem = problem_of(other, model.terms);
    const Eigen::VectorXd values = values_of(*other_problem, values_by_name(problem, model.values));
    const double finer = static_cast<double>(other.columns - 1) / (setup.columns - 1);
    const TimeSteps stable =
        stable_time_steps(other_problem->cloth, parameter_set(*other_problem, values));
    const TimeSteps steps{std::min(model.steps.run_s, stable.run_s / 1.5),
                          std::min(model.steps.rest_s, stable.rest_s / 1.5)};
    const TrajectoryObjective objective(*other_problem, model.frames, steps);
    // Of second order in the spacing: a coarser mesh errs four times as much.
    add(refitted_residual(model, objective, values), finer < 1 ? 1.0 / 3 : 4.0 / 3);
  }

  Eigen::MatrixXd result(model.linear.residual.size(),
                         static_cast<Eigen::Index>(directions.size()));
  for (size_t k = 0; k < directions.size(); ++k)
    result.col(static_cast<Eigen::Index>(k)) = directions[k];
  return result;
}

}  // namespace clothfit
