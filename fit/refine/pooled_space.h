#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "fit/problem/problem.h"

namespace clothfit {

/// A cost near one point, to second order, as Gauss and Newton have it.
struct Quadratic {
  bool usable = false;
  double cost = 0;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd information;
};

/// The parameters of several recordings of one cloth. Those of the physics are shared; what tells
/// how each recording was placed, measured, or began, is its own. Coordinates: the shared ones,
/// then those of each recording in turn.
class PooledSpace {
 public:
  /// The problems, at least one, must outlive the space. Throws InputError unless they have the
  /// same parameters of the physics.
  explicit PooledSpace(std::span<const FitProblem* const> problems);

  int size() const { return size_; }
  int shared() const { return static_cast<int>(shared_.size()); }
  size_t recordings() const { return places_.size(); }
  /// Returns those parameters of a recording's own space that all share.
  std::vector<int> shared_of(size_t recording) const;
  /// Returns the others.
  const std::vector<int>& own_of(size_t recording) const { return places_[recording].own; }
  /// Returns their first coordinate.
  int first_own(size_t recording) const { return places_[recording].first; }

  Eigen::VectorXd coordinates(const std::vector<Eigen::VectorXd>& values) const;
  /// Returns the parameters of each problem.
  std::vector<Eigen::VectorXd> values(const Eigen::VectorXd& coordinates) const;
  Eigen::VectorXd lower() const;  ///< ends of the ranges, in coordinates
  Eigen::VectorXd upper() const;

  /// The sum of the recordings' costs. No two recordings' own coordinates meet in a residual, so
  /// the information is an arrow.
  struct Expansion {
    bool usable = false;
    double cost = 0;
    Eigen::VectorXd gradient;
    Eigen::MatrixXd shared;                ///< information of the shared coordinates
    std::vector<Eigen::MatrixXd> own;      ///< of each recording's own
    std::vector<Eigen::MatrixXd> between;  ///< own x shared
  };
  /// `parts`: over the parameters of each problem's own space.
  Expansion gather(const std::vector<Quadratic>& parts) const;

  /// The step -(H + damping diag H)^-1 gradient; `held` coordinates stay. Recordings' own ones are
  /// eliminated first, so that any number of recordings costs only their number.
  Eigen::VectorXd step(const Expansion& expansion, double damping,
                       const std::vector<bool>& held) const;

  /// By how much the expansion says that the cost falls on the way.
  double predicted_decrease(const Expansion& expansion, const Eigen::VectorXd& way) const;

 private:
  struct Place {
    std::vector<int> own;  ///< parameters of the problem that are not shared
    int first = 0;         ///< their first coordinate
  };
  Eigen::VectorXd ends(double FitParameter::*end) const;

  std::vector<const FitProblem*> problems_;
  std::vector<std::vector<int>> shared_;  ///< [shared][problem]: index in its space
  std::vector<Place> places_;
  int size_ = 0;
};

}  // namespace clothfit
