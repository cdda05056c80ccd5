#include <algorithm>
#include <string>

#include "model/cloth/wording.h"
#include "model/effects/support_law.h"

/// Moves the held points along a smooth free path, all alike, beside their known motion. With T =
/// until - from, and t the recording's time (s),
///
///   shift(t) = sum over k = 1 .. 4 of (shift_k - shift_(k-1)) S(4 (t - from) / T - (k - 1))
///   S(u) = 3 u^2 - 2 u^3, u held between 0 and 1
///
/// with shift_0 nothing. It is nothing up to `from`, shift_k at the k-th quarter of T, and shift_4
/// from `until` on. Between them it leads from one to the next without turning back, at a velocity
/// that has no jumps and is nothing at each. Parameters: shift_1_x to shift_4_z (m), neutral at 0;
/// from and until (s), which matter only where a shift does; point (index), the number of the held
/// point that moves, or 0 for all. An `until` less than 1 ms after `from` is taken as that. Ours.
namespace clothfit::support_path {
namespace {

constexpr int kKnots = 4;
enum Parameter { from = 3 * kKnots, until, point, kCount };

struct Law {
  static constexpr int kParameters = kCount, kMemory = 0;
  static constexpr bool kAtRest = false, kOfTwo = false;

  template <class Real>
  static Vector3<Real> shift(const SupportSight<Real>& at, const std::array<Real, kCount>& p,
                             std::array<Real, 0>&) {
    const Real none(0.0), one(1.0), shortest_s(1e-3);
    const Real known_s = p[until] - p[from];
    const Real duration_s = select(known_s > shortest_s, known_s, shortest_s);
    const Real knots = Real(kKnots) * (Real(at.end_time_s) - p[from]) / duration_s;
    Vector3<Real> sum{none, none, none}, before = sum;
    for (int k = 0; k < kKnots; ++k) {
      const auto first = static_cast<size_t>(3 * k);
      const Vector3<Real> knot{p[first], p[first + 1], p[first + 2]};
      const Real since = knots - Real(k);
      const Real begun = select(since > none, since, none);
      const Real u = select(begun < one, begun, one);
      sum = sum + u * u * (Real(3.0) - Real(2.0) * u) * (knot - before);
      before = knot;
    }
    return at.is_asked(p[point]) * sum;
  }

  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

/// Tells how far the points are at the last frame, and at most. Between knots they go straight, so
/// that they are furthest at a knot or at the end.
std::string in_words(const FittedEffect& found) {
  std::array<double, kCount> p;
  for (int k = 0; k < kKnots; ++k) {
    const Eigen::Vector3d knot_m = found.vector("shift_" + std::to_string(k + 1));
    std::ranges::copy(knot_m, p.begin() + 3 * k);
  }
  p[from] = found.value("from");
  p[until] = found.value("until");
  p[point] = 0;  // as at any point that moves
  const auto shift_m = [&](double time_s) {
    std::array<double, 0> nothing;
    const Vector3<double> shift = Law::shift<double>({.end_time_s = time_s}, p, nothing);
    return Eigen::Vector3d(shift.x, shift.y, shift.z);
  };
  const Eigen::Vector3d end_m = shift_m(found.end_s);
  double most_m = end_m.norm();
  for (int k = 1; k <= kKnots; ++k) {
    const double time_s = p[from] + k * (p[until] - p[from]) / kKnots;
    if (time_s < found.end_s) most_m = std::max(most_m, shift_m(time_s).norm());
  }
  if (most_m == 0) return {};
  const std::string at = at_held_point(found, found.value("point"));
  return millimetres(end_m.norm()) + " " + at + " by the end, " + millimetres(most_m) + " at most";
}

}  // namespace

EffectDescription describe() {
  EffectDescription effect{
      .name = "support_path",
      .summary = "held points along a smooth path, through shift_k at from + k/4 (until - from)",
      .parameters = {},
      .test = EffectTest::profiled,
      .remedy = kDeclareMotion,
      .in_words = in_words};
  EffectMode alike{.name = "",
                   .amplitudes = {},
                   .shapes = {{.parameter = "until", .values = {1}, .of_duration = true}}};
  for (int k = 1; k <= kKnots; ++k)
    for (EffectParameter& one : vector_parameter({.name = "shift_" + std::to_string(k),
                                .unit = "m",
                                .neutral = 0,
                                .lower = -0.2,
                                .upper = 0.2,
                                .typical = 0.002})) {
      alike.amplitudes.push_back(one.name);
      effect.parameters.push_back(std::move(one));
    }
  effect.parameters.push_back(
      {.name = "from", .unit = "s", .neutral = 0, .lower = 0, .upper = 3600, .typical = 0.02});
  effect.parameters.push_back(
      {.name = "until", .unit = "s", .neutral = 1, .lower = 0.2, .upper = 3600, .typical = 0.1});
  effect.parameters.push_back(point_parameter());
  effect.modes = alike_and_single(std::move(alike));
  return effect;
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SupportLawEffect<Law>>();
}

}  // namespace clothfit::support_path
