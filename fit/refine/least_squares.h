#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <vector>

#include "fit/problem/box.h"

namespace clothfit {

/// A cost that is half a sum of squares, as minimise() sees it: where it stands, and what its
/// derivatives say of steps from there. Losses, priors, eliminated unknowns and the reuse of
/// derivatives are its own affair.
class LeastSquares {
 public:
  virtual ~LeastSquares() = default;

  virtual double cost() const = 0;
  /// The gradient by the coordinates, with all that step() needs; null where there is none.
  virtual const Eigen::VectorXd* gradient() = 0;
  /// The step -(H + damping diag H)^-1 gradient. `held` coordinates stay.
  virtual Eigen::VectorXd step(double damping, const std::vector<bool>& held) = 0;
  /// The decrease of the cost to second order.
  virtual double predicted_decrease(const Eigen::VectorXd& way) const = 0;
  /// Goes there if that lowers the cost; false if not.
  virtual bool move_to(const Eigen::VectorXd& next) = 0;

  /// Holds coordinates besides those at an end of their range.
  virtual void hold(std::vector<bool>&) const {}
  /// The size of a step, in what is looked at to say that a fit has ended.
  virtual double moved(const Eigen::VectorXd& way) const { return way.cwiseAbs().maxCoeff(); }
  /// A step that promises less is the last one.
  virtual double least_decrease() const { return 0; }
  virtual bool is_out_of_work() const { return false; }

  enum class Renewal { not_needed, done, failed };
  /// Takes exact derivatives for kept or updated ones, once a step was refused.
  virtual Renewal renew_derivatives() { return Renewal::not_needed; }
};

struct MinimiseOptions {
  int most_iterations = 60;  ///< steps that were taken
  int most_refusals = 240;
  double least_step = 0;  ///< a step that moves less is the last one
  double first_damping = 1e-3, least_damping = 1e-9, most_damping = 1e6;
  std::function<void(int iterations)> report;  ///< before each step; or none
};

enum class MinimiseEnd {
  converged,
  no_derivatives,
  no_descent,  ///< however damped, steps were refused
  limit        ///< of iterations, refusals or work
};

struct Minimised {
  MinimiseEnd end = MinimiseEnd::limit;
  int iterations = 0, refusals = 0;
  Eigen::VectorXd x;  ///< where it ended
};

/// Levenberg and Marquardt's method within a box, from `x`. A coordinate at an end of its range
/// that keeps it from a lower cost takes no part in a step. Damping falls tenfold after a step that
/// kept a quarter of its promise, and grows tenfold after others. Throws what `report` throws.
Minimised minimise(LeastSquares& problem, const Box& box, Eigen::VectorXd x,
                   const MinimiseOptions& options);

}  // namespace clothfit
