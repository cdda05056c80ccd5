#include "fit/refine/pooled_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "data/algebra/dense_factors.h"
#include "data/input_error.h"
#include "data/parallel.h"
#include "fit/cost/huber.h"
#include "fit/jobs/stop_token.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/prior_cost.h"
#include "fit/refine/derivative_reuse.h"
#include "fit/refine/least_squares.h"
#include "fit/refine/refine.h"
#include "model/cloth/stability.h"

namespace clothfit {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

TrajectoryObjective objective_of(const FitProblem& problem, const PooledPart& part) {
  return {problem, part.frames, part.steps};
}

/// Returns the amplitudes of directions that leave least of a residual under weights.
Eigen::VectorXd amplitudes_of(const Eigen::MatrixXd& directions, const Eigen::VectorXd& weight,
                              const Eigen::VectorXd& residual) {
  if (directions.cols() == 0) return {};
  const Eigen::MatrixXd weighted = weight.asDiagonal() * directions;
  Eigen::MatrixXd information = weighted.transpose() * directions;
  information.diagonal().array() += 1;
  return -SymmetricFactors(information).solve(weighted.transpose() * residual);
}

/// Fits the amplitudes of a part's directions to its residual. Returns its cost, priors included.
double fit_directions(const FitProblem& problem, PooledPart& part, double threshold) {
  const TrajectoryObjective objective = objective_of(problem, part);
  if (part.amplitudes.size() != part.directions.cols())
    part.amplitudes = Eigen::VectorXd::Zero(part.directions.cols());
  if (part.directions.cols() > 0)
    part.amplitudes =
        amplitudes_of(part.directions, huber_weights(objective, residual_of(part), threshold),
                      corrected_residual(part));
  return huber_cost(objective, residual_of(part), threshold) + 0.5 * part.amplitudes.squaredNorm() +
         prior_cost(problem, part.values).cost;
}

/// The recordings where they stand, and what is known of the derivatives there.
class Pool final : public LeastSquares {
 public:
  Pool(std::span<const FitProblem* const> problems, const PooledSpace& space,
       const PooledOptions& options, std::vector<PooledPart> parts)
      : problems_(problems),
        space_(space),
        options_(options),
        parts_(std::move(parts)),
        exact_(parts_.size()) {}

  const std::vector<PooledPart>& parts() const { return parts_; }
  std::vector<PooledPart> release() { return std::move(parts_); }
  std::vector<Eigen::VectorXd> values() const {
    std::vector<Eigen::VectorXd> all;
    for (const PooledPart& part : parts_) all.push_back(part.values);
    return all;
  }
  double cost() const override { return cost_; }
  const Eigen::VectorXd* gradient() override {
    std::vector<Quadratic> quadratics(parts_.size());
    for_each_index(parts_.size(), [&](size_t n) {
      quadratics[n] = quadratic_of(*problems_[n], parts_[n], threshold_);
    });
    here_ = space_.gather(quadratics);
    return here_.usable ? &here_.gradient : nullptr;
  }
  Eigen::VectorXd step(double damping, const std::vector<bool>& held) override {
    return space_.step(here_, damping, held);
  }
  double predicted_decrease(const Eigen::VectorXd& way) const override {
    return space_.predicted_decrease(here_, way);
  }
  void hold(std::vector<bool>& held) const override {
    if (options_.own_only) std::fill_n(held.begin(), space_.shared(), true);
  }
  double moved(const Eigen::VectorXd& way) const override {
    const int first = options_.own_only ? space_.shared() : 0;
    const int count = options_.own_only ? space_.size() - first : space_.shared();
    return count > 0 ? way.segment(first, count).cwiseAbs().maxCoeff() : 0.0;
  }
  double least_decrease() const override { return options_.least_decrease * scatter(); }
  bool is_out_of_work() const override {
    return spring_steps_ >= options_.most_spring_steps ||
           linearisations_ >= options_.linearisations;
  }

