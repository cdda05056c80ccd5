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
  /// Simulations that it took; one with exact derivatives counts as one more for each of these.
  int runs = 0;
  Eigen::VectorXd residual;
  Eigen::MatrixXd residual_by_coordinate;  ///< residuals x coordinates
};

/// How derivatives are had.
enum class Derivatives {
  tangents,  ///< exact for the discrete scheme (model/integrate/tangents.h)
  forward,   ///< differences, one run per coordinate; error O(step)
  central    ///< differences, two runs per coordinate; error O(step^2)
};

/// A cost of a fit: half the sum of squares (or a robust sum) of whitened residuals, which are a
/// function of the parameters. Its parts are blocks, one for each thing observed.
///
/// Every cost has the same time steps for all parameter vectors: a cost that cut time anew for each
/// of them would jump.
class Objective {
 public:
  virtual ~Objective() = default;

  /// Where the residuals of one observation lie.
  struct Block {
    int set = 0;     ///< of the problem's observations; -1: none of these
    int row = 0;     ///< in the set
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

  /// Springs times time steps of one run: what it costs, on any machine. (Relaxing a start at rest
  /// comes on top.)
  virtual double spring_steps_per_run() const = 0;

  /// Whether a time step that is not stable spoils it, as it does any run of many steps.
  virtual bool needs_stable_step() const { return true; }

  /// Whether derivatives cost little beside the residuals, so that both are best had together.
  virtual bool has_cheap_derivatives() const { return false; }

  /// Whitened residuals for each parameter vector; empty where there are none because the run
  /// diverged, its step would not be stable, or a point fell behind a camera.
  virtual std::vector<Eigen::VectorXd> residuals(
      const std::vector<Eigen::VectorXd>& values) const = 0;

  /// Residuals at `values` and their exact derivatives by the space's coordinates. Not usable where
  /// there are none.
  virtual Linearisation linearise(const Eigen::VectorXd& values) const = 0;

  /// Truncation of central differences falls with the step's square, rounding (the run's, about
  /// 1e-13) rises with its inverse: 1e-4 leaves both near 1e-8.
  static constexpr double kDifferenceStep = 1e-4;

  /// The same, with derivatives as asked for; differences over `step` in the coordinates, all
  /// perturbed runs side by side in lanes.
  Linearisation linearise(const Eigen::VectorXd& values, Derivatives derivatives,
                          double step = kDifferenceStep) const;

  /// Mean length of the residual of an observation: a robust cost for the evolutionary search.
  /// Infinite where there are no residuals.
  double mean_length(const Eigen::VectorXd& residual) const;

 protected:
  /// `problem` must outlive the objective.
  Objective(const FitProblem& problem, const TimeSteps& steps) : problem_(problem), steps_(steps) {}
  Objective(const Objective&) = default;

  /// Adds a block behind those there are; its offset is filled in.
  void add_block(Block block);
  /// Whether the scheme is stable for these values at the objective's time steps.
  bool is_stable(const Eigen::VectorXd& values) const;

 private:
  const FitProblem& problem_;
  TimeSteps steps_;
  std::vector<Block> blocks_;
  int residual_count_ = 0;
};

/// The trajectory cost: what a free run from the start leaves of the observations in the first
/// `frames` frames, each coordinate divided by its sigma. Where the problem says that markers have
/// constant offsets, these are taken out (fit/observe/marker_offsets.h), as those frames determine
/// them.
class TrajectoryObjective final : public Objective {
 public:
  TrajectoryObjective(const FitProblem& problem, int frames, const TimeSteps& steps);

  int frames() const { return frames_; }
  std::string name() const override;
  double spring_steps_per_run() const override;
  std::vector<Eigen::VectorXd> residuals(const std::vector<Eigen::VectorXd>& values) const override;
  using Objective::linearise;
  Linearisation linearise(const Eigen::VectorXd& values) const override;
  /// The same with derivatives by some of the coordinates only, in this order.
  Linearisation linearise_by(const Eigen::VectorXd& values, std::span<const int> coordinates) const;

 private:
  void take_offsets_out(Eigen::Ref<Eigen::MatrixXd> columns) const;

  int frames_;
  std::vector<MarkerResiduals> with_offset_;  ///< markers that have one
};

/// The same cost with the derivatives of a coarser mesh: half the vertices a side cost a
/// sixteenth, and near the optimum the two meshes move alike, so that most of the way there is had
/// at the price of plain runs. Its gradient is not quite the cost's: the last steps need the exact
/// derivatives.
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
