#pragma once

#include <string>
#include <vector>

#include "data/progress.h"
#include "fit/cost/shooting.h"
#include "fit/interface/fit_options.h"

namespace clothfit {

struct ShootingOptions {
  int window_frames =
      15;         ///< of a window, 1 or more; longer ones tell more and lose the cloth sooner
  int nodes = 3;  ///< per side, of the corrections of a window's state: 6 runs for each node
  /// Standard deviation of a gap's positions (m), of the first round and of the last; that of
  /// velocities is this over a window's duration. It falls by equal factors between.
  double first_gap_m = 1e-2, last_gap_m = 1e-3;
  int rounds = 3;                   ///< each with a continuity, a loss and guesses of its own
  int iterations = 15;              ///< of a round, at most
  double least_gain = 1e-2;         ///< a round ends when the cost falls by less than this share
  double most_spring_steps = 1e18;  ///< springs times time steps; looked at after each iteration
  Loss loss = Loss::huber;
  double stability_margin = 1.5;
};

struct ShootingFit {
  bool usable = false;
  Eigen::VectorXd values;  ///< of the problem's parameters
  ShootingObjective::Corrections corrections;
  ShootingWindows windows;
  double cost = 0;  ///< of the last round
  double time_step_s = 0;
  int iterations = 0;
  double runs = 0;      ///< of the length of all windows, derivatives counted as Linearisation does
  std::string message;  ///< one line for a person
};

/// Windows of about equal length over the first `frames` frames, with guesses of their states: from
/// smoothed 3D tracks where there are any (fit/cost/track_states.h; windows begin in frames that
/// have a state), else from a free run at `values`. None where there is neither.
std::optional<ShootingWindows> make_windows(const FitProblem& problem, int frames,
                                            const Eigen::VectorXd& values,
                                            const ShootingOptions& options);

/// Lowers the shooting cost from `start` by Levenberg and Marquardt's method. Parameters and window
/// states move at once, in rounds of tighter continuity; the windows' states are eliminated from
/// each step (fit/cost/bordered_chain.h). It leads near the optimum of the trajectory's cost from
/// starts from which that cannot be reached, and no nearer than its last continuity: the trajectory
/// is for refine() to finish. The bits are the same for any number of threads.
ShootingFit fit_by_shooting(const FitProblem& problem, int frames, const Eigen::VectorXd& start,
                            const ShootingOptions& options, const ProgressCallback& progress);

/// The step -(H + damping diag H)^-1 gradient of parameters and window states. `held` coordinates
/// of the parameters stay.
BorderedChainSolution damped_step(const BorderedChain& equations, double damping,
                                  const std::vector<bool>& held);

}  // namespace clothfit
