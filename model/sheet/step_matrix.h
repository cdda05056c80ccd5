#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "model/sheet/block_cholesky.h"
#include "model/sheet/block_energy.h"

namespace clothfit {

/// The matrix of one step over the free points, and its factorisation.
class StepMatrix {
 public:
  StepMatrix(const BlockEnergy& energy, const std::vector<bool>& held) : energy_(energy) {
    for (const bool is_held : held) unknown_.push_back(is_held ? -1 : free_++);
    take_pairs();
  }

  /// Takes over the energy's pairs when they have changed.
  void take_pairs() {
    blocks_.clear();
    std::vector<BlockEnergy::Pair> of_free;
    const std::vector<BlockEnergy::Pair>& pairs = energy_.pairs();
    for (size_t p = 0; p < pairs.size(); ++p) {
      const int low = unknown(pairs[p].low), high = unknown(pairs[p].high);
      if (low < 0 || high < 0) continue;
      blocks_.push_back(static_cast<int>(p));
      of_free.push_back({low, high});
    }
    factors_.emplace(free_, of_free);
  }

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
    return factors_->factorise(matrix_);
  }

  /// Returns the step against `gradient_n`; held points do not move.
  Eigen::Matrix3Xd solve(const Eigen::Matrix3Xd& gradient_n) const {
    Eigen::VectorXd right(3 * free_);
    for (int v = 0; v < gradient_n.cols(); ++v)
      if (unknown(v) >= 0) right.segment<3>(3 * unknown(v)) = -gradient_n.col(v);
    const Eigen::VectorXd free = factors_->solve(right);
    Eigen::Matrix3Xd step = Eigen::Matrix3Xd::Zero(3, gradient_n.cols());
    for (int v = 0; v < gradient_n.cols(); ++v)
      if (unknown(v) >= 0) step.col(v) = free.segment<3>(3 * unknown(v));
    return step;
  }

 private:
  int unknown(int point) const { return unknown_[static_cast<size_t>(point)]; }

  const BlockEnergy& energy_;
  int free_ = 0;
  std::vector<int> unknown_;  ///< of every point; -1: held
  std::vector<int> blocks_;   ///< pairs of free points
  std::optional<BlockCholesky> factors_;
  std::vector<Eigen::Matrix3d> second_, matrix_;
};

}  // namespace clothfit