  /// Derivatives are kept, updated, or computed there.
  bool move_to(const Eigen::VectorXd& next) override { return try_to_move(space_.values(next)); }

  Renewal renew_derivatives() override {
    if (is_exact() || options_.unrefined) return Renewal::not_needed;
    for (size_t n = 0; n < parts_.size(); ++n)
      if (!exact_[n]) parts_[n].linear.usable = false;
    return linearise() ? Renewal::done : Renewal::failed;
  }

  bool is_linearised() const {
    return std::ranges::all_of(parts_, [](const PooledPart& part) { return part.linear.usable; });
  }
  /// Chooses time steps and Huber's threshold where the recordings stand, and computes derivatives
  /// where there are none. False where a recording cannot be simulated.
  bool begin_round(bool first) {
    for (size_t n = 0; n < parts_.size(); ++n) {
      PooledPart& part = parts_[n];
      if (part.frames == 0) part.frames = problems_[n]->first_held_out;
      if (first && part.linear.usable) {
        exact_[n] = !part.borrowed;
        continue;
      }
      part.steps = stable_time_steps(problems_[n]->cloth, parameter_set(*problems_[n], part.values))
                       .times(1 / options_.stability_margin);
      part.linear = {};
    }
    if (!linearise()) return false;
    threshold_ = kInfinite;
    if (options_.loss == Loss::huber) threshold_ = kHuberScales * scale();
    cost_ = total_cost(parts_);
    return true;
  }

  /// Tells whether neither the time steps nor the loss would be chosen much otherwise now.
  bool is_settled() const {
    constexpr double kRoom = 1.05, kSameScale = 0.8;
    for (size_t n = 0; n < parts_.size(); ++n) {
      const TimeSteps largest =
          stable_time_steps(problems_[n]->cloth, parameter_set(*problems_[n], parts_[n].values));
      const bool rests = problems_[n]->start == StartKind::at_rest;
      if (largest.run_s < kRoom * parts_[n].steps.run_s ||
          (rests && largest.rest_s < kRoom * parts_[n].steps.rest_s))
        return false;
    }
    return threshold_ == kInfinite || kHuberScales * scale() > kSameScale * threshold_;
  }

 private:
  bool is_exact() const {
    return std::ranges::all_of(exact_, [](bool exact) { return exact; });
  }

  /// Chi-square per residual, where it is more than one.
  double scatter() const {
    Eigen::Index count = 0;
    for (const PooledPart& part : parts_) count += part.linear.residual.size();
    return std::max(1.0, 2 * cost_ / static_cast<double>(count));
  }

  bool try_to_move(const std::vector<Eigen::VectorXd>& values) {
    std::vector<PooledPart> there = parts_;
    std::vector<char> usable(parts_.size(), 0);
    const bool expensive = options_.updated_within > 0;
    for_each_index(parts_.size(), [&](size_t n) {
      PooledPart& part = there[n];
      const TrajectoryObjective objective = objective_of(*problems_[n], part);
      part.values = values[n];
      if (expensive) {
        part.linear.residual = objective.residuals({values[n]}).front();
        usable[n] = part.linear.residual.size() == objective.residual_count();
      } else {
        part.linear = objective.linearise(values[n]);
        usable[n] = part.linear.usable;
      }
    });
    if (std::ranges::find(usable, 0) != usable.end()) return false;
    const double cost = total_cost(there);
    if (!(cost <= cost_)) return false;
    const std::vector<char> were_exact = exact_;
    if (expensive) carry_derivatives(there);
    std::swap(parts_, there);
    if (!linearise()) {
      std::swap(parts_, there);
      exact_ = were_exact;
      return false;
    }
    cost_ = cost;
    return true;
  }

  double scale() const {
    double largest = 1;
    for (const PooledPart& part : parts_)
      largest = std::max(largest, robust_scale(residual_of(part)));
    return largest;
  }

  double total_cost(std::vector<PooledPart>& parts) const {
    std::vector<double> costs(parts.size());
    for_each_index(parts.size(), [&](size_t n) {
      costs[n] = fit_directions(*problems_[n], parts[n], threshold_);
    });
    double sum = 0;
    for (const double cost : costs) sum += cost;
    return sum;
  }

