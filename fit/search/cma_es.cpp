#include "fit/search/cma_es.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <optional>
#include <sstream>

#include "data/algebra/dense_factors.h"
#include "fit/jobs/draws.h"

namespace clothfit {
namespace {

constexpr double kNotFinite = std::numeric_limits<double>::infinity();

/// The strategy's constants for n parameters and a population, named as there [hansen2016].
struct Constants {
  Eigen::VectorXd weights;  ///< by rank, the worse half negative
  Eigen::Index mu = 0;      ///< number of positive ones
  double mu_eff = 0;
  double c_sigma = 0, d_sigma = 0, c_c = 0, c_1 = 0, c_mu = 0;
  double expected_norm = 0;  ///< norm of a standard normal vector

  Constants(int parameters, int population) {
    const double n = parameters;
    const Eigen::Index lambda = population;
    weights.resize(lambda);
    for (Eigen::Index i = 0; i < lambda; ++i)
      weights[i] = std::log((population + 1) / 2.0) - std::log(static_cast<double>(i + 1));
    mu = lambda / 2;
    const auto effective = [](const auto& w) { return w.sum() * w.sum() / w.squaredNorm(); };
    mu_eff = effective(weights.head(mu));
    const double mu_eff_negative = effective(weights.tail(lambda - mu));

    c_sigma = (mu_eff + 2) / (n + mu_eff + 5);
    d_sigma = 1 + 2 * std::max(0.0, std::sqrt((mu_eff - 1) / (n + 1)) - 1) + c_sigma;
    c_c = (4 + mu_eff / n) / (n + 4 + 2 * mu_eff / n);
    c_1 = 2 / ((n + 1.3) * (n + 1.3) + mu_eff);
    c_mu = std::min(1 - c_1, 2 * (0.25 + mu_eff + 1 / mu_eff - 2) / ((n + 2) * (n + 2) + mu_eff));
    const double most_negative = std::min(
        {1 + c_1 / c_mu, 1 + 2 * mu_eff_negative / (mu_eff + 2), (1 - c_1 - c_mu) / (n * c_mu)});
    weights.head(mu) /= weights.head(mu).sum();
    weights.tail(lambda - mu) *= most_negative / -weights.tail(lambda - mu).sum();
    expected_norm = std::sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n));
  }
};

/// The factors of C = B D^2 B'.
struct Axes {
  Eigen::MatrixXd directions;  ///< B
  Eigen::VectorXd lengths;     ///< D

  explicit Axes(const Eigen::MatrixXd& covariance) {
    const SymmetricEigen eigen = symmetric_eigen(covariance);
    directions = eigen.vectors;
    lengths = eigen.values.cwiseMax(0).cwiseSqrt();
  }
  /// Returns C^-1/2 y.
  Eigen::VectorXd whitened(const Eigen::VectorXd& y) const {
    return directions * (directions.transpose() * y).cwiseQuotient(lengths);
  }
};

void begin_run(const Eigen::VectorXd& mean, int population, const CmaOptions& options,
               CmaState& state) {
  const Eigen::Index n = mean.size();
  state.population = population;
  state.mean = mean;
  state.step = options.initial_step;
  state.covariance = Eigen::MatrixXd::Identity(n, n);
  state.covariance_path = state.step_path = Eigen::VectorXd::Zero(n);
  state.generation = 0;
  state.recent_best.clear();
  state.so_far = {};
}

/// Returns how many generations' best costs are compared.
size_t compared_generations(const CmaState& state) {
  return static_cast<size_t>(
      10 + std::ceil(30.0 * static_cast<double>(state.mean.size()) / state.population));
}

std::optional<CmaEnd> end_of_run(const CmaOptions& options, const CmaState& state, const Axes& axes,
                                 const Eigen::VectorXd& ranked_costs) {
  if (!std::isfinite(ranked_costs[0])) return CmaEnd::nothing_finite;
  if (state.recent_best.size() == compared_generations(state)) {
    const auto [low, high] = std::ranges::minmax(state.recent_best);
    const double worst = std::max(high, ranked_costs.maxCoeff());
    const double best = std::min(low, ranked_costs[0]);
    const double size = std::max(std::abs(worst), std::abs(best));
    if (std::isfinite(worst) &&
        worst - best <= std::max(options.cost_tolerance * size, std::numeric_limits<double>::min()))
      return CmaEnd::costs_equal;
  }
  const Eigen::ArrayXd deviations = state.covariance.diagonal().array().max(0).sqrt();
  const Eigen::ArrayXd reach = deviations.max(state.covariance_path.array().abs());
  if ((state.step * reach < options.step_tolerance * options.initial_step).all())
    return CmaEnd::steps_small;
  if (axes.lengths.maxCoeff() > 1e7 * axes.lengths.minCoeff()) return CmaEnd::ill_conditioned;
  const double n = static_cast<double>(state.mean.size());
  if (state.generation > 100 + 150 * (n + 3) * (n + 3) / std::sqrt(state.population))
    return CmaEnd::too_long;
  return std::nullopt;
}

