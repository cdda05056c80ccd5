#include "model/sheet/settle_otherwise.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "model/sheet/step_matrix.h"

namespace clothfit {
namespace {

/// The energy where held points stay, counted, with what each step reaches.
class Watched {
 public:
  Watched(BlockEnergy& energy, const std::vector<bool>& held, const SettleRule& rule)
      : energy_(energy), held_(held), rule_(rule) {}

  double energy_and_gradient(const Eigen::Matrix3Xd& position_m, Eigen::Matrix3Xd& gradient_n) {
    const double energy_j = energy_.energy_and_gradient(position_m, gradient_n);
    for (Eigen::Index v = 0; v < gradient_n.cols(); ++v)
      if (held_[static_cast<size_t>(v)]) gradient_n.col(v).setZero();
    ++result.evaluations;
    return energy_j;
  }
  void note(double energy_j, const Eigen::Matrix3Xd& gradient_n,
            const Eigen::Matrix3Xd& position_m) {
    result.energy_j = energy_j;
    result.gradient_n = gradient_n.norm();
    if (rule_.on_step) rule_.on_step({result.iterations, energy_j, result.gradient_n, position_m});
  }

  MinimiseResult result;

 private:
  BlockEnergy& energy_;
  const std::vector<bool>& held_;
  const SettleRule& rule_;
};

/// A line search from a place along a direction that goes down.
class Line {
 public:
  Line(Watched& energy, const Eigen::Matrix3Xd& from_m, const Eigen::Matrix3Xd& direction,
       double energy_j, double slope_n)
      : energy_(energy),
        from_m_(from_m),
        direction_(direction),
        energy_j_(energy_j),
        slope_n_(slope_n) {}

  /// Returns a step up to `longest`, 0 where none lowers the energy; the place and gradient there
  /// are left in `position_m` and `gradient_n`.
  double search(double first, double longest, Eigen::Matrix3Xd& position_m,
                Eigen::Matrix3Xd& gradient_n) {
    constexpr double kEnough = 0.1;
    constexpr int kMostTrials = 20;
    double low = 0, low_slope = slope_n_, high = 0, high_slope = 0;
    double step = std::min(first, longest), good = 0;
    for (int n = 0; n < kMostTrials; ++n) {
      position_m = from_m_ + step * direction_;
      const double reached_j = energy_.energy_and_gradient(position_m, gradient_n);
      const double slope = gradient_n.cwiseProduct(direction_).sum();
      const bool lower = reached_j <= energy_j_ + 1e-4 * step * slope_n_;
      if (lower) {
        good = step;
        best_j = reached_j;
        if (std::abs(slope) <= kEnough * -slope_n_ || (slope < 0 && step >= longest)) return step;
      }
      if (lower && slope < 0) {
        low = step;
        low_slope = slope;
      } else {
        high = step;
        high_slope = slope;
      }
      step = next(low, low_slope, high, high_slope, longest);
    }
    if (good > 0) {
      position_m = from_m_ + good * direction_;
      best_j = energy_.energy_and_gradient(position_m, gradient_n);
    }
    return good;
  }

  double best_j = 0;

 private:
  /// Returns the secant's zero, kept away from the bounds; three times as far without an upper one.
  static double next(double low, double low_slope, double high, double high_slope, double longest) {
    if (high == 0) return std::min(3 * low, longest);
    const double middle = 0.5 * (low + high);
    if (!(high_slope > 0)) return middle;
    const double secant = low - low_slope * (high - low) / (high_slope - low_slope);
    return std::clamp(secant, low + 0.1 * (high - low), high - 0.1 * (high - low));
  }

