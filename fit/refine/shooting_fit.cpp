#include "fit/refine/shooting_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "fit/cost/huber.h"
#include "fit/cost/track_states.h"
#include "fit/jobs/stop_token.h"
#include "fit/problem/box.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/prior_cost.h"
#include "fit/refine/least_squares.h"
#include "fit/refine/refine.h"
#include "model/cloth/stability.h"

namespace clothfit {
namespace {

/// First frames of windows of about equal length.
std::vector<int> first_frames(int frames, int window_frames) {
  const int count = std::max(1, (frames - 1) / std::max(1, window_frames));
  std::vector<int> first;
  for (int w = 0; w < count; ++w) first.push_back(w * (frames - 1) / count);
  return first;
}

TimeSteps steps_at(const FitProblem& problem, const Eigen::VectorXd& values, double margin) {
  return stable_time_steps(problem.cloth, parameter_set(problem, values)).times(1 / margin);
}

/// One round of shooting: the windows' guesses, their continuity and the loss stay the same.
struct ShootingRound {
  const FitProblem& problem;
  int frames;
  const ShootingWindows& windows;
  Continuity continuity;
  double stability_margin;
  double least_gain;
  double huber_threshold = std::numeric_limits<double>::infinity();

  std::unique_ptr<ShootingObjective> objective_at(
      const TimeSteps& steps, const ShootingObjective::Corrections& corrections) const {
    auto objective =
        std::make_unique<ShootingObjective>(problem, frames, steps, windows, continuity);
    if (!corrections.empty()) objective->set_corrections(corrections);
    return objective;
  }

  /// The cost of a trial, priors included; infinite where it is refused. One that asks for finer
  /// time steps than the objective's is judged with these: the jump of the cost is small beside
  /// what it changes. One that asks for far finer ones is refused.
  double cost_of_trial(const ShootingObjective& objective, const Eigen::VectorXd& values,
                       const ShootingObjective::Corrections& corrections) const {
    constexpr double kFinest = 1.0 / 2;  // as refine() has it
    std::unique_ptr<ShootingObjective> finer;
    const TimeSteps now = objective.steps();
    if (!is_stable(problem, parameter_set(problem, values), now)) {
      const TimeSteps safe = steps_at(problem, values, stability_margin);
      const TimeSteps both{std::min(now.run_s, safe.run_s), std::min(now.rest_s, safe.rest_s)};
      if (both.run_s < kFinest * now.run_s || both.rest_s < kFinest * now.rest_s)
        return std::numeric_limits<double>::infinity();
      finer = objective_at(both, corrections);
    }
    const ShootingObjective& judge = finer ? *finer : objective;
    return judge.cost(judge.residual(values, corrections), huber_threshold) +
           prior_cost(problem, values).cost;
  }
};

/// The cost of a round, where the fit stands. Equations are had where derivatives are asked for,
/// with time steps that follow the parameters: all trials from one place have the same.
class ShootingCost final : public LeastSquares {
 public:
  /// `runs`: of the rounds before, which count towards the limit of work.
  ShootingCost(const ShootingRound& round, Eigen::VectorXd values, double runs,
               double most_spring_steps)
      : round_(round),
        values_(std::move(values)),
        runs_before_(runs),
        most_spring_steps_(most_spring_steps),
        objective_(round.objective_at(steps_now(), {})) {}

  const ShootingObjective& objective() const { return *objective_; }
  const Eigen::VectorXd& values() const { return values_; }
  double runs() const { return runs_; }

