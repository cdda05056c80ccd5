#include "fit/diagnosis/law_score.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>

#include "data/input_error.h"
#include "fit/prior_cost.h"
#include "fit/uncertainty.h"

namespace clothfit {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// A problem whose effect `term` names has the shape of the term.
FitProblem shaped(const FitProblem& problem, const Term& term) {
  FitProblem result = problem;
  const auto shape = [&](const EffectDescription& effect, std::vector<Binding>& bindings) {
    for (size_t k = 0; k < bindings.size(); ++k)
      if (const auto found = term.shape.find(effect.parameters[k].name);
          found != term.shape.end() && bindings[k].parameter < 0)
        bindings[k].constant = found->second;
  };
  for (size_t e = 0; e < result.effects.size(); ++e)
    if (result.cloth.effect_descriptions[e].name == term.effect)
      shape(result.cloth.effect_descriptions[e], result.effects[e]);
  for (FitProblem::MeasurementTerm& effect : result.measurement)
    if (effect.description.name == term.effect) shape(effect.description, effect.parameters);
  return result;
}

std::vector<int> indices_of(const FitProblem& problem, const Term& term) {
  std::vector<int> indices;
  for (const std::string& name : term.parameters()) indices.push_back(problem.space.index(name));
  return indices;
}

/// One law at one shape; nothing where it cannot act.
LawScore score(const ModelFit& model, const Projection& projection, const FitProblem& problem,
               const Eigen::VectorXd& values, const Term& term) {
  LawScore result{.term = term, .amount = {}, .sigma = {}, .columns = {}};
  const std::vector<int> indices = indices_of(problem, term);
  const TrajectoryObjective objective(problem, model.frames, model.steps);
  const Linearisation linear = objective.linearise_by(values, indices);
  if (!linear.usable) return result;
  const ParameterSpace& space = problem.space;
  Eigen::VectorXd lower(values.size()), upper(values.size());
  for (int p = 0; p < space.size(); ++p) {
    lower[p] = space.parameters[static_cast<size_t>(p)].lower;
    upper[p] = space.parameters[static_cast<size_t>(p)].upper;
  }
  const Eigen::VectorXd here = space.coordinates(values);
  const Eigen::VectorXd down = (space.coordinates(lower) - here)(indices);
  const Eigen::VectorXd up = (space.coordinates(upper) - here)(indices);
  const Eigen::VectorXd slope = space.value_by_coordinate(values)(indices);

  result.columns = projection.columns(linear.residual_by_coordinate);
  const Explained explained = explain(projection.residual(), result.columns, down, up);
  result.amount = explained.amount.cwiseProduct(slope);
  result.fall = explained.fall;
  result.sigma = Eigen::VectorXd::Constant(slope.size(), kInfinite);
  const Eigen::LDLT<Eigen::MatrixXd> information(explained.information);
  const bool seen = information.isPositive() && information.vectorD().minCoeff() > 0;
  if (seen) {
    const Eigen::MatrixXd covariance =
        information.solve(Eigen::MatrixXd::Identity(slope.size(), slope.size()));
    result.sigma = covariance.diagonal().cwiseSqrt().cwiseProduct(slope);
  }
  return result;
}

}  // namespace

Projection project(const DiagnosisSetup& setup, const ModelFit& model,
                   const Eigen::MatrixXd& unit_directions) {
  const TrajectoryObjective objective = model.objective();
  const Eigen::VectorXd& residual = model.linear.residual;
  const double threshold = setup.options.loss == Loss::huber
                               ? kHuberScales * std::max(1.0, robust_scale(residual))
                               : kInfinite;
  const PriorCost prior = prior_cost(*model.problem, model.values);
  return {model.linear.residual_by_coordinate,
          prior.information,
          prior.gradient,
          unit_directions,
          huber_weights(objective, residual, threshold),
          residual};
}

std::vector<LawScore> score_laws(const DiagnosisSetup& setup, const ModelFit& model,
                                 const Projection& projection, const std::vector<LawShapes>& laws,
                                 const ProgressCallback& progress) {
  const std::map<std::string, double> known = values_by_name(*model.problem, model.values);
  struct Test {
    size_t law = 0;
    std::shared_ptr<const FitProblem> problem;
    const Term* term = nullptr;
  };
  std::vector<std::shared_ptr<const FitProblem>> problems(laws.size());
  tbb::parallel_for(size_t{0}, laws.size(), [&](size_t law) {
    std::vector<Term> terms = model.terms;
    terms.push_back(laws[law].front());
    try {
      problems[law] = problem_of(setup, terms);
    } catch (const InputError&) {
      // This effect does not go with this recording, and says why to those who ask for it.
    }
  });
  std::vector<Test> tests;
  for (size_t law = 0; law < laws.size(); ++law)
    if (problems[law])
      for (const Term& term : laws[law]) tests.push_back({law, problems[law], &term});

  std::vector<LawScore> scores(tests.size());
  std::mutex one_at_a_time;
  int done = 0;
  std::atomic<bool> cancelled = false;
  tbb::parallel_for(size_t{0}, tests.size(), [&](size_t n) {
    if (cancelled) return;
    const Test& test = tests[n];
    const FitProblem problem = shaped(*test.problem, *test.term);
    scores[n] = score(model, projection, problem, values_of(problem, known), *test.term);
    if (laws[test.law].size() > 1) scores[n].shapes = static_cast<int>(laws[test.law].size());
    const std::scoped_lock lock(one_at_a_time);
    ++done;
    if (progress && !progress({.stage = "scoring laws",
                               .done = static_cast<double>(done),
                               .total = static_cast<double>(tests.size()),
                               .unit = "laws",
                               .note = ""}))
      cancelled = true;
  });
  if (cancelled) return {};

  const double above =
      projection.residual().squaredNorm() - (projection.weights() - projection.taken());
  std::vector<LawScore> best;
  std::vector<size_t> law_of_best;
  for (size_t n = 0; n < tests.size(); ++n) {
    if (scores[n].columns.size() == 0) continue;
    if (best.empty() || law_of_best.back() != tests[n].law) {
      best.push_back(std::move(scores[n]));
      law_of_best.push_back(tests[n].law);
    } else if (scores[n].fall > best.back().fall) {
      best.back() = std::move(scores[n]);
    }
  }
  for (LawScore& law : best) law.share = above > 0 ? law.fall / above : 0;
  return best;
}

}  // namespace clothfit
