#include "fit/refine/refine.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>

#include "data/median.h"
#include "fit/cost/huber.h"
#include "fit/jobs/stop_token.h"
#include "fit/problem/box.h"
#include "fit/problem/parameterised_model.h"
#include "fit/refine/derivative_reuse.h"
#include "model/cloth/stability.h"

namespace clothfit {
namespace {

/// An optimum whose stable time step is not this much above the one taken leans on it.
constexpr double kRoom = 1.05;

/// A start in motion is found when a round lowers the cost by less than this share of it.
constexpr double kFlat = 1e-4;

constexpr const char* kOutOfWork = "not converged at the limit of work";

/// The residuals and, when it asks for it, their Jacobian at the point that Ceres looks at,
/// simulated once for all blocks.
class SharedEvaluation final : public ceres::EvaluationCallback {
 public:
  SharedEvaluation(const ObjectiveMaker& make_objective, std::unique_ptr<Objective>& objective,
                   const RefineOptions& options, const Box& box, const Eigen::VectorXd& coordinates)
      : problem_(objective->problem()),
        make_objective_(make_objective),
        objective_(objective),
        coarsest_(objective->steps()),
        options_(options),
        box_(box),
        coordinates_(coordinates),
        held_(static_cast<size_t>(coordinates.size()), false) {
    evaluate(true);
    if (!now_.usable) return;
    robust_scale_ = clothfit::robust_scale(now_.residual);
    hold_at_bounds();  // by Huber's threshold, which only now is known
  }

  /// No exception passes through Ceres. It gives up soon where nothing can be evaluated.
  void PrepareForEvaluation(bool evaluate_jacobians, bool) override {
    if (!thrown_) {
      try {
        evaluate(evaluate_jacobians);
        return;
      } catch (...) {
        thrown_ = std::current_exception();
      }
    }
    now_.usable = false;
  }
  bool is_ended() const { return thrown_ != nullptr; }
  /// Throws what ended an evaluation, if anything did.
  void rethrow() const {
    if (thrown_) std::rethrow_exception(thrown_);
  }

  const Linearisation& now() const { return now_; }
  /// Returns the robust scale of the residuals at the start.
  double robust_scale() const { return robust_scale_; }
  double huber_threshold() const {
    return options_.loss == Loss::huber ? kHuberScales * robust_scale_
                                        : std::numeric_limits<double>::infinity();
  }
  /// The residuals at the coordinates as they are now; empty where there are none.
  Eigen::VectorXd residual_here() {
    if (evaluated_ != coordinates_)
      return objective_->residuals({problem_.space.values(coordinates_)}).front();
    return now_.usable ? now_.residual : Eigen::VectorXd();
  }
  /// Coordinates that are held at a bound.
  bool is_held(int p) const { return held_[static_cast<size_t>(p)]; }
  int simulations() const { return simulations_; }
  /// Tells whether the last derivatives were updated.
  bool are_updated() const { return updates_ > 0; }
  /// Tells whether the last derivatives belong to `coordinates`, or were kept for them.
  bool is_linearised_at(const Eigen::VectorXd& coordinates) const {
    return now_.usable && has_derivatives_for_.size() == coordinates.size() &&
           has_derivatives_for_ == coordinates;
  }
  double spring_steps() const { return simulations_ * objective_->spring_steps_per_run(); }

 private:
  /// Ceres asks again, with the Jacobian, for a point that it has accepted. Differences come with
  /// the residuals at once: a trial step's run alone would leave most lanes idle, and most trial
  /// steps are accepted.
  void evaluate(bool evaluate_jacobians) {
    const bool is_new = evaluated_.size() != coordinates_.size() || evaluated_ != coordinates_;
    if (!is_new && (has_jacobian_ || !evaluate_jacobians)) return;
    evaluated_ = coordinates_;
    const Eigen::VectorXd values = problem_.space.values(coordinates_);
    cut_time_for(values);
    has_jacobian_ = evaluate_jacobians || options_.derivatives != Derivatives::tangents ||
                    objective_->has_cheap_derivatives();
    if (has_jacobian_ && serves_on(values)) {
      has_derivatives_for_ = coordinates_;
      hold_at_bounds();
      return;
    }
    if (has_jacobian_) {
      now_ = objective_->linearise(values, options_.derivatives, options_.difference_step);
      linearised_at_ = has_derivatives_for_ = coordinates_;
      residual_there_ = now_.residual;
      updates_ = 0;
      if (now_.usable) hold_at_bounds();
    } else {
      run(values);
    }
    if (has_jacobian_) simulations_ += now_.runs;
  }

