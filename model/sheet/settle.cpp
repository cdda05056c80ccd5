#include "model/sheet/settle.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace clothfit {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// Root mean square of the vertices' residual forces as a share of a vertex's load. Below it the
/// exact second derivative is used.
constexpr double kNearBalance = 0.1;

/// The matrix of one step over the free vertices, and its factorisation.
class StepMatrix {
 public:
  StepMatrix(const SheetEnergy& energy, const std::vector<bool>& held) : energy_(energy) {
    for (const bool is_held : held) unknown_.push_back(is_held ? -1 : free_++);
    Sparse pattern(3 * free_, 3 * free_);
    std::vector<Eigen::Triplet<double>> entries;
    const std::vector<SheetEnergy::Pair>& pairs = energy.pairs();
    for (size_t p = 0; p < pairs.size(); ++p) {
      const int column = unknown_[static_cast<size_t>(pairs[p].low)],
                row = unknown_[static_cast<size_t>(pairs[p].high)];
      if (column < 0 || row < 0) continue;
      blocks_.push_back(static_cast<int>(p));
      for (int c = 0; c < 3; ++c)
        for (int r = row == column ? c : 0; r < 3; ++r)
          entries.emplace_back(3 * row + r, 3 * column + c, 1);
    }
    pattern.setFromTriplets(entries.begin(), entries.end());
    matrix_ = pattern;
    factors_.analyzePattern(matrix_);
  }

  int free_vertices() const { return free_; }
  int unknown(int vertex) const { return unknown_[static_cast<size_t>(vertex)]; }

  void linearise(const Eigen::Matrix3Xd& position_m, Curvature curvature) {
    energy_.second_derivative(position_m, curvature, second_);
  }

  /// Says whether H + `shift_per_s2` M is positive definite.
  bool factorise(double shift_per_s2) {
    // Pairs come column by column, rows rising, as the matrix stores them. So each of a block's
    // three columns is filled from where it was left.
    std::vector<double*> next(static_cast<size_t>(3 * free_));
    for (size_t column = 0; column < next.size(); ++column)
      next[column] = matrix_.valuePtr() + matrix_.outerIndexPtr()[column];
    for (const int p : blocks_) {
      const SheetEnergy::Pair& pair = energy_.pairs()[static_cast<size_t>(p)];
      const auto column = static_cast<size_t>(3 * unknown(pair.low));
      Eigen::Matrix3d block = second_[static_cast<size_t>(p)];
      const bool diagonal = pair.low == pair.high;
      if (diagonal) block.diagonal().array() += shift_per_s2 * energy_.mass_kg()[pair.low];
      for (size_t c = 0; c < 3; ++c)
        for (size_t r = diagonal ? c : 0; r < 3; ++r)
          *next[column + c]++ = block(static_cast<int>(r), static_cast<int>(c));
    }
    factors_.factorize(matrix_);
    return factors_.info() == Eigen::Success;
  }

  /// Returns the step against `gradient_n`; held vertices do not move.
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
  const SheetEnergy& energy_;
  std::vector<int> unknown_;  ///< of every vertex; -1: held
  int free_ = 0;
  std::vector<int> blocks_;  ///< pairs of free vertices
  std::vector<Eigen::Matrix3d> second_;
  Sparse matrix_;  ///< lower triangle
  Eigen::SimplicialLLT<Sparse, Eigen::Lower> factors_;
};

double energy_and_free_gradient(const SheetEnergy& energy, const std::vector<bool>& held,
                                const Eigen::Matrix3Xd& position_m, Eigen::Matrix3Xd& gradient_n) {
  const double energy_j = energy.energy_and_gradient(position_m, gradient_n);
  for (Eigen::Index v = 0; v < gradient_n.cols(); ++v)
    if (held[static_cast<size_t>(v)]) gradient_n.col(v).setZero();
  return energy_j;
}

}  // namespace

MinimiseResult settle(const SheetEnergy& energy, const std::vector<bool>& held,
                      const SettleRule& rule, Eigen::Matrix3Xd& position_m) {
  assert(held.size() == static_cast<size_t>(energy.mesh().vertex_count()));
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
    const double lacking = result.gradient_n * std::sqrt(matrix.free_vertices()) / rule.load_n;
    if (!linearised)
      matrix.linearise(position_m, lacking < kNearBalance ? Curvature::exact : Curvature::clamped);
    linearised = true;
    double step = 0;
    if (matrix.factorise(shift)) {
      const Eigen::Matrix3Xd direction = matrix.solve(gradient);
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