/// Returns ranks of costs, best first; equal ones in the order of their places.
std::vector<Eigen::Index> ranked(const Eigen::VectorXd& costs) {
  std::vector<Eigen::Index> order(static_cast<size_t>(costs.size()));
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](Eigen::Index k) { return costs[k]; });
  return order;
}

/// Updates mean, step and covariance by a generation's steps y, by rank. y is n x population, in
/// units of sigma.
void adapt(const Axes& axes, const Eigen::MatrixXd& y, const Constants& k, CmaState& state) {
  const double n = static_cast<double>(state.mean.size());
  const Eigen::VectorXd towards = y.leftCols(k.mu) * k.weights.head(k.mu);
  state.mean += state.step * towards;

  state.step_path = (1 - k.c_sigma) * state.step_path +
                    std::sqrt(k.c_sigma * (2 - k.c_sigma) * k.mu_eff) * axes.whitened(towards);
  const double length = state.step_path.norm();
  const double settled = std::sqrt(1 - std::pow(1 - k.c_sigma, 2.0 * (state.generation + 1)));
  const bool moderate = length / settled < (1.4 + 2 / (n + 1)) * k.expected_norm;
  state.covariance_path *= 1 - k.c_c;
  if (moderate) state.covariance_path += std::sqrt(k.c_c * (2 - k.c_c) * k.mu_eff) * towards;

  Eigen::VectorXd weights = k.weights;
  for (Eigen::Index i = k.mu; i < weights.size(); ++i)
    weights[i] *= n / axes.whitened(y.col(i)).squaredNorm();
  const double kept_for_stall = moderate ? 0 : k.c_1 * k.c_c * (2 - k.c_c);
  const double kept = 1 + kept_for_stall - k.c_1 - k.c_mu * k.weights.sum();
  state.covariance =
      (kept * state.covariance + k.c_1 * state.covariance_path * state.covariance_path.transpose() +
       k.c_mu * y * weights.asDiagonal() * y.transpose())
          .eval();
  state.covariance = (0.5 * (state.covariance + state.covariance.transpose())).eval();
  state.step *= std::exp(k.c_sigma / k.d_sigma * (length / k.expected_norm - 1));
}

std::optional<CmaStop> stop_reason(const CmaOptions& options, const CmaState& state) {
  if (state.best().cost <= options.cost_below) return CmaStop::cost_below;
  if (static_cast<int>(state.optima.size()) > options.restarts) return CmaStop::restarts_used;
  if (state.evaluations >= options.most_evaluations) return CmaStop::most_evaluations;
  return std::nullopt;
}

std::string message_of(CmaStop stop, const CmaState& state) {
  std::ostringstream text;
  switch (stop) {
    case CmaStop::not_run:
      text << "not run";
      break;
    case CmaStop::cost_below:
      text << "the cost is as low as asked";
      break;
    case CmaStop::most_evaluations:
      text << "as many evaluations as allowed";
      break;
    case CmaStop::restarts_used:
      text << "all restarts are used";
      break;
    case CmaStop::cancelled:
      text << "cancelled";
      break;
  }
  text << ": best cost " << state.best().cost << " after " << state.evaluations
       << " evaluations in " << state.optima.size() + (state.generation > 0 ? 1 : 0) << " runs";
  return text.str();
}

}  // namespace

int CmaOptions::first_population(int parameters) const {
  if (population > 0) return population;
  return 4 + static_cast<int>(std::floor(3 * std::log(parameters)));
}

bool CmaOptions::valid() const {
  return (population == 0 || population >= 4) && initial_step > 0 && std::isfinite(initial_step) &&
         restarts >= 0 && growth >= 1 && growth <= 10 && most_evaluations >= 1 &&
         cost_tolerance >= 0 && step_tolerance >= 0;
}

const CmaOptimum& CmaState::best() const {
  const auto least = std::ranges::min_element(optima, {}, &CmaOptimum::cost);
  return least != optima.end() && least->cost <= so_far.cost ? *least : so_far;
}

bool CmaResult::usable() const {
  return std::isfinite(state.best().cost);
}

double diversity(const CmaState& state) {
  // The trace is the sum of the eigenvalues.
  return state.step * std::sqrt(state.covariance.trace() / static_cast<double>(state.mean.size()));
}