  double cost() const override { return cost_; }
  const Eigen::VectorXd* gradient() override {
    if (!is_current_) {
      if (runs_ > 0) objective_ = round_.objective_at(steps_now(), objective_->corrections());
      equations_ = objective_->equations(values_, round_.huber_threshold);
      runs_ += equations_.runs;
      if (equations_.usable) cost_ = equations_.cost;
      gradient_ = -equations_.chain.border_right;
      is_current_ = true;
    }
    return equations_.usable ? &gradient_ : nullptr;
  }
  Eigen::VectorXd step(double damping, const std::vector<bool>& held) override {
    step_ = damped_step(equations_.chain, damping, held);
    damping_ = damping;
    return step_.border;
  }
  /// The promise is the step's as it is. Where the box has cut it short, it is a little less.
  double predicted_decrease(const Eigen::VectorXd&) const override {
    const BorderedChain& chain = equations_.chain;
    const auto part = [&](const Eigen::VectorXd& right, const Eigen::MatrixXd& information,
                          const Eigen::VectorXd& step) {
      return right.dot(step) + damping_ * information.diagonal().dot(step.cwiseAbs2());
    };
    double sum = part(chain.border_right, chain.border, step_.border);
    for (size_t w = 0; w < step_.blocks.size(); ++w)
      sum += part(chain.right[w], chain.diagonal[w], step_.blocks[w]);
    return 0.5 * sum;
  }
  bool move_to(const Eigen::VectorXd& next) override {
    ShootingObjective::Corrections corrections = objective_->corrections();
    for (size_t w = 0; w < corrections.size(); ++w) corrections[w] += step_.blocks[w];
    const Eigen::VectorXd values = round_.problem.space.values(next);
    ++runs_;
    is_tried_ = true;
    const double cost = round_.cost_of_trial(*objective_, values, corrections);
    if (!(cost <= cost_)) return false;
    values_ = values;
    objective_->set_corrections(std::move(corrections));
    cost_ = cost;
    is_current_ = false;
    return true;
  }
  double least_decrease() const override { return round_.least_gain * cost_; }
  /// However large the mesh, one step is tried in a round.
  bool is_out_of_work() const override {
    return is_tried_ &&
           (runs_before_ + runs_) * objective_->spring_steps_per_run() > most_spring_steps_;
  }

 private:
  TimeSteps steps_now() const { return steps_at(round_.problem, values_, round_.stability_margin); }

