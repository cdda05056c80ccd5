#pragma once

#include <Eigen/Core>
#include <vector>

#include "model/rest/hanging_energy.h"

namespace clothfit {

/// An energy of points (J) whose second derivative is a sparse matrix of 3 x 3 blocks. Which blocks
/// there are changes with the shape where points touch.
class BlockEnergy {
 public:
  virtual ~BlockEnergy() = default;

  /// Returns the mass of every point.
  virtual const Eigen::VectorXd& mass_kg() const = 0;

  /// Returns the energy; its derivative by the positions (3 x points, N) goes to `gradient_n`.
  virtual double energy_and_gradient(const Eigen::Matrix3Xd& position_m,
                                     Eigen::Matrix3Xd& gradient_n) const = 0;

  /// A pair of points whose forces depend on one another; `low` <= `high`.
  struct Pair {
    int low = 0, high = 0;
    friend auto operator<=>(const Pair&, const Pair&) = default;
  };
  /// Returns all pairs, each once.
  virtual const std::vector<Pair>& pairs() const = 0;
  /// Returns d gradient[high] / d position[low] of every pair (N/m).
  virtual void second_derivative(const Eigen::Matrix3Xd& position_m, Curvature curvature,
                                 std::vector<Eigen::Matrix3d>& blocks) const = 0;

  /// Finds what comes near on the straight way from `from_m` by `move_m`, and returns the share of
  /// it on which nothing passes through anything. Energies are complete for places of the last way.
  virtual double open_way(const Eigen::Matrix3Xd& /*from_m*/, const Eigen::Matrix3Xd& /*move_m*/) {
    return 1;
  }
  /// Brings pairs() up to date for a place on the last way, and says whether they changed.
  virtual bool update_pairs(const Eigen::Matrix3Xd& /*position_m*/) { return false; }

  int points() const { return static_cast<int>(mass_kg().size()); }
};

}  // namespace clothfit