  /// Makes the objective again with finer time steps where a trial asks for them: the jump of the
  /// cost is small beside what such a trial changes, and to refuse it would hold back all other
  /// coordinates for many steps. A trial that asks for far finer ones is refused.
  void cut_time_for(const Eigen::VectorXd& values) {
    constexpr double kFinest = 1.0 / 2;
    if (!objective_->needs_stable_step()) return;
    const ParameterSet set = parameter_set(problem_, values);
    const TimeSteps now = objective_->steps();
    if (is_stable(problem_, set, now)) return;
    const TimeSteps safe =
        stable_time_steps(problem_.cloth, set).times(1 / options_.stability_margin);
    const TimeSteps finer{std::min(now.run_s, safe.run_s), std::min(now.rest_s, safe.rest_s)};
    if (finer.run_s < kFinest * coarsest_.run_s || finer.rest_s < kFinest * coarsest_.rest_s)
      return;
    objective_ = make_objective_(finer);
  }

  void run(const Eigen::VectorXd& values) {
    now_.residual = objective_->residuals({values}).front();
    now_.usable = now_.residual.size() == objective_->residual_count();
    ++simulations_;
    ran_at_ = coordinates_;
  }

  /// Tells whether derivatives that were had elsewhere, as they are or updated, do for this point
  /// (see RefineOptions::kept_within). The residuals are this point's then.
  bool serves_on(const Eigen::VectorXd& values) {
    constexpr int kMostUpdates = 8;
    const bool expensive =
        options_.derivatives == Derivatives::tangents && !objective_->has_cheap_derivatives();
    if (!expensive || !now_.usable || linearised_at_.size() != coordinates_.size()) return false;
    if (ran_at_.size() != coordinates_.size() || ran_at_ != coordinates_) run(values);
    if (!now_.usable) return false;
    const ReuseLimits limits{
        .kept_within = options_.kept_within,
        .updated_within = updates_ == kMostUpdates ? -1 : options_.updated_within};
    const DerivativeReuse reuse =
        reuse_derivatives(now_.residual_by_coordinate, coordinates_ - linearised_at_,
                          now_.residual - residual_there_, limits);
    if (reuse != DerivativeReuse::updated) return reuse == DerivativeReuse::kept;
    linearised_at_ = coordinates_;
    residual_there_ = now_.residual;
    ++updates_;
    return true;
  }

  /// Ceres clips its steps to the bounds, but computes them as if there were none: where one
  /// coordinate is clipped the others get what would have gone with its full step. So a coordinate
  /// at a bound that blocks it takes no part.
  void hold_at_bounds() {
    const Eigen::VectorXd values = problem_.space.values(coordinates_);
    const Eigen::VectorXd slope = problem_.space.value_by_coordinate(values);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(coordinates_.size());
    for (const Objective::Block& block : objective_->blocks()) {
      const auto r = now_.residual.segment(block.offset, block.dimension);
      const double weight = std::min(1.0, huber_threshold() / std::max(r.norm(), 1e-300));
      gradient +=
          weight *
          now_.residual_by_coordinate.middleRows(block.offset, block.dimension).transpose() * r;
    }
    for (const GaussianPrior& prior : problem_.priors) {
      const Eigen::VectorXd r = prior.residual(values);
      for (size_t n = 0; n < prior.indices.size(); ++n)
        gradient[prior.indices[n]] +=
            slope[prior.indices[n]] *
            prior.sqrt_information.col(static_cast<Eigen::Index>(n)).dot(r);
    }
    held_.assign(static_cast<size_t>(coordinates_.size()), false);
    for (int p = 0; p < coordinates_.size(); ++p)
      held_[static_cast<size_t>(p)] = box_.blocks(p, coordinates_[p], gradient[p]);
  }

