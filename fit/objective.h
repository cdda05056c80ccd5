#pragma once

#include <vector>

#include "fit/problem.h"

namespace clothfit {

enum class Differences {
  forward,  ///< one run per parameter; error O(step)
  central   ///< two runs per parameter; error O(step^2)
};

/// A cost near one parameter vector, to first order.
struct Linearisation {
  bool usable = false;
  int runs = 0;  ///< simulations that it took
  Eigen::VectorXd residual;
  Eigen::MatrixXd residual_by_coordinate;  ///< residuals x parameters
};

/// The trajectory cost: what a free run from the start leaves of the observations in the first
/// `frames` frames, each coordinate divided by its sigma.
class Objective {
 public:
  /// `time_step_s` stays the same for all parameter vectors: a cost that cut time anew for each of
  /// them would jump.
  Objective(const FitProblem& problem, int frames, double time_step_s);

  /// Where the residuals of one observation lie.
  struct Block {
    int set = 0;
    int row = 0;
    int offset = 0;
    int dimension = 0;
  };
  const std::vector<Block>& blocks() const { return blocks_; }
  int residual_count() const { return residual_count_; }
  int frames() const { return frames_; }
  double time_step_s() const { return time_step_s_; }

  /// Springs times time steps of one run: what it costs, on any machine. (Relaxing a start at rest
  /// comes on top.)
  double spring_steps_per_run() const;

  /// Whitened residuals for each parameter vector; empty where there are none because the run
  /// diverged, its step would not be stable, or a point fell behind a camera.
  std::vector<Eigen::VectorXd> residuals(const std::vector<Eigen::VectorXd>& values) const;

  /// Truncation of central differences falls with the step's square, rounding (the run's, about
  /// 1e-13) rises with its inverse: 1e-4 leaves both near 1e-8.
  static constexpr double kDifferenceStep = 1e-4;

  /// Residuals at `values` and their derivative by the space's coordinates, by differences over
  /// `step` (all perturbed runs side by side in lanes). Not usable where there are none.
  Linearisation linearise(const Eigen::VectorXd& values, Differences differences,
                          double step = kDifferenceStep) const;

  /// Mean length of the residual of an observation: a robust cost for the evolutionary search.
  /// Infinite where there are no residuals.
  double mean_length(const Eigen::VectorXd& residual) const;

 private:
  const FitProblem& problem_;
  int frames_;
  double time_step_s_;
  std::vector<Block> blocks_;
  int residual_count_ = 0;
};

}  // namespace clothfit