CmaState start_cma(const std::vector<SearchParameter>& parameters, const CmaOptions& options,
                   const Eigen::VectorXd& given) {
  assert(options.valid());
  require_ranges(parameters);
  const auto n = static_cast<Eigen::Index>(parameters.size());
  assert(given.size() == 0 || given.size() == n);
  Eigen::VectorXd mean = Eigen::VectorXd::Constant(n, 0.5);
  for (Eigen::Index p = 0; p < given.size(); ++p) {
    const SearchParameter& parameter = parameters[static_cast<size_t>(p)];
    mean[p] = parameter.fraction(std::clamp(given[p], parameter.lower, parameter.upper));
  }
  CmaState state;
  begin_run(mean, options.first_population(static_cast<int>(n)), options, state);
  return state;
}

CmaState next_cma_generation(const std::vector<SearchParameter>& parameters,
                             const CmaOptions& options, const GenerationCost& cost,
                             CmaState state) {
  const Eigen::Index n = state.mean.size(), lambda = state.population;
  const Axes axes(state.covariance);
  Eigen::MatrixXd steps(n, lambda), values(n, lambda);
  for (Eigen::Index place = 0; place < lambda; ++place) {
    Draws draws(options.seed, state.generations(), static_cast<int>(place));
    Eigen::VectorXd z(n);
    for (double& number : z) number = draws.normal();
    steps.col(place) = axes.directions * axes.lengths.cwiseProduct(z);
    for (Eigen::Index p = 0; p < n; ++p)
      values(p, place) = parameters[static_cast<size_t>(p)].value_at(
          reflected(state.mean[p] + state.step * steps(p, place)));
  }
  Eigen::VectorXd costs = cost(values);
  assert(costs.size() == lambda);
  for (double& value : costs)
    if (!std::isfinite(value)) value = kNotFinite;

  const std::vector<Eigen::Index> order = ranked(costs);
  Eigen::MatrixXd y(n, lambda);
  Eigen::VectorXd ranked_costs(lambda);
  for (Eigen::Index rank = 0; rank < lambda; ++rank) {
    y.col(rank) = steps.col(order[static_cast<size_t>(rank)]);
    ranked_costs[rank] = costs[order[static_cast<size_t>(rank)]];
  }
  if (ranked_costs[0] < state.so_far.cost) {
    state.so_far.cost = ranked_costs[0];
    state.so_far.values = values.col(order.front());
  }
  state.evaluations += lambda;
  state.so_far.evaluations += lambda;
  state.best_cost.push_back(state.best().cost);
  state.recent_best.push_back(ranked_costs[0]);
  if (state.recent_best.size() > compared_generations(state))
    state.recent_best.erase(state.recent_best.begin());
  adapt(axes, y, Constants(static_cast<int>(n), state.population), state);
  ++state.generation;

  if (const std::optional<CmaEnd> end = end_of_run(options, state, axes, ranked_costs)) {
    state.so_far.end = *end;
    state.optima.push_back(state.so_far);
    Draws draws(options.seed, -1, static_cast<int>(state.optima.size()));
    Eigen::VectorXd mean(n);
    for (double& share : mean) share = draws.uniform();
    // A generation that alone uses up the evaluations is as large as one can be.
    const double larger = std::min(
        state.population * options.growth,
        static_cast<double>(std::min<long>(options.most_evaluations, kLargestCmaPopulation)));
    begin_run(mean, std::max(state.population, static_cast<int>(larger)), options, state);
  }
  return state;
}

CmaResult search_by_cma(const std::vector<SearchParameter>& parameters, const CmaOptions& options,
                        const GenerationCost& cost, CmaState state,
                        const ProgressCallback& progress, const CmaWatcher& after_generation) {
  assert(options.valid());
  require_ranges(parameters);
  CmaResult result;
  std::optional<CmaStop> stop = stop_reason(options, state);
  while (!stop) {
    state = next_cma_generation(parameters, options, cost, std::move(state));
    if (after_generation) after_generation(state);
    stop = stop_reason(options, state);
    std::ostringstream note;
    note << "best cost " << state.best().cost << ", diversity " << diversity(state);
    if (!stop && progress &&
        !progress({.stage = "search",
                   .done = static_cast<double>(state.evaluations),
                   .total = static_cast<double>(options.most_evaluations),
                   .unit = "evaluations",
                   .note = note.str()}))
      stop = CmaStop::cancelled;
  }
  result.stop = *stop;
  result.message = message_of(*stop, state);
  result.state = std::move(state);
  return result;
}

}  // namespace clothfit
