#include "fit/refine/least_squares.h"

#include <algorithm>
#include <utility>

namespace clothfit {
namespace {

/// The damping after a step that was taken: one that keeps less than a quarter of its promise was
/// too long to be trusted so soon again.
double damping_after(double damping, double gained, double predicted, double least) {
  return gained < 0.25 * predicted ? std::min(10 * damping, 1.0) : std::max(least, 0.1 * damping);
}

}  // namespace

Minimised minimise(LeastSquares& problem, const Box& box, Eigen::VectorXd x,
                   const MinimiseOptions& options) {
  Minimised result;
  result.x = std::move(x);
  double damping = options.first_damping;
  while (!problem.is_out_of_work() && result.iterations < options.most_iterations &&
         result.refusals < options.most_refusals) {
    if (options.report) options.report(result.iterations);
    const Eigen::VectorXd* gradient = problem.gradient();
    if (gradient == nullptr) {
      result.end = MinimiseEnd::no_derivatives;
      return result;
    }
    std::vector<bool> held = box.blocked(result.x, *gradient);
    problem.hold(held);
    const Eigen::VectorXd step = problem.step(damping, held);
    const Eigen::VectorXd next = box.clamped(result.x + step), way = next - result.x;
    const double predicted = problem.predicted_decrease(way), moved = problem.moved(way);
    if (step.allFinite() && predicted < problem.least_decrease()) {
      result.end = MinimiseEnd::converged;
      return result;
    }
    const double before = problem.cost();
    const bool taken = step.allFinite() && problem.move_to(next);
    if (taken) {
      ++result.iterations;
      result.x = next;
      damping = damping_after(damping, before - problem.cost(), predicted, options.least_damping);
    } else {
      ++result.refusals;
    }
    // A step this short that rises is the cost's rounding.
    if (moved < options.least_step) {
      result.end = MinimiseEnd::converged;
      return result;
    }
    if (taken) continue;
    const LeastSquares::Renewal renewal = problem.renew_derivatives();
    if (renewal == LeastSquares::Renewal::done) continue;
    damping *= 10;
    if (renewal == LeastSquares::Renewal::failed || damping > options.most_damping) {
      result.end = renewal == LeastSquares::Renewal::failed ? MinimiseEnd::no_derivatives
                                                            : MinimiseEnd::no_descent;
      return result;
    }
  }
  return result;
}

}  // namespace clothfit
