#include "model/cloth/wording.h"
#include "model/effects/support_law.h"

/// Moves the held points once, all alike, beside their known motion: a clip that slips and holds
/// again. With t the recording's time (s),
///
///   shift(t) = by S((t - from) / lasts)
///   S(u) = 3 u^2 - 2 u^3, u held between 0 and 1
///
/// Parameters: by_x, by_y, by_z (m), neutral at 0; from and lasts (s), which matter only where a
/// point moves; point (index), the number of the held point that moves, or 0 for all. What lasts
/// less than 1 ms is taken to last that long. Ours: Hermite's cubic, with no velocity at its ends.
namespace clothfit::support_move {
namespace {

struct Law {
  static constexpr int kParameters = 6, kMemory = 0;
  static constexpr bool kAtRest = false, kOfTwo = false;

  template <class Real>
  static Vector3<Real> shift(const SupportSight<Real>& at, const std::array<Real, 6>& p,
                             std::array<Real, 0>&) {
    const Real none(0.0), one(1.0), shortest_s(1e-3);
    const Real lasts_s = select(p[4] > shortest_s, p[4], shortest_s);
    const Real since = (Real(at.end_time_s) - p[3]) / lasts_s;
    const Real begun = select(since > none, since, none);
    const Real u = select(begun < one, begun, one);
    return u * u * (Real(3.0) - Real(2.0) * u) * at.is_asked(p[5]) *
           Vector3<Real>{p[0], p[1], p[2]};
  }

  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

std::string in_words(const FittedEffect& found) {
  const Eigen::Vector3d by_m = found.vector("by");
  if (by_m.isZero(0)) return {};
  const double from_s = found.value("from");
  return millimetres(by_m.norm()) + " " + at_held_point(found, found.value("point")) + " between " +
         rounded(from_s) + " and " + rounded(from_s + found.value("lasts")) + " s, towards " +
         unit_vector(by_m);
}

}  // namespace

EffectDescription describe() {
  EffectDescription effect{
      .name = "support_move",
      .summary = "held points move once, shift = by S((t - from) / lasts)",
      .parameters = vector_parameter(
          {.name = "by", .unit = "m", .neutral = 0, .lower = -0.2, .upper = 0.2, .typical = 0.002}),
      .test = EffectTest::profiled,
      .modes = alike_and_single(
          {.name = "",
           .amplitudes = {"by_x", "by_y", "by_z"},
           .shapes = {{.parameter = "from", .values = {0, 0.25, 0.5, 0.75}, .of_duration = true},
                      {.parameter = "lasts", .values = {0.15, 0.5}, .of_duration = true}}}),
      .remedy = kDeclareMotion,
      .in_words = in_words};
  effect.parameters.push_back(
      {.name = "from", .unit = "s", .neutral = 0, .lower = 0, .upper = 3600, .typical = 0.02});
  effect.parameters.push_back(
      {.name = "lasts", .unit = "s", .neutral = 0.5, .lower = 0.01, .upper = 3600, .typical = 0.1});
  effect.parameters.push_back(point_parameter());
  return effect;
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SupportLawEffect<Law>>();
}

}  // namespace clothfit::support_move
