#include "model/sheet/settle.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "model/sheet/step_matrix.h"

namespace clothfit {
namespace {

/// Root mean square of the points' residual forces as a share of a point's load. Below it the
/// exact second derivative is used.
constexpr double kNearBalance = 0.1;
/// Largest share of the last move by which a step begins ahead.
constexpr double kMostOnward = 0.9;

/// A shape, its energy and the derivative of that; zero at held points.
struct Place {
  Eigen::Matrix3Xd position_m, gradient_n;
  double energy_j = 0;
};

class Settling {
 public:
  Settling(BlockEnergy& energy, const std::vector<bool>& held, const SettleRule& rule)
      : energy_(energy),
        held_(held),
        rule_(rule),
        matrix_(energy, held),
        shift_per_s2_(rule.first_shift_per_s2),
        move_m_(Eigen::Matrix3Xd::Zero(3, energy.points())) {}

  MinimiseResult run(Eigen::Matrix3Xd& position_m) {
    energy_.open_way(position_m, move_m_);
    Place here = place(position_m);
    note(here);
    while (!is_over(rule_.stop, result_)) {
      // A move of both together is no longer than one of a step may be.
      const double onward = std::min(
          onward_share(), 0.5 * rule_.longest_step_m /
                              std::max(longest_move_m(), std::numeric_limits<double>::min()));
      const double open = energy_.open_way(here.position_m, onward * move_m_);
      const Place from = onward > 0 ? place(here.position_m + open * onward * move_m_) : here;
      std::optional<Place> next = step_from(from, onward);
      if (next && onward > 0 && resolved_ && next->energy_j > here.energy_j) next.reset();
      if (!next) {
        if (onward > 0) {
          halt();
        } else if (shift_per_s2_ > most_shift_per_s2()) {
          result_.reason = MinimiseReason::stalled;
          break;
        } else {
          shift_per_s2_ *= 4;
        }
        continue;
      }
      move_m_ = next->position_m - here.position_m;
      steps_since_halt_ += 1;
      here = std::move(*next);
      ++result_.iterations;
      note(here);
    }
    position_m = here.position_m;
    return result_;
  }

 private:
  double most_shift_per_s2() const { return 1e12 * rule_.first_shift_per_s2; }

  Place place(const Eigen::Matrix3Xd& position_m) {
    Place place{position_m, Eigen::Matrix3Xd(3, position_m.cols())};
    place.energy_j = energy_.energy_and_gradient(position_m, place.gradient_n);
    for (Eigen::Index v = 0; v < position_m.cols(); ++v)
      if (held_[static_cast<size_t>(v)]) place.gradient_n.col(v).setZero();
    ++result_.evaluations;
    return place;
  }

  void note(const Place& here) {
    result_.energy_j = here.energy_j;
    result_.gradient_n = here.gradient_n.norm();
    if (rule_.on_step)
      rule_.on_step({result_.iterations, here.energy_j, result_.gradient_n, here.position_m});
  }

  /// Returns the share of the last move by which the next begins ahead: that of an accelerated
  /// gradient method [nesterov1983] `steps_since_halt_` steps after it began.
  double onward_share() const {
    return std::min(kMostOnward, steps_since_halt_ / (steps_since_halt_ + 3));
  }

  double longest_move_m() const { return move_m_.colwise().norm().maxCoeff(); }

  /// Begins again without momentum.
  void halt() {
    steps_since_halt_ = 0;
    move_m_.setZero();
  }

  /// Makes one step that lowers the energy; none is found where the shift is too small.
  std::optional<Place> step_from(const Place& from, double onward) {
    if (energy_.update_pairs(from.position_m)) matrix_.take_pairs();
    const double lacking = from.gradient_n.norm() * std::sqrt(matrix_.free_points()) / rule_.load_n;
    matrix_.linearise(from.position_m,
                      lacking < kNearBalance ? Curvature::exact : Curvature::clamped);
    while (!matrix_.factorise(shift_per_s2_)) {
      if (shift_per_s2_ > most_shift_per_s2()) return std::nullopt;
      shift_per_s2_ *= 4;
    }
    Eigen::Matrix3Xd direction = matrix_.solve(from.gradient_n);
    const double longest_m = direction.colwise().norm().maxCoeff();
    const double most_m = onward > 0 ? 0.5 * rule_.longest_step_m : rule_.longest_step_m;
    if (longest_m > most_m) direction *= most_m / longest_m;
    const double slope = direction.cwiseProduct(from.gradient_n).sum();
    // Near the end the energy no longer resolves what a step gains; its slope does.
    constexpr double kNoise = 1e-11;
    resolved_ = std::abs(slope) > kNoise * std::abs(from.energy_j);
    // The energy must fall by this share of what the slope promises.
    constexpr double kShare = 1e-4, kShortest = 1.0 / 64;
    const double open = energy_.open_way(from.position_m, direction);
    if (!(open > 0)) return std::nullopt;
    for (double step = open; step >= kShortest * open; step *= 0.5) {
      Place trial = place(from.position_m + step * direction);
      const bool good = resolved_ ? trial.energy_j <= from.energy_j + kShare * step * slope
                                  : trial.gradient_n.norm() < from.gradient_n.norm();
      if (!good) continue;
      if (step == open)
        shift_per_s2_ = std::max(0.25 * shift_per_s2_, 1e-6 * rule_.first_shift_per_s2);
      else if (step < 0.2 * open)
        shift_per_s2_ *= 4;
      return trial;
    }
    return std::nullopt;
  }

  BlockEnergy& energy_;
  const std::vector<bool>& held_;
  const SettleRule& rule_;
  StepMatrix matrix_;
  double shift_per_s2_;
  bool resolved_ = true;  ///< the energy resolves what the last step gained
  Eigen::Matrix3Xd move_m_;
  double steps_since_halt_ = 0;
  MinimiseResult result_;
};

}  // namespace

MinimiseResult settle(BlockEnergy& energy, const std::vector<bool>& held, const SettleRule& rule,
                      Eigen::Matrix3Xd& position_m) {
  assert(held.size() == static_cast<size_t>(energy.points()));
  return Settling(energy, held, rule).run(position_m);
}

}  // namespace clothfit