  const FitProblem& problem_;
  const ObjectiveMaker& make_objective_;
  std::unique_ptr<Objective>& objective_;
  TimeSteps coarsest_;  ///< that the round began with
  const RefineOptions& options_;
  const Box& box_;
  double robust_scale_ = 1;
  const Eigen::VectorXd& coordinates_;
  Eigen::VectorXd evaluated_, ran_at_, linearised_at_, has_derivatives_for_;
  Eigen::VectorXd residual_there_;  ///< where it was linearised
  int updates_ = 0;                 ///< of the Jacobian since then
  Linearisation now_;
  bool has_jacobian_ = false;
  std::vector<bool> held_;
  int simulations_ = 0;
  std::exception_ptr thrown_;
};

/// One observation's part of the shared evaluation.
class ObservationCost final : public ceres::CostFunction {
 public:
  ObservationCost(const SharedEvaluation& shared, const Objective::Block& block, int parameters)
      : shared_(shared), block_(block) {
    set_num_residuals(block.dimension);
    mutable_parameter_block_sizes()->push_back(parameters);
  }

  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    const Linearisation& now = shared_.now();
    if (!now.usable) return false;
    Eigen::Map<Eigen::VectorXd>(residuals, block_.dimension) =
        now.residual.segment(block_.offset, block_.dimension);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      const Eigen::Index parameters = now.residual_by_coordinate.cols();
      Eigen::Map<RowMajor> jacobian(jacobians[0], block_.dimension, parameters);
      jacobian = now.residual_by_coordinate.middleRows(block_.offset, block_.dimension);
      for (Eigen::Index p = 0; p < parameters; ++p)
        if (shared_.is_held(static_cast<int>(p))) jacobian.col(p).setZero();
    }
    return true;
  }

 private:
  const SharedEvaluation& shared_;
  Objective::Block block_;
};

class GaussianPriorCost final : public ceres::CostFunction {
 public:
  GaussianPriorCost(const SharedEvaluation& shared, const ParameterSpace& space,
                    const GaussianPrior& prior)
      : shared_(shared), space_(space), prior_(prior) {
    set_num_residuals(static_cast<int>(prior.mean.size()));
    mutable_parameter_block_sizes()->push_back(space.size());
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::VectorXd values =
        space_.values(Eigen::Map<const Eigen::VectorXd>(parameters[0], space_.size()));
    Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = prior_.residual(values);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::Map<RowMajor> jacobian(jacobians[0], num_residuals(), space_.size());
      jacobian.setZero();
      const Eigen::VectorXd slope = space_.value_by_coordinate(values);
      for (size_t n = 0; n < prior_.indices.size(); ++n) {
        if (shared_.is_held(prior_.indices[n])) continue;
        jacobian.col(prior_.indices[n]) =
            prior_.sqrt_information.col(static_cast<Eigen::Index>(n)) * slope[prior_.indices[n]];
      }
    }
    return true;
  }

 private:
  const SharedEvaluation& shared_;
  const ParameterSpace& space_;
  const GaussianPrior& prior_;
};

