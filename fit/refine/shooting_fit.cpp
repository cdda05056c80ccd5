#include "fit/refine/shooting_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "fit/cost/huber.h"
#include "fit/cost/track_states.h"
#include "fit/jobs/stop_token.h"
#include "fit/problem/parameterised_model.h"
#include "fit/problem/prior_cost.h"
#include "fit/refine/refine.h"
#include "model/cloth/stability.h"

namespace clothfit {
namespace {

/// Ends of the ranges, in coordinates.
struct Ranges {
  Eigen::VectorXd lower, upper;

  explicit Ranges(const ParameterSpace& space) : lower(space.size()), upper(space.size()) {
    for (int p = 0; p < space.size(); ++p) {
      lower[p] = space.parameters[static_cast<size_t>(p)].lower;
      upper[p] = space.parameters[static_cast<size_t>(p)].upper;
    }
    lower = space.coordinates(lower);
    upper = space.coordinates(upper);
  }
  /// Coordinates at an end that keeps them from a lower cost.
  std::vector<bool> blocked(const Eigen::VectorXd& x, const Eigen::VectorXd& downhill) const {
    std::vector<bool> held(static_cast<size_t>(x.size()));
    for (Eigen::Index p = 0; p < x.size(); ++p) {
      const double edge = 1e-12 * (upper[p] - lower[p]);
      held[static_cast<size_t>(p)] =
          downhill[p] < 0 ? x[p] - lower[p] <= edge : upper[p] - x[p] <= edge;
    }
    return held;
  }
};

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

/// A point of the fit, with the equations there.
struct Point {
  Eigen::VectorXd coordinates;
  std::unique_ptr<ShootingObjective> objective;  ///< with the corrections there
  ShootingObjective::Equations equations;
};

/// What one step did.
struct Step {
  bool taken = false;
  double gain = 0;   ///< of the cost
  double moved = 0;  ///< most, of a coordinate of the parameters
  int trials = 0;    ///< plain runs
};

/// Shorter and shorter steps until one lowers the cost. `at` moves there, but for its equations,
/// which keep all but the cost.
Step take_step(const ShootingRound& round, const Ranges& ranges, double& damping, Point& at) {
  constexpr double kLeastDamping = 1e-9, kMostDamping = 1e8;
  Step result;
  const std::vector<bool> held = ranges.blocked(at.coordinates, at.equations.chain.border_right);
  for (; damping <= kMostDamping; damping *= 10) {
    const BorderedChainSolution step = damped_step(at.equations.chain, damping, held);
    const Eigen::VectorXd next =
        (at.coordinates + step.border).cwiseMax(ranges.lower).cwiseMin(ranges.upper);
    if (!next.allFinite()) continue;
    ShootingObjective::Corrections corrections = at.objective->corrections();
    for (size_t w = 0; w < corrections.size(); ++w) corrections[w] += step.blocks[w];
    ++result.trials;
    const double cost =
        round.cost_of_trial(*at.objective, round.problem.space.values(next), corrections);
    if (!(cost <= at.equations.cost)) continue;
    result.taken = true;
    result.gain = at.equations.cost - cost;
    result.moved = (next - at.coordinates).cwiseAbs().maxCoeff();
    at.coordinates = next;
    at.objective->set_corrections(std::move(corrections));
    at.equations.cost = cost;
    damping = std::max(kLeastDamping, 0.1 * damping);
    break;
  }
  return result;
}

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
                  problem.frame_time_s.front(), steps.rest_s);
  const SimulateResult run =
      simulate(
          problem.cloth, {&set, 1},
          {.frame_time_s = {problem.frame_time_s.begin(), problem.frame_time_s.begin() + frames},
           .time_step_s = steps.run_s,
           .velocities = true})
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
  // What nothing depends on keeps a unit of its own.
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
  const Ranges ranges(space);
  Point at{.coordinates = space.coordinates(start).cwiseMax(ranges.lower).cwiseMin(ranges.upper),
           .objective = {},
           .equations = {}};
  result.values = space.values(at.coordinates);
  std::optional<ShootingWindows> windows = make_windows(problem, frames, result.values, options);
  if (!windows) {
    result.message = "the simulation that was to guess the windows' states diverged";
    return result;
  }
  const double window_s =
      (problem.frame_time_s[static_cast<size_t>(frames - 1)] - problem.frame_time_s.front()) /
      windows->count();
  const auto steps_now = [&] { return steps_at(problem, result.values, options.stability_margin); };
  bool out_of_work = false;
  for (int n = 0; n < options.rounds && windows && !out_of_work; ++n) {
    const double share = options.rounds > 1 ? n / (options.rounds - 1.0) : 1;
    const double gap_m =
        options.first_gap_m * std::pow(options.last_gap_m / options.first_gap_m, share);
    ShootingRound round{.problem = problem,
                        .frames = frames,
                        .windows = *windows,
                        .continuity = {gap_m, gap_m / window_s},
                        .stability_margin = options.stability_margin};
    at.objective = round.objective_at(steps_now(), {});
    const Eigen::VectorXd before = at.objective->residuals({result.values}).front();
    ++result.runs;
    if (options.loss == Loss::huber) round.huber_threshold = kHuberScales * robust_scale(before);
    at.equations = at.objective->equations(result.values, round.huber_threshold);
    result.runs += at.equations.runs;
    if (before.size() == 0 || !at.equations.usable) {
      result.message = "a window cannot be simulated from the starting values";
      return result;
    }
    double damping = 1e-3;
    bool settled = false;
    for (int i = 1;; ++i) {
      report_progress(progress, {.stage = "shooting " + at.objective->name(),
                                 .done = static_cast<double>(result.iterations),
                                 .total = static_cast<double>(options.rounds * options.iterations),
                                 .unit = "iterations",
                                 .note = "cost " + std::to_string(at.equations.cost)});
      ++result.iterations;
      const Step step = take_step(round, ranges, damping, at);
      result.values = space.values(at.coordinates);
      result.runs += step.trials;
      result.cost = at.equations.cost;
      settled =
          !step.taken || step.gain <= options.least_gain * at.equations.cost || step.moved < kStill;
      out_of_work = result.runs * at.objective->spring_steps_per_run() > options.most_spring_steps;
      if (settled || out_of_work || i >= options.iterations) break;
      // Time steps follow the parameters; all trials of one iteration have the same.
      at.objective = round.objective_at(steps_now(), at.objective->corrections());
      at.equations = at.objective->equations(result.values, round.huber_threshold);
      result.runs += at.equations.runs;
      if (!at.equations.usable) break;
    }
    result.time_step_s = at.objective->time_step_s();
    result.corrections = at.objective->corrections();
    result.windows = at.objective->windows();
    result.usable = true;
    result.message = out_of_work ? "not converged at the limit of work"
                     : settled   ? "converged"
                                 : "still falling";
    if (n + 1 < options.rounds) windows = at.objective->recentred(result.values);
  }
  return result;
}

}  // namespace clothfit
