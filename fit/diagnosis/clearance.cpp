#include "fit/diagnosis/clearance.h"

#include <algorithm>
#include <cmath>

#include "data/algebra/dense_factors.h"
#include "data/median.h"
#include "fit/diagnosis/criteria.h"
#include "fit/diagnosis/worth.h"
#include "fit/problem/effects_of.h"
#include "fit/refine/pooled_space.h"
#include "fit/uncertainty/uncertainty.h"

namespace clothfit {
namespace {

/// Writes the arrow of all recordings' information as one matrix.
Eigen::MatrixXd dense(const PooledSpace& space, const PooledSpace::Expansion& expansion) {
  const auto shared = static_cast<Eigen::Index>(space.shared());
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(space.size(), space.size());
  all.topLeftCorner(shared, shared) = expansion.shared;
  for (size_t n = 0; n < space.recordings(); ++n) {
    const Eigen::MatrixXd& between = expansion.between[n];
    const auto first = static_cast<Eigen::Index>(space.first_own(n));
    all.block(first, first, between.rows(), between.rows()) = expansion.own[n];
    all.block(first, 0, between.rows(), shared) = between;
    all.block(0, first, shared, between.rows()) = between.transpose();
  }
  return all;
}

double spread_of(double correlation) {
  constexpr double kMost = 0.99;
  const double rho = std::clamp(correlation, 0.0, kMost);
  return (1 + rho) / (1 - rho);
}

/// Returns how much larger structure in the residuals makes variances than independent ones would
/// be.
double inflation(const Adequacy& structure) {
  const double along = spread_of(structure.neighbour_correlation);
  return std::max(1.0, structure.chi_square_per_dof) * spread_of(structure.time_correlation) *
         along * along;
}

/// Returns the covariance of the coordinates.
Eigen::MatrixXd covariance(const PooledSpace& space, const std::vector<Quadratic>& quadratics) {
  Eigen::MatrixXd information = dense(space, space.gather(quadratics));
  information.diagonal().array() += 1e-12 * std::max(1.0, information.diagonal().maxCoeff());
  return SymmetricFactors(information)
      .solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()));
}

/// Expands the cost of each recording, by the residuals' trend where derivatives are rough. Empty
/// where a recording cannot be expanded.
std::vector<Quadratic> quadratics_of(const FittedModel& model, double threshold) {
  std::vector<Quadratic> quadratics;
  for (size_t n = 0; n < model.parts.size(); ++n) {
    PooledPart part = model.parts[n];
    if (!part.linear.usable) return {};
    Eigen::MatrixXd& jacobian = part.linear.residual_by_coordinate;
    jacobian = trend_of(model.objective(n), part.values, jacobian).residual_by_coordinate;
    quadratics.push_back(quadratic_of(*model.problems[n], part, threshold));
    if (!quadratics.back().usable) return {};
  }
  return quadratics;
}

/// The distance of a hypothesis' amplitudes from neutral.
struct FromNeutral {
  double square = 0;  ///< squared, in standard deviations of independent residuals
  Eigen::Index amplitudes = 1;
};

/// Measures the last hypothesis' distance. It is nothing where derivatives are missing.
FromNeutral from_neutral(const FittedModel& model, double threshold) {
  const std::vector<const FitProblem*> problems = model.problem_pointers();
  const PooledSpace pooled(problems);
  const Hypothesis& hypothesis = model.hypotheses.back();
  const EffectDescription effect = describe_effect(hypothesis.effect);
  std::vector<Eigen::Index> indices;
  std::vector<double> away;
  const std::vector<Quadratic> quadratics = quadratics_of(model, threshold);
  if (quadratics.empty()) return {};
  for (size_t n = 0; n < problems.size(); ++n) {
    const ParameterSpace& space = problems[n]->space;
    const Eigen::VectorXd slope = space.value_by_coordinate(model.parts[n].values);
    for (const std::string& name : hypothesis.amplitudes) {
      const int p = space.index(hypothesis.effect + "." + name);
      const std::vector<int>& own = pooled.own_of(n);
      if (const auto found = std::ranges::find(own, p); found != own.end()) {
        indices.push_back(pooled.first_own(n) + (found - own.begin()));
      } else {
        if (n > 0) continue;  // shared, and counted already
        const std::vector<int> shared = pooled.shared_of(n);
        indices.push_back(std::ranges::find(shared, p) - shared.begin());
      }
      const double neutral =
          std::ranges::find(effect.parameters, name, &EffectParameter::name)->neutral;
      away.push_back((model.parts[n].values[p] - neutral) / slope[p]);
    }
  }
  const Eigen::Map<const Eigen::VectorXd> way(away.data(), static_cast<Eigen::Index>(away.size()));
  const Eigen::MatrixXd own = covariance(pooled, quadratics)(indices, indices);
  const double square = way.dot(SymmetricFactors(own).solve(way));
  return {.square = std::isfinite(square) ? std::max(0.0, square) : 0, .amplitudes = way.size()};
}

}  // namespace

double clear_of_neutral(const FittedModel& model, const Adequacy& structure, double threshold) {
  const FromNeutral own = from_neutral(model, threshold);
  return clear_by(own.square, own.amplitudes, structure);
}

double clear_by(double decrease, Eigen::Index numbers, const Adequacy& structure) {
  return kCriteria.clear_of_neutral *
         std::sqrt(decrease / inflation(structure) / least_decrease(numbers));
}

double rise_without_last(const FittedModel& model, double threshold) {
  return from_neutral(model, threshold).square;
}

std::vector<NamedValues> sigma_of(const FittedModel& model, const Adequacy& structure,
                                  double threshold) {
  const std::vector<const FitProblem*> problems = model.problem_pointers();
  const PooledSpace pooled(problems);
  const std::vector<Quadratic> quadratics = quadratics_of(model, threshold);
  std::vector<NamedValues> result(problems.size());
  if (quadratics.empty()) return result;
  const Eigen::VectorXd variance = inflation(structure) * covariance(pooled, quadratics).diagonal();
  for (size_t n = 0; n < problems.size(); ++n) {
    const ParameterSpace& space = problems[n]->space;
    const Eigen::VectorXd slope = space.value_by_coordinate(model.parts[n].values);
    const auto add = [&](int p, Eigen::Index coordinate) {
      result[n][space.parameters[static_cast<size_t>(p)].name] =
          slope[p] * std::sqrt(std::max(0.0, variance[coordinate]));
    };
    const std::vector<int> shared = pooled.shared_of(n);
    for (size_t k = 0; k < shared.size(); ++k) add(shared[k], static_cast<Eigen::Index>(k));
    const std::vector<int>& own = pooled.own_of(n);
    for (size_t k = 0; k < own.size(); ++k)
      add(own[k], pooled.first_own(n) + static_cast<Eigen::Index>(k));
  }
  return result;
}

double typical_roughness(const FittedModel& model) {
  std::vector<double> all;
  for (size_t n = 0; n < model.parts.size(); ++n) {
    const PooledPart& part = model.parts[n];
    const ParameterSpace& space = model.problems[n]->space;
    const Eigen::VectorXd roughness =
        trend_of(model.objective(n), part.values, part.linear.residual_by_coordinate).roughness;
    for (int p = 0; p < space.size(); ++p)
      if (is_physical(space.parameters[static_cast<size_t>(p)].role)) all.push_back(roughness[p]);
  }
  const double typical = all.empty() ? 1 : median(all);
  return typical > kRoughSlope ? typical : 1;
}

}  // namespace clothfit
