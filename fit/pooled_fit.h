#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "data/progress.h"
#include "fit/problem.h"
#include "model/relax.h"

namespace clothfit {

/// Half the sum of squares of all that several recordings of one cloth leave, with their priors.
/// Parameters of the physics are shared; what tells how each recording was placed, or began, is its
/// own. Coordinates: the shared ones, then those of each recording in turn.
class PooledCost {
 public:
  /// Time steps for each problem. The problems must outlive the cost. Throws InputError unless
  /// they are at least one and have the same parameters of the physics.
  PooledCost(std::span<const FitProblem* const> problems, std::vector<TimeSteps> steps);

  int size() const { return size_; }
  int shared() const { return static_cast<int>(shared_.size()); }
  Eigen::VectorXd coordinates(const std::vector<Eigen::VectorXd>& values) const;
  /// Of each problem's parameters.
  std::vector<Eigen::VectorXd> values(const Eigen::VectorXd& coordinates) const;
  Eigen::VectorXd lower() const;  ///< ends of the ranges, in coordinates
  Eigen::VectorXd upper() const;

  /// Infinite where a recording cannot be simulated.
  double at(const Eigen::VectorXd& coordinates) const;

  /// To second order, as Gauss and Newton have it. No two recordings' own coordinates meet in a
  /// residual, so the information is an arrow.
  struct Expansion {
    bool usable = false;
    double cost = 0;
    Eigen::VectorXd gradient;
    Eigen::MatrixXd shared;                ///< information of the shared coordinates
    std::vector<Eigen::MatrixXd> own;      ///< of each recording's own
    std::vector<Eigen::MatrixXd> between;  ///< own x shared
  };
  Expansion expand(const Eigen::VectorXd& coordinates) const;

  /// The step -(H + damping diag H)^-1 gradient; `held` coordinates stay. Recordings' own ones are
  /// eliminated first, so that any number of recordings costs only their number.
  Eigen::VectorXd step(const Expansion& expansion, double damping,
                       const std::vector<bool>& held) const;

 private:
  struct Place {
    std::vector<int> own;  ///< parameters of the problem that are not shared
    int first = 0;         ///< their first coordinate
  };
  std::span<const FitProblem* const> problems_;
  std::vector<TimeSteps> steps_;
  std::vector<std::vector<int>> shared_;  ///< [shared][problem]: index in its space
  std::vector<Place> places_;
  int size_ = 0;
};

struct PooledOptions {
  int iterations = 60;       ///< in all
  int rounds = 6;            ///< each with time steps chosen anew, until one hardly moves
  double least_step = 1e-7;  ///< it ends when no shared coordinate moves further
  double stability_margin = 1.5;
};

struct PooledFit {
  bool usable = false;
  bool converged = false;
  std::string message;
  std::map<std::string, double> shared;  ///< values of the parameters of the physics, by name
  std::vector<Eigen::VectorXd> values;   ///< of each problem's parameters
  double cost = 0;                       ///< half the sum of squares
  int iterations = 0;
};

/// The least of the pooled cost by Levenberg and Marquardt's method, from `start` (values by name;
/// what it does not name starts where its problem has it), under the squared loss, each recording's
/// fitted frames. Recordings are simulated side by side; the bits are the same for any number of
/// threads. Throws InputError as PooledCost does.
PooledFit fit_pooled(std::span<const FitProblem* const> problems,
                     const std::map<std::string, double>& start, const PooledOptions& options,
                     const ProgressCallback& progress);

}  // namespace clothfit
