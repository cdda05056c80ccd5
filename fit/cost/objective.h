#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "fit/observe/marker_offsets.h"
#include "fit/problem/problem.h"
#include "model/integrate/relax.h"

namespace clothfit {

/// A cost near one parameter vector, to first order.
struct Linearisation {
  bool usable = false;
  /// Simulations that it took; each one with exact derivatives counts as two.
  int runs = 0;
  Eigen::VectorXd residual;
  Eigen::MatrixXd residual_by_coordinate;  ///< residuals x coordinates
};

/// Ways to get derivatives.
enum class Derivatives {
  tangents,  ///< exact for the discrete scheme (model/integrate/tangents.h)
  forward,   ///< differences, one run per coordinate; error O(step)
  central    ///< differences, two runs per coordinate; error O(step^2)
};

/// The cost of a fit: half the sum of squares (or a robust sum) of whitened residuals. They are a
/// function of the parameters. The cost's parts are blocks, one for each thing observed.
///
/// Every cost has the same time steps for all parameter vectors. A cost that chose new steps for
/// each vector would jump.
class Objective {
 public:
  virtual ~Objective() = default;

  /// The place of one observation's residuals.
  struct Block {
    int set = 0;     ///< index among the problem's observations; -1: none of these
    int row = 0;     ///< index in the set
    int marker = 0;  ///< or vertex
    int frame = 0;
    int offset = 0;
    int dimension = 0;
  };
  const std::vector<Block>& blocks() const { return blocks_; }
  int residual_count() const { return residual_count_; }
  const TimeSteps& steps() const { return steps_; }
  double time_step_s() const { return steps_.run_s; }
  const FitProblem& problem() const { return problem_; }
  virtual std::string name() const = 0;  ///< for a person

  /// Returns springs times time steps of one run, which is its work on any machine. The relaxation
  /// of a start at rest comes on top.
  virtual double spring_steps_per_run() const = 0;

  /// Says whether a time step that is not stable spoils the cost, as it does any run of many steps.
  virtual bool needs_stable_step() const { return true; }

  /// Says whether derivatives cost little beside the residuals. Both are then best computed
  /// together.
  virtual bool has_cheap_derivatives() const { return false; }

  /// Returns whitened residuals for each parameter vector. They are empty where the run diverged,
  /// its step would not be stable, or a point fell behind a camera.
  virtual std::vector<Eigen::VectorXd> residuals(
      const std::vector<Eigen::VectorXd>& values) const = 0;

  /// Returns residuals at `values` and their exact derivatives by the space's coordinates. The
  /// result is not usable where there are no residuals.
  virtual Linearisation linearise(const Eigen::VectorXd& values) const = 0;

  /// The step balances two errors of central differences. Truncation falls with its square,
  /// rounding (the run's, about 1e-13) rises with its inverse: 1e-4 leaves both near 1e-8.
  static constexpr double kDifferenceStep = 1e-4;

  /// Does the same with derivatives as asked for. Differences are over `step` in the coordinates,
  /// all perturbed runs side by side in lanes.
  Linearisation linearise(const Eigen::VectorXd& values, Derivatives derivatives,
                          double step = kDifferenceStep) const;

  /// Returns the mean length of an observation's residual: a robust cost for the evolutionary
  /// search. It is infinite where there are no residuals.
  double mean_length(const Eigen::VectorXd& residual) const;

 protected:
  /// `problem` must outlive the objective.
  Objective(const FitProblem& problem, const TimeSteps& steps) : problem_(problem), steps_(steps) {}
  Objective(const Objective&) = default;

  /// Adds a block behind those there are and fills in its offset.
  void add_block(Block block);
  /// Says whether the scheme is stable for these values at the objective's time steps.
  bool is_stable(const Eigen::VectorXd& values) const;

 private:
  const FitProblem& problem_;
  TimeSteps steps_;
  std::vector<Block> blocks_;
  int residual_count_ = 0;
};

/// The trajectory cost: residuals of a free run from the start in the first `frames` frames. Each
/// coordinate is divided by its sigma. Where the problem says that markers have constant offsets,
/// these are removed as those frames determine them (fit/observe/marker_offsets.h).
class TrajectoryObjective final : public Objective {
 public:
  TrajectoryObjective(const FitProblem& problem, int frames, const TimeSteps& steps);

  int frames() const { return frames_; }
  std::string name() const override;
  double spring_steps_per_run() const override;
  std::vector<Eigen::VectorXd> residuals(const std::vector<Eigen::VectorXd>& values) const override;
  using Objective::linearise;
  Linearisation linearise(const Eigen::VectorXd& values) const override;
  /// Does the same with derivatives by some of the coordinates only, in this order.
  Linearisation linearise_by(const Eigen::VectorXd& values, std::span<const int> coordinates) const;

 private:
  void take_offsets_out(Eigen::Ref<Eigen::MatrixXd> columns) const;

  int frames_;
  std::vector<MarkerResiduals> with_offset_;  ///< markers that have one
};

/// The same cost with the derivatives of a coarser mesh. Half the vertices a side cost a sixteenth.
/// Near the optimum the two meshes move alike, so most of the way there is had at the price of
/// plain runs. The gradient is not quite the cost's: the last steps need the exact derivatives.
class CoarselyDifferentiated final : public Objective {
 public:
  /// Both problems have the same parameters and observations. Each takes a time step of its own.
  CoarselyDifferentiated(const FitProblem& problem, const FitProblem& coarse_problem, int frames,
                         const TimeSteps& steps, const TimeSteps& coarse_steps);

  std::string name() const override { return fine_.name(); }
  bool has_cheap_derivatives() const override { return true; }
  double spring_steps_per_run() const override { return fine_.spring_steps_per_run(); }
  std::vector<Eigen::VectorXd> residuals(const std::vector<Eigen::VectorXd>& values) const override;
  using Objective::linearise;
  Linearisation linearise(const Eigen::VectorXd& values) const override;

 private:
  TrajectoryObjective fine_, coarse_;
};

}  // namespace clothfit