  /// Takes derivatives along to where the recordings stand `there`. An unrefined fit never computes
  /// new ones.
  void carry_derivatives(std::vector<PooledPart>& there) {
    const ReuseLimits limits{
        .kept_within = options_.kept_within,
        .updated_within = options_.unrefined ? kInfinite : options_.updated_within};
    for (size_t n = 0; n < parts_.size(); ++n) {
      const ParameterSpace& space = problems_[n]->space;
      Linearisation& linear = there[n].linear;
      const DerivativeReuse reuse = reuse_derivatives(
          linear.residual_by_coordinate,
          space.coordinates(there[n].values) - space.coordinates(parts_[n].values),
          linear.residual - parts_[n].linear.residual, limits);
      if (reuse == DerivativeReuse::spent) linear.usable = false;
      if (reuse == DerivativeReuse::updated) exact_[n] = false;
    }
  }

  /// Computes derivatives where there are none. Residuals stay the same.
  bool linearise() {
    std::vector<char> usable(parts_.size(), 1);
    std::vector<double> spring_steps(parts_.size(), 0);
    for (const PooledPart& part : parts_) linearisations_ += part.linear.usable ? 0 : 1;
    for_each_index(parts_.size(), [&](size_t n) {
      if (parts_[n].linear.usable) return;
      const TrajectoryObjective objective = objective_of(*problems_[n], parts_[n]);
      parts_[n].linear = objective.linearise(parts_[n].values);
      spring_steps[n] = parts_[n].linear.runs * objective.spring_steps_per_run();
      usable[n] = parts_[n].linear.usable;
      parts_[n].borrowed = false;
      exact_[n] = true;
    });
    for (const double own : spring_steps) spring_steps_ += own;
    return std::ranges::find(usable, 0) == usable.end();
  }

  std::span<const FitProblem* const> problems_;
  const PooledSpace& space_;
  const PooledOptions& options_;
  std::vector<PooledPart> parts_;
  PooledSpace::Expansion here_;
  std::vector<char> exact_;  ///< whether the derivatives are those of where the recording stands
  double threshold_ = kInfinite, cost_ = 0;
  double spring_steps_ = 0;
  int linearisations_ = 0;  ///< exact ones, of any recording
};

/// Moves parts into their ranges. Derivatives of those that move are none of where they stand.
void move_into(const Box& box, const PooledSpace& space, std::vector<PooledPart>& parts) {
  std::vector<Eigen::VectorXd> values;
  for (const PooledPart& part : parts) values.push_back(part.values);
  values = space.values(box.clamped(space.coordinates(values)));
  for (size_t n = 0; n < parts.size(); ++n) {
    if (values[n].isApprox(parts[n].values, 1e-12)) continue;
    parts[n].values = values[n];
    parts[n].linear = {};
  }
}

}  // namespace

Eigen::VectorXd corrected_residual(const PooledPart& part) {
  if (part.correction.size() == 0) return part.linear.residual;
  return part.linear.residual + part.correction;
}

Eigen::VectorXd residual_of(const PooledPart& part) {
  if (part.amplitudes.size() == 0) return corrected_residual(part);
  return corrected_residual(part) + part.directions * part.amplitudes;
}

