#include "fit/pooled_fit.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "data/input_error.h"
#include "fit/objective.h"
#include "fit/parameterised_model.h"
#include "fit/prior_cost.h"
#include "model/stability.h"

namespace clothfit {
namespace {

/// One recording's part of the expansion, over the parameters of its own space.
struct Part {
  bool usable = false;
  double cost = 0;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd information;
};

Part expand_one(const FitProblem& problem, const TimeSteps& steps, const Eigen::VectorXd& values) {
  const TrajectoryObjective objective(problem, problem.first_held_out, steps);
  const Linearisation linear = objective.linearise(values);
  Part part;
  if (!linear.usable) return part;
  const Eigen::MatrixXd& jacobian = linear.residual_by_coordinate;
  const PriorCost prior = prior_cost(problem, values);
  part.cost = 0.5 * linear.residual.squaredNorm() + prior.cost;
  part.gradient = jacobian.transpose() * linear.residual + prior.gradient;
  part.information = jacobian.transpose() * jacobian + prior.information;
  part.usable = true;
  return part;
}

/// A coordinate that a step must not change: at a bound that keeps it from a lower cost.
std::vector<bool> held_at(const Eigen::VectorXd& x, const Eigen::VectorXd& lower,
                          const Eigen::VectorXd& upper, const Eigen::VectorXd& gradient) {
  std::vector<bool> held(static_cast<size_t>(x.size()));
  for (Eigen::Index p = 0; p < x.size(); ++p) {
    const double edge = 1e-12 * (upper[p] - lower[p]);
    held[static_cast<size_t>(p)] =
        gradient[p] > 0 ? x[p] - lower[p] <= edge : upper[p] - x[p] <= edge;
  }
  return held;
}

std::vector<TimeSteps> stable_steps(std::span<const FitProblem* const> problems,
                                    const std::vector<Eigen::VectorXd>& values) {
  std::vector<TimeSteps> steps;
  for (size_t n = 0; n < problems.size(); ++n)
    steps.push_back(stable_time_steps(problems[n]->cloth, parameter_set(*problems[n], values[n])));
  return steps;
}

}  // namespace

PooledCost::PooledCost(std::span<const FitProblem* const> problems, std::vector<TimeSteps> steps)
    : problems_(problems), steps_(std::move(steps)), places_(problems.size()) {
  if (problems.empty() || steps_.size() != problems.size())
    throw InputError("pooled fit", "no recordings, or not a time step for each", "at least one");
  const ParameterSpace& first = problems.front()->space;
  for (const FitParameter& parameter : first.parameters) {
    if (!is_physical(parameter.role)) continue;
    std::vector<int> indices;
    for (const FitProblem* problem : problems)
      indices.push_back(problem->space.index(parameter.name));
    if (std::ranges::find(indices, -1) != indices.end())
      throw InputError("pooled fit", "not all recordings have the parameter " + parameter.name,
                       "recordings of one cloth, with the same effects");
    shared_.push_back(std::move(indices));
  }
  size_ = shared();
  for (size_t n = 0; n < problems.size(); ++n) {
    const ParameterSpace& space = problems[n]->space;
    for (int p = 0; p < space.size(); ++p)
      if (!is_physical(space.parameters[static_cast<size_t>(p)].role)) places_[n].own.push_back(p);
    if (space.size() - static_cast<int>(places_[n].own.size()) != shared())
      throw InputError("pooled fit", "a recording has parameters of the physics that others lack",
                       "recordings of one cloth, with the same effects");
    places_[n].first = size_;
    size_ += static_cast<int>(places_[n].own.size());
  }
}

Eigen::VectorXd PooledCost::coordinates(const std::vector<Eigen::VectorXd>& values) const {
  Eigen::VectorXd x(size_);
  for (size_t n = problems_.size(); n-- > 0;) {  // the first one's shared values stay
    const Eigen::VectorXd own = problems_[n]->space.coordinates(values[n]);
    for (int s = 0; s < shared(); ++s) x[s] = own[shared_[static_cast<size_t>(s)][n]];
    x.segment(places_[n].first, static_cast<Eigen::Index>(places_[n].own.size())) =
        own(places_[n].own);
  }
  return x;
}

std::vector<Eigen::VectorXd> PooledCost::values(const Eigen::VectorXd& coordinates) const {
  std::vector<Eigen::VectorXd> result;
  for (size_t n = 0; n < problems_.size(); ++n) {
    Eigen::VectorXd own(problems_[n]->space.size());
    for (int s = 0; s < shared(); ++s) own[shared_[static_cast<size_t>(s)][n]] = coordinates[s];
    own(places_[n].own) =
        coordinates.segment(places_[n].first, static_cast<Eigen::Index>(places_[n].own.size()));
    result.push_back(problems_[n]->space.values(own));
  }
  return result;
}

Eigen::VectorXd PooledCost::lower() const {
  std::vector<Eigen::VectorXd> ends;
  for (const FitProblem* problem : problems_) {
    Eigen::VectorXd end(problem->space.size());
    for (int p = 0; p < problem->space.size(); ++p)
      end[p] = problem->space.parameters[static_cast<size_t>(p)].lower;
    ends.push_back(end);
  }
  return coordinates(ends);
}

Eigen::VectorXd PooledCost::upper() const {
  std::vector<Eigen::VectorXd> ends;
  for (const FitProblem* problem : problems_) {
    Eigen::VectorXd end(problem->space.size());
    for (int p = 0; p < problem->space.size(); ++p)
      end[p] = problem->space.parameters[static_cast<size_t>(p)].upper;
    ends.push_back(end);
  }
  return coordinates(ends);
}

double PooledCost::at(const Eigen::VectorXd& coordinates) const {
  const std::vector<Eigen::VectorXd> values_of = values(coordinates);
  std::vector<double> costs(problems_.size(), std::numeric_limits<double>::infinity());
  tbb::parallel_for(size_t{0}, problems_.size(), [&](size_t n) {
    const TrajectoryObjective objective(*problems_[n], problems_[n]->first_held_out, steps_[n]);
    const Eigen::VectorXd residual = objective.residuals({values_of[n]}).front();
    if (residual.size() == objective.residual_count())
      costs[n] = 0.5 * residual.squaredNorm() + prior_cost(*problems_[n], values_of[n]).cost;
  });
  double sum = 0;
  for (const double cost : costs) sum += cost;
  return sum;
}

PooledCost::Expansion PooledCost::expand(const Eigen::VectorXd& coordinates) const {
  const std::vector<Eigen::VectorXd> values_of = values(coordinates);
  std::vector<Part> parts(problems_.size());
  tbb::parallel_for(size_t{0}, problems_.size(), [&](size_t n) {
    parts[n] = expand_one(*problems_[n], steps_[n], values_of[n]);
  });
  Expansion result{.usable = true,
                   .gradient = Eigen::VectorXd::Zero(size_),
                   .shared = Eigen::MatrixXd::Zero(shared(), shared()),
                   .own = {},
                   .between = {}};
  for (size_t n = 0; n < parts.size(); ++n) {
    result.usable = result.usable && parts[n].usable;
    if (!result.usable) return result;
    std::vector<int> common;
    for (const std::vector<int>& indices : shared_) common.push_back(indices[n]);
    const std::vector<int>& own = places_[n].own;
    result.cost += parts[n].cost;
    result.gradient.head(shared()) += parts[n].gradient(common);
    result.gradient.segment(places_[n].first, static_cast<Eigen::Index>(own.size())) =
        parts[n].gradient(own);
    result.shared += parts[n].information(common, common);
    result.own.push_back(parts[n].information(own, own));
    result.between.push_back(parts[n].information(own, common));
  }
  return result;
}

Eigen::VectorXd PooledCost::step(const Expansion& expansion, double damping,
                                 const std::vector<bool>& held) const {
  // A held coordinate, or one that nothing depends on, keeps a unit of its own on the diagonal.
  const auto prepared = [&](Eigen::MatrixXd information, int first) {
    for (Eigen::Index p = 0; p < information.rows(); ++p) {
      information(p, p) *= 1 + damping;
      if (!held[static_cast<size_t>(first + p)] && information(p, p) > 0) continue;
      information.row(p).setZero();
      information.col(p).setZero();
      information(p, p) = 1;
    }
    return information;
  };
  Eigen::VectorXd gradient = expansion.gradient;
  for (Eigen::Index p = 0; p < size_; ++p)
    if (held[static_cast<size_t>(p)]) gradient[p] = 0;
  Eigen::MatrixXd reduced = prepared(expansion.shared, 0);
  Eigen::VectorXd right = -gradient.head(shared());
  std::vector<Eigen::LDLT<Eigen::MatrixXd>> own;
  std::vector<Eigen::MatrixXd> between;
  for (size_t n = 0; n < places_.size(); ++n) {
    own.emplace_back(prepared(expansion.own[n], places_[n].first));
    between.push_back(expansion.between[n]);
    for (Eigen::Index p = 0; p < between[n].rows(); ++p)
      if (held[static_cast<size_t>(places_[n].first + p)]) between[n].row(p).setZero();
    for (Eigen::Index s = 0; s < shared(); ++s)
      if (held[static_cast<size_t>(s)]) between[n].col(s).setZero();
    if (between[n].rows() == 0) continue;
    reduced -= between[n].transpose() * own[n].solve(between[n]);
    right += between[n].transpose() *
             own[n].solve(gradient.segment(places_[n].first, between[n].rows()));
  }
  Eigen::VectorXd step(size_);
  step.head(shared()) = reduced.ldlt().solve(right);
  for (size_t n = 0; n < places_.size(); ++n) {
    const Eigen::Index count = between[n].rows();
    if (count == 0) continue;
    step.segment(places_[n].first, count) =
        own[n].solve(-gradient.segment(places_[n].first, count) - between[n] * step.head(shared()));
  }
  return step;
}

PooledFit fit_pooled(std::span<const FitProblem* const> problems,
                     const std::map<std::string, double>& start, const PooledOptions& options,
                     const ProgressCallback& progress) {
  PooledFit result;
  for (const FitProblem* problem : problems) {
    result.values.push_back(problem->space.start());
    for (const auto& [name, value] : start)
      if (const int p = problem->space.index(name); p >= 0) result.values.back()[p] = value;
  }
  constexpr double kLeastDamping = 1e-9, kMostDamping = 1e6;
  for (int round = 0; round < options.rounds; ++round) {
    std::vector<TimeSteps> steps = stable_steps(problems, result.values);
    for (TimeSteps& of : steps) of = of.times(1 / options.stability_margin);
    const PooledCost pooled(problems, steps);
    const Eigen::VectorXd lower = pooled.lower(), upper = pooled.upper();
    Eigen::VectorXd x = pooled.coordinates(result.values).cwiseMax(lower).cwiseMin(upper);
    const Eigen::VectorXd began = x;
    PooledCost::Expansion here = pooled.expand(x);
    if (!here.usable) {
      result.message = "a recording cannot be simulated from the starting values";
      return result;
    }
    double damping = 1e-4;
    bool settled = false;
    while (!settled && result.iterations < options.iterations) {
      if (progress && !progress({.stage = "pooled fit",
                                 .done = static_cast<double>(result.iterations),
                                 .total = static_cast<double>(options.iterations),
                                 .note = "cost " + std::to_string(here.cost)})) {
        result.usable = false;
        result.message = "cancelled";
        return result;
      }
      ++result.iterations;
      const Eigen::VectorXd step =
          pooled.step(here, damping, held_at(x, lower, upper, here.gradient));
      const Eigen::VectorXd next = (x + step).cwiseMax(lower).cwiseMin(upper);
      const double moved = (next - x).head(pooled.shared()).cwiseAbs().maxCoeff();
      PooledCost::Expansion there;
      if (step.allFinite()) there = pooled.expand(next);
      if (!there.usable || !(there.cost <= here.cost)) {
        // A step this short that rises is the cost's rounding.
        settled = moved < options.least_step;
        damping *= 10;
        if (damping > kMostDamping) break;
        continue;
      }
      settled = moved < options.least_step;
      x = next;
      here = std::move(there);
      damping = std::max(kLeastDamping, 0.1 * damping);
    }
    result.values = pooled.values(x);
    result.cost = here.cost;
    result.usable = true;
    // A round that hardly moved had the time steps of where it ended.
    constexpr double kStill = 1e-4;
    result.converged = settled && (x - began).head(pooled.shared()).cwiseAbs().maxCoeff() < kStill;
    if (result.converged || result.iterations >= options.iterations) break;
  }
  result.message = result.converged ? "converged" : "not converged";
  const ParameterSpace& space = problems.front()->space;
  for (int p = 0; p < space.size(); ++p)
    if (const FitParameter& parameter = space.parameters[static_cast<size_t>(p)];
        is_physical(parameter.role))
      result.shared[parameter.name] = result.values.front()[p];
  return result;
}

}  // namespace clothfit