/// Reports after each iteration; ends the solve on the caller's word or at the limit of work.
class Reporter final : public ceres::IterationCallback {
 public:
  Reporter(const ProgressCallback& progress, Progress progress_now, const SharedEvaluation& shared,
           double most_spring_steps)
      : progress_(progress),
        now_(std::move(progress_now)),
        shared_(shared),
        most_spring_steps_(most_spring_steps) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (shared_.is_ended()) return ceres::SOLVER_ABORT;
    now_.done = summary.iteration;
    now_.note = "cost " + std::to_string(summary.cost);
    // No exception passes through Ceres.
    try {
      report_progress(progress_, now_);
    } catch (...) {
      thrown_ = std::current_exception();
      return ceres::SOLVER_ABORT;
    }
    // However large the mesh, one step is tried.
    const bool go_on = summary.iteration == 0 || shared_.spring_steps() < most_spring_steps_;
    return go_on ? ceres::SOLVER_CONTINUE : ceres::SOLVER_TERMINATE_SUCCESSFULLY;
  }
  /// Throws what ended the solve, if anything did.
  void rethrow() const {
    if (thrown_) std::rethrow_exception(thrown_);
  }

 private:
  const ProgressCallback& progress_;
  Progress now_;
  const SharedEvaluation& shared_;
  double most_spring_steps_;
  std::exception_ptr thrown_;
};

/// Why a solve ended, for a person.
std::string ending(const ceres::Solver::Summary& summary) {
  switch (summary.termination_type) {
    case ceres::CONVERGENCE:
      return "converged";
    case ceres::USER_SUCCESS:
      return kOutOfWork;
    case ceres::NO_CONVERGENCE:
      return "still falling after " + std::to_string(summary.iterations.size()) + " iterations";
    case ceres::USER_FAILURE:
    case ceres::FAILURE:
      break;
  }
  return "failed: " + summary.message;
}

struct Round {
  bool started = false;  ///< whether there were residuals and derivatives at the start
  ceres::Solver::Summary summary;
  double robust_scale = 1;      ///< of the residuals at the start
  double robust_scale_end = 1;  ///< and in the end, where the loss asks for it
  Eigen::VectorXd values;
  Eigen::MatrixXd residual_by_coordinate;  ///< there; empty where it was not had exactly
  bool derivatives_updated = false;
  int simulations = 0;
};

/// `objective` may be cut finer in time on the way.
Round solve(const ObjectiveMaker& make_objective, std::unique_ptr<Objective>& objective,
            const Eigen::VectorXd& start, const RefineOptions& refine_options,
            double most_spring_steps, const ProgressCallback& progress) {
  const FitProblem& problem = objective->problem();
  const ParameterSpace& space = problem.space;
  Eigen::VectorXd coordinates = space.coordinates(start);
  const Box box = box_of(space);
  coordinates = box.clamped(coordinates);
  SharedEvaluation shared(make_objective, objective, refine_options, box, coordinates);
  Round round;
  round.simulations = shared.simulations();
  round.started = shared.now().usable;
  round.robust_scale = round.robust_scale_end = shared.robust_scale();
  if (!round.started) return round;

  ceres::Problem::Options problem_options;
  problem_options.evaluation_callback = &shared;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem least_squares(problem_options);
  ceres::HuberLoss huber(shared.huber_threshold());
  ceres::LossFunction* const loss = refine_options.loss == Loss::huber ? &huber : nullptr;
  double* const block = coordinates.data();
  least_squares.AddParameterBlock(block, space.size());
  for (const Objective::Block& rows : objective->blocks())
    least_squares.AddResidualBlock(new ObservationCost(shared, rows, space.size()), loss, block);
  for (const GaussianPrior& prior : problem.priors)
    least_squares.AddResidualBlock(new GaussianPriorCost(shared, space, prior), nullptr, block);
  for (int p = 0; p < space.size(); ++p) {
    least_squares.SetParameterLowerBound(block, p, box.lower[p]);
    least_squares.SetParameterUpperBound(block, p, box.upper[p]);
  }

  ceres::Solver::Options options;
  // The dense solvers sum in an order that depends on the size of the processor's caches.
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = refine_options.iterations;
  options.function_tolerance = refine_options.least_gain;
  options.parameter_tolerance = refine_options.least_step;
  options.initial_trust_region_radius = refine_options.trust_region_radius;
  // A step that fails is shortened by the trust region, with a new direction; Ceres' line search
  // along the bounds would first try the old one up to twenty times, a linearisation each.
  options.max_num_line_search_step_size_iterations = 0;
  Reporter reporter(progress,
                    {.stage = "refining " + objective->name(),
                     .done = 0,
                     .total = static_cast<double>(refine_options.iterations),
                     .unit = "iterations",
                     .note = {}},
                    shared, most_spring_steps);
  options.callbacks.push_back(&reporter);
  ceres::Solve(options, &least_squares, &round.summary);
  shared.rethrow();
  reporter.rethrow();
  round.values = space.values(coordinates);
  const bool exact =
      refine_options.derivatives == Derivatives::tangents && !objective->has_cheap_derivatives();
  round.derivatives_updated = exact && shared.are_updated();
  if (exact && !round.derivatives_updated && shared.is_linearised_at(coordinates))
    round.residual_by_coordinate = shared.now().residual_by_coordinate;
  if (refine_options.loss == Loss::huber) {
    const Eigen::VectorXd residual = shared.residual_here();
    if (residual.size() > 0) round.robust_scale_end = robust_scale(residual);
  }
  round.simulations = shared.simulations();
  return round;
}

}  // namespace

