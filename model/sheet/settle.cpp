#include "model/sheet/settle.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "model/sheet/block_cholesky.h"

namespace clothfit {
namespace {

/// Root mean square of the points' residual forces as a share of a point's load. Below it the
/// exact second derivative is used.
constexpr double kNearBalance = 0.1;

/// The matrix of one step over the free points, and its factorisation.
class StepMatrix {
 public:
  StepMatrix(const BlockEnergy& energy, const std::vector<bool>& held)
      : energy_(energy), of_free_(free_points(held)), factors_(free_, of_free_) {}

  int free_points() const { return free_; }

  void linearise(const Eigen::Matrix3Xd& position_m, Curvature curvature) {
    energy_.second_derivative(position_m, curvature, second_);
  }

  /// Says whether H + `shift_per_s2` M is positive definite.
  bool factorise(double shift_per_s2) {
    matrix_.clear();
    for (const int p : blocks_) {
      const BlockEnergy::Pair& pair = energy_.pairs()[static_cast<size_t>(p)];
      matrix_.push_back(second_[static_cast<size_t>(p)]);
      if (pair.low == pair.high)
        matrix_.back().diagonal().array() += shift_per_s2 * energy_.mass_kg()[pair.low];
    }
    return factors_.factorise(matrix_);
  }

  /// Returns the step against `gradient_n`; held points do not move.
  Eigen::Matrix3Xd solve(const Eigen::Matrix3Xd& gradient_n) const {
    Eigen::VectorXd right(3 * free_);
    for (int v = 0; v < gradient_n.cols(); ++v)
      if (unknown(v) >= 0) right.segment<3>(3 * unknown(v)) = -gradient_n.col(v);
    const Eigen::VectorXd free = factors_.solve(right);
    Eigen::Matrix3Xd step = Eigen::Matrix3Xd::Zero(3, gradient_n.cols());
    for (int v = 0; v < gradient_n.cols(); ++v)
      if (unknown(v) >= 0) step.col(v) = free.segment<3>(3 * unknown(v));
    return step;
  }

 private:
  int unknown(int point) const { return unknown_[static_cast<size_t>(point)]; }

  /// Numbers the free points and returns the pairs of them.
  std::vector<BlockEnergy::Pair> free_points(const std::vector<bool>& held) {
    for (const bool is_held : held) unknown_.push_back(is_held ? -1 : free_++);
    std::vector<BlockEnergy::Pair> of_free;
    const std::vector<BlockEnergy::Pair>& pairs = energy_.pairs();
    for (size_t p = 0; p < pairs.size(); ++p) {
      const int low = unknown(pairs[p].low), high = unknown(pairs[p].high);
      if (low < 0 || high < 0) continue;
      blocks_.push_back(static_cast<int>(p));
      of_free.push_back({low, high});
    }
    return of_free;
  }

  const BlockEnergy& energy_;
  int free_ = 0;
  std::vector<int> unknown_;                ///< of every point; -1: held
  std::vector<int> blocks_;                 ///< pairs of free points
  std::vector<BlockEnergy::Pair> of_free_;  ///< the same, as they are numbered
  BlockCholesky factors_;
  std::vector<Eigen::Matrix3d> second_, matrix_;
};

double energy_and_free_gradient(const BlockEnergy& energy, const std::vector<bool>& held,
                                const Eigen::Matrix3Xd& position_m, Eigen::Matrix3Xd& gradient_n) {
  const double energy_j = energy.energy_and_gradient(position_m, gradient_n);
  for (Eigen::Index v = 0; v < gradient_n.cols(); ++v)
    if (held[static_cast<size_t>(v)]) gradient_n.col(v).setZero();
  return energy_j;
}

}  // namespace

MinimiseResult settle(const BlockEnergy& energy, const std::vector<bool>& held,
                      const SettleRule& rule, Eigen::Matrix3Xd& position_m) {
  assert(held.size() == static_cast<size_t>(energy.points()));
  StepMatrix matrix(energy, held);
  const double least_shift = 1e-6 * rule.first_shift_per_s2,
               most_shift = 1e12 * rule.first_shift_per_s2;
  Eigen::Matrix3Xd gradient(3, position_m.cols()), new_gradient(3, position_m.cols());
  MinimiseResult result;
  result.energy_j = energy_and_free_gradient(energy, held, position_m, gradient);
  result.gradient_n = gradient.norm();
  result.evaluations = 1;
  double shift = rule.first_shift_per_s2;
  bool linearised = false;
  while (!is_over(rule.stop, result)) {
    const double lacking = result.gradient_n * std::sqrt(matrix.free_points()) / rule.load_n;
    if (!linearised)
      matrix.linearise(position_m, lacking < kNearBalance ? Curvature::exact : Curvature::clamped);
    linearised = true;
    double step = 0;
    if (matrix.factorise(shift)) {
      Eigen::Matrix3Xd direction = matrix.solve(gradient);
      const double longest_m = direction.colwise().norm().maxCoeff();
      if (longest_m > rule.longest_step_m) direction *= rule.longest_step_m / longest_m;
      const double slope = direction.cwiseProduct(gradient).sum();
      // The energy must fall by this share of what the slope promises.
      constexpr double kShare = 1e-4, kShortest = 1.0 / 64, kNoise = 1e-11;
      for (step = 1; step >= kShortest; step *= 0.5) {
        const Eigen::Matrix3Xd trial = position_m + step * direction;
        const double energy_j = energy_and_free_gradient(energy, held, trial, new_gradient);
        ++result.evaluations;
        // Near the end the energy no longer resolves what a step gains; its slope does.
        const bool resolved = std::abs(slope) > kNoise * std::abs(result.energy_j);
        const bool good = resolved ? energy_j <= result.energy_j + kShare * step * slope
                                   : new_gradient.norm() < result.gradient_n;
        if (!good) continue;
        position_m = trial;
        result.energy_j = energy_j;
        break;
      }
      if (step < kShortest) step = 0;
    }
    if (step == 0) {
      if (shift > most_shift) {
        result.reason = MinimiseReason::stalled;
        break;
      }
      shift *= 4;
      continue;
    }
    linearised = false;
    std::swap(gradient, new_gradient);
    result.gradient_n = gradient.norm();
    ++result.iterations;
    if (step == 1)
      shift = std::max(0.25 * shift, least_shift);
    else if (step < 0.2)
      shift *= 4;
  }
  return result;
}

}  // namespace clothfit