  Watched& energy_;
  const Eigen::Matrix3Xd& from_m_;
  const Eigen::Matrix3Xd& direction_;
  double energy_j_, slope_n_;
};

}  // namespace

MinimiseResult settle_by_conjugate_gradients(BlockEnergy& energy, const std::vector<bool>& held,
                                             const SettleRule& rule, Eigen::Matrix3Xd& position_m) {
  Watched watched(energy, held, rule);
  Eigen::Matrix3Xd gradient(3, position_m.cols()), new_gradient = gradient;
  energy.open_way(position_m, Eigen::Matrix3Xd::Zero(3, position_m.cols()));
  watched.note(watched.energy_and_gradient(position_m, gradient), gradient, position_m);
  Eigen::Matrix3Xd direction = -gradient;
  double first_m = 1e-3;  // that the fastest point goes in the first trial of a search
  while (!is_over(rule.stop, watched.result)) {
    double slope = direction.cwiseProduct(gradient).sum();
    if (!(slope < 0)) {
      direction = -gradient;
      slope = -gradient.squaredNorm();
    }
    const double fastest = direction.colwise().norm().maxCoeff();
    const double longest_m = std::min(rule.longest_step_m, 0.1);
    const double open = energy.open_way(position_m, longest_m / fastest * direction);
    Line line(watched, position_m, direction, watched.result.energy_j, slope);
    Eigen::Matrix3Xd reached_m(3, position_m.cols());
    const double step =
        line.search(first_m / fastest, open * longest_m / fastest, reached_m, new_gradient);
    if (step == 0) {
      if (direction == -gradient) {
        watched.result.reason = MinimiseReason::stalled;
        break;
      }
      direction = -gradient;
      continue;
    }
    first_m = step * fastest;
    const double conjugate =
        new_gradient.cwiseProduct(new_gradient - gradient).sum() / gradient.squaredNorm();
    direction = std::max(conjugate, 0.0) * direction - new_gradient;
    std::swap(gradient, new_gradient);
    position_m = reached_m;
    ++watched.result.iterations;
    watched.note(line.best_j, gradient, position_m);
  }
  return watched.result;
}

MinimiseResult settle_by_time_steps(BlockEnergy& energy, const std::vector<bool>& held,
                                    const SettleRule& rule, double step_s, double calm_s,
                                    Eigen::Matrix3Xd& position_m) {
  Watched watched(energy, held, rule);
  StepMatrix matrix(energy, held);
  Eigen::Matrix3Xd gradient(3, position_m.cols()), new_gradient = gradient;
  Eigen::Matrix3Xd velocity_m_per_s = Eigen::Matrix3Xd::Zero(3, position_m.cols());
  energy.open_way(position_m, velocity_m_per_s);
  watched.note(watched.energy_and_gradient(position_m, gradient), gradient, position_m);
  const auto kinetic_j = [&](const Eigen::Matrix3Xd& velocity) {
    return 0.5 * velocity.colwise().squaredNorm().dot(energy.mass_kg());
  };
  double h_s = step_s;
  while (!is_over(rule.stop, watched.result)) {
    if (energy.update_pairs(position_m)) matrix.take_pairs();
    matrix.linearise(position_m, Curvature::clamped);
    if (!matrix.factorise((1 / h_s + 1 / calm_s) / h_s)) {
      watched.result.reason = MinimiseReason::stalled;
      break;
    }
    // (M / h^2 + M / (h calm) + H) d = M v / h - gradient.
    const Eigen::Matrix3Xd move_m =
        matrix.solve(gradient - velocity_m_per_s * (energy.mass_kg() / h_s).asDiagonal());
    const double longest_m = move_m.colwise().norm().maxCoeff();
    double share = std::min(1.0, rule.longest_step_m / longest_m);
    share *= energy.open_way(position_m, share * move_m);
    const Eigen::Matrix3Xd reached_m = position_m + share * move_m;
    const double reached_j = watched.energy_and_gradient(reached_m, new_gradient);
    const Eigen::Matrix3Xd reached_velocity = share / h_s * move_m;
    constexpr double kShortest = 1e-6;
    const bool falls = reached_j + kinetic_j(reached_velocity) <=
                       watched.result.energy_j + kinetic_j(velocity_m_per_s);
    if (!falls && h_s > kShortest * step_s) {
      h_s *= 0.5;
      velocity_m_per_s *= 0.5;
      energy.open_way(position_m, Eigen::Matrix3Xd::Zero(3, position_m.cols()));
      continue;
    }
    h_s = std::min(step_s, 1.5 * h_s);
    velocity_m_per_s = reached_velocity;
    position_m = reached_m;
    std::swap(gradient, new_gradient);
    ++watched.result.iterations;
    watched.note(reached_j, gradient, position_m);
  }
  return watched.result;
}

}  // namespace clothfit