RefineResult refine(const FitProblem& problem, const ObjectiveMaker& make_objective,
                    const Eigen::VectorXd& start, const RefineOptions& options,
                    const ProgressCallback& progress) {
  RefineResult result;
  result.values = start;
  double spring_steps_left = options.most_spring_steps;
  const auto stable = [&] {
    return stable_time_steps(problem.cloth, parameter_set(problem, result.values));
  };
  for (int n = 0; n < options.rounds; ++n) {
    result.converged = false;
    std::unique_ptr<Objective> objective =
        make_objective(stable().times(1 / (options.stability_margin * options.substep_scale)));
    Round round =
        solve(make_objective, objective, result.values, options, spring_steps_left, progress);
    result.simulations += round.simulations;
    result.time_step_s = objective->time_step_s();
    if (!round.started) {
      result.message = "the simulation from the starting values did not work out";
      return result;
    }
    result.robust_scale = round.robust_scale;
    spring_steps_left -= round.simulations * objective->spring_steps_per_run();
    result.solver_iterations += static_cast<int>(round.summary.iterations.size());
    result.message = ending(round.summary);
    if (!round.summary.IsSolutionUsable()) return result;
    result.usable = true;
    const double moved =
        (problem.space.coordinates(round.values) - problem.space.coordinates(result.values))
            .cwiseAbs()
            .maxCoeff();
    result.values = round.values;
    result.residual_by_coordinate = std::move(round.residual_by_coordinate);
    result.cost = round.summary.final_cost / objective->residual_count();
    const bool settled = round.summary.termination_type == ceres::CONVERGENCE;
    // Done when neither the step limit nor the loss's scale had a say in where the round ended.
    const TimeSteps largest = stable(), taken = objective->steps();
    const bool rests = problem.start == StartKind::at_rest;
    const bool has_room =
        !objective->needs_stable_step() ||
        (largest.run_s > kRoom * taken.run_s && (!rests || largest.rest_s > kRoom * taken.rest_s));
    // Of the many numbers of a start in motion some are hardly determined. Rounds would follow them
    // for long, with derivatives that are exact where a round begins.
    const bool is_flat =
        problem.start == StartKind::unknown &&
        round.summary.initial_cost - round.summary.final_cost < kFlat * round.summary.initial_cost;
    const bool same_scale = round.robust_scale_end > 0.8 * round.robust_scale;
    const bool is_exact = !(options.exact_in_the_end && round.derivatives_updated);
    result.converged = has_room && settled && (is_flat || is_exact) && (same_scale || moved < 1e-3);
    if (result.converged) break;
    if (spring_steps_left <= 0) {
      result.message = kOutOfWork;
      break;
    }
    if (settled) result.message = "each round led on to another";
  }
  return result;
}

RefineResult refine(const FitProblem& problem, int frames, const Eigen::VectorXd& start,
                    const RefineOptions& options, const ProgressCallback& progress) {
  return refine(
      problem,
      [&](const TimeSteps& steps) {
        return std::make_unique<TrajectoryObjective>(problem, frames, steps);
      },
      start, options, progress);
}

}  // namespace clothfit