  const ShootingRound& round_;
  Eigen::VectorXd values_;
  double runs_before_, most_spring_steps_;
  std::unique_ptr<ShootingObjective> objective_;  ///< with the corrections where the fit stands
  ShootingObjective::Equations equations_;
  Eigen::VectorXd gradient_;
  double cost_ = std::numeric_limits<double>::infinity();
  bool is_current_ = false;  ///< whether the equations are those of where the fit stands
  bool is_tried_ = false;    ///< whether a step has been
  BorderedChainSolution step_;
  double damping_ = 0, runs_ = 0;
};

}  // namespace

std::optional<ShootingWindows> make_windows(const FitProblem& problem, int frames,
                                            const Eigen::VectorXd& values,
                                            const ShootingOptions& options) {
  ShootingWindows windows{
      .first_frame = {0}, .position_m = {{}}, .velocity_m_per_s = {{}}, .nodes = options.nodes};
  const std::vector<int> wanted = first_frames(frames, options.window_frames);
  const auto add = [&](int frame, const Eigen::Matrix3Xd& position_m,
                       const Eigen::Matrix3Xd& velocity_m_per_s) {
    windows.first_frame.push_back(frame);
    windows.position_m.push_back(position_m);
    windows.velocity_m_per_s.push_back(velocity_m_per_s);
  };
  if (const std::optional<TrackStates> tracks = find_states_of_tracks(problem)) {
    for (size_t w = 1; w < wanted.size(); ++w) {
      const auto next = std::ranges::lower_bound(tracks->frame, wanted[w]);
      if (next == tracks->frame.end() || *next >= frames) break;
      if (*next <= windows.first_frame.back()) continue;
      const auto n = static_cast<size_t>(next - tracks->frame.begin());
      add(*next, tracks->states.position_m[n], tracks->states.velocity_m_per_s[n]);
    }
    return windows;
  }
  ParameterSet set = parameter_set(problem, values);
  const TimeSteps steps = steps_at(problem, values, options.stability_margin);
  if (problem.start == StartKind::at_rest)
    start_at_rest(problem.cloth, {&set, 1}, problem.gravity_m_per_s2.norm(),
                  problem.frame_time_s.front(), steps.rest_s, problem.stop);
  const SimulateResult run =
      simulate(
          problem.cloth, {&set, 1},
          {.frame_time_s = {problem.frame_time_s.begin(), problem.frame_time_s.begin() + frames},
           .time_step_s = steps.run_s,
           .velocities = true},
          Precision::exact, {}, problem.stop)
          .front();
  if (!run.usable()) return std::nullopt;
  for (size_t w = 1; w < wanted.size(); ++w) {
    const auto frame = static_cast<size_t>(wanted[w]);
    add(wanted[w], run.position_m[frame], run.velocity_m_per_s[frame]);
  }
  return windows;
}

BorderedChainSolution damped_step(const BorderedChain& equations, double damping,
                                  const std::vector<bool>& held) {
  BorderedChain damped = equations;
  // A coordinate that nothing depends on keeps a unit of its own.
  const auto damp = [&](Eigen::MatrixXd& diagonal) {
    for (Eigen::Index n = 0; n < diagonal.rows(); ++n)
      diagonal(n, n) = diagonal(n, n) > 0 ? (1 + damping) * diagonal(n, n) : 1;
  };
  for (Eigen::MatrixXd& diagonal : damped.diagonal) damp(diagonal);
  damp(damped.border);
  for (Eigen::Index p = 0; p < damped.border.rows(); ++p) {
    if (!held[static_cast<size_t>(p)]) continue;
    for (Eigen::MatrixXd& to_border : damped.to_border) to_border.col(p).setZero();
    damped.border.row(p).setZero();
    damped.border.col(p).setZero();
    damped.border(p, p) = 1;
    damped.border_right[p] = 0;
  }
  return solve(std::move(damped));
}

ShootingFit fit_by_shooting(const FitProblem& problem, int frames, const Eigen::VectorXd& start,
                            const ShootingOptions& options, const ProgressCallback& progress) {
  constexpr double kStill = 1e-6;  // of a coordinate: a step that is not worth a linearisation
  ShootingFit result;
  const ParameterSpace& space = problem.space;
  const Box box = box_of(space);
  result.values = space.values(box.clamped(space.coordinates(start)));
  std::optional<ShootingWindows> windows = make_windows(problem, frames, result.values, options);
  if (!windows) {
    result.message = "the simulation that was to guess the windows' states diverged";
    return result;
  }
  const double window_s =
      (problem.frame_time_s[static_cast<size_t>(frames - 1)] - problem.frame_time_s.front()) /
      windows->count();
  bool out_of_work = false;
  for (int n = 0; n < options.rounds && windows && !out_of_work; ++n) {
    const double share = options.rounds > 1 ? n / (options.rounds - 1.0) : 1;
    const double gap_m =
        options.first_gap_m * std::pow(options.last_gap_m / options.first_gap_m, share);
    ShootingRound round{.problem = problem,
                        .frames = frames,
                        .windows = *windows,
                        .continuity = {gap_m, gap_m / window_s},
                        .stability_margin = options.stability_margin,
                        .least_gain = options.least_gain};
    ShootingCost cost(round, result.values, result.runs + 1, options.most_spring_steps);
    const Eigen::VectorXd before = cost.objective().residuals({result.values}).front();
    ++result.runs;
    if (options.loss == Loss::huber) round.huber_threshold = kHuberScales * robust_scale(before);
    if (before.size() == 0 || cost.gradient() == nullptr) {
      result.message = "a window cannot be simulated from the starting values";
      return result;
    }
    const Minimised found = minimise(
        cost, box, space.coordinates(result.values),
        {.most_iterations = options.iterations,
         .least_step = kStill,
         .most_damping = 1e8,
         .report = [&](int iterations) {
           report_progress(progress,
                           {.stage = "shooting " + cost.objective().name(),
                            .done = static_cast<double>(result.iterations + iterations),
                            .total = static_cast<double>(options.rounds * options.iterations),
                            .unit = "iterations",
                            .note = "cost " + std::to_string(cost.cost())});
         }});
    result.iterations += found.iterations;
    result.runs += cost.runs();
    result.values = cost.values();
    result.cost = cost.cost();
    result.time_step_s = cost.objective().time_step_s();
    result.corrections = cost.objective().corrections();
    result.windows = cost.objective().windows();
    result.usable = true;
    out_of_work = cost.is_out_of_work();
    const bool converged =
        found.end == MinimiseEnd::converged || found.end == MinimiseEnd::no_descent;
    result.message = out_of_work ? "not converged at the limit of work"
                     : converged ? "converged"
                                 : "still falling";
    if (n + 1 < options.rounds) windows = cost.objective().recentred(result.values);
  }
  return result;
}

}  // namespace clothfit