Quadratic quadratic_of(const FitProblem& problem, const PooledPart& part, double threshold) {
  Quadratic result;
  if (!part.linear.usable) return result;
  const TrajectoryObjective objective = objective_of(problem, part);
  const Eigen::VectorXd residual = residual_of(part);
  const Eigen::VectorXd weight = huber_weights(objective, residual, threshold);
  const Eigen::MatrixXd& jacobian = part.linear.residual_by_coordinate;
  const Eigen::MatrixXd weighted = weight.asDiagonal() * jacobian;
  const PriorCost prior = prior_cost(problem, part.values);
  result.cost =
      huber_cost(objective, residual, threshold) + 0.5 * part.amplitudes.squaredNorm() + prior.cost;
  result.gradient = weighted.transpose() * residual + prior.gradient;
  result.information = weighted.transpose() * jacobian + prior.information;
  if (part.directions.cols() > 0) {
    const Eigen::MatrixXd between = weighted.transpose() * part.directions;
    Eigen::MatrixXd own = part.directions.transpose() * weight.asDiagonal() * part.directions;
    own.diagonal().array() += 1;
    const SymmetricFactors solver(own);
    // Zero where the amplitudes are at their least, but for the weights' last change.
    const Eigen::VectorXd pull =
        part.directions.transpose() * weight.cwiseProduct(residual) + part.amplitudes;
    result.gradient -= between * solver.solve(pull);
    result.information -= between * solver.solve(between.transpose());
  }
  result.usable = true;
  return result;
}

PooledFit fit_pooled(std::span<const FitProblem* const> problems, std::vector<PooledPart> start,
                     const PooledOptions& options, const ProgressCallback& progress) {
  // A step that is refused costs a run, one that is taken ten of them.
  constexpr int kRefusals = 4, kUnrefinedRefusals = 3;
  const PooledSpace space(problems);
  const Box box{.lower = space.lower(), .upper = space.upper()};
  move_into(box, space, start);
  PooledFit result;
  Pool pool(problems, space, options, std::move(start));
  int refusals = 0;
  for (int round = 0; round < options.rounds; ++round) {
    if (!pool.begin_round(round == 0)) {
      result.usable = false;
      result.message = "a recording cannot be simulated from the starting values";
      return result;
    }
    const Eigen::VectorXd began = space.coordinates(pool.values());
    const int most_refusals =
        options.unrefined ? kUnrefinedRefusals : kRefusals * options.iterations - refusals;
    const Minimised found =
        minimise(pool, box, began,
                 {.most_iterations = options.iterations - result.iterations,
                  .most_refusals = most_refusals,
                  .least_step = options.least_step,
                  .report = [&, before = result.iterations](int iterations) {
                    report_progress(progress, {.stage = "pooled fit",
                                               .done = static_cast<double>(before + iterations),
                                               .total = static_cast<double>(options.iterations),
                                               .unit = "iterations",
                                               .note = "cost " + std::to_string(pool.cost())});
                  }});
    result.iterations += found.iterations;
    refusals += found.refusals;
    result.cost = pool.cost();
    result.usable = pool.is_linearised();
    if (!result.usable) {
      result.message = "a recording has no derivatives";
      return result;
    }
    // A round that hardly moved had the time steps of where it ended.
    constexpr double kStill = 1e-4;
    const bool still = pool.moved(found.x - began) < kStill;
    result.converged = found.end == MinimiseEnd::converged &&
                       (still || (options.least_decrease > 0 && pool.is_settled()));
    if (result.converged || options.unrefined || result.iterations >= options.iterations ||
        pool.is_out_of_work())
      break;
  }
  result.message = result.converged ? "converged" : "not converged";
  result.parts = pool.release();
  const ParameterSpace& first = problems.front()->space;
  for (int p = 0; p < first.size(); ++p)
    if (const FitParameter& parameter = first.parameters[static_cast<size_t>(p)];
        is_physical(parameter.role))
      result.shared[parameter.name] = result.parts.front().values[p];
  return result;
}

PooledFit fit_pooled(std::span<const FitProblem* const> problems,
                     const std::map<std::string, double>& start, const PooledOptions& options,
                     const ProgressCallback& progress) {
  std::vector<PooledPart> parts;
  for (const FitProblem* problem : problems) {
    parts.push_back({.values = problem->space.start(),
                     .linear = {},
                     .correction = {},
                     .directions = {},
                     .amplitudes = {}});
    for (const auto& [name, value] : start)
      if (const int p = problem->space.index(name); p >= 0) parts.back().values[p] = value;
  }
  return fit_pooled(problems, std::move(parts), options, progress);
}

}  // namespace clothfit
