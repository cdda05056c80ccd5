#include "model/cloth/wording.h"
#include "model/effects/support_law.h"

/// Lets the held points drift, all alike, beside their known motion: shift(t) = velocity t, with t
/// the recording's time (s). Parameters: velocity_x, velocity_y, velocity_z (m/s), neutral at 0;
/// point (index), the number of the held point that drifts, or 0 for all. Ours.
namespace clothfit::support_drift {
namespace {
struct Law {
  static constexpr int kParameters = 4, kMemory = 0;
  static constexpr bool kAtRest = false, kOfTwo = false;

  template <class Real>
  static Vector3<Real> shift(const SupportSight<Real>& at, const std::array<Real, 4>& p,
                             std::array<Real, 0>&) {
    return Real(at.end_time_s) * at.is_asked(p[3]) * Vector3<Real>{p[0], p[1], p[2]};
  }

  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

std::string in_words(const FittedEffect& found) {
  const Eigen::Vector3d shift_m = found.end_s * found.vector("velocity");
  if (shift_m.isZero(0)) return {};
  return millimetres(shift_m.norm()) + " " + at_held_point(found, found.value("point")) +
         " by the end, towards " + unit_vector(shift_m);
}

}  // namespace

EffectDescription describe() {
  return {.name = "support_drift",
          .summary = "held points drift, shift = velocity t",
          .parameters = vector_at_point({.name = "velocity",
                                         .unit = "m/s",
                                         .neutral = 0,
                                         .lower = -0.2,
                                         .upper = 0.2,
                                         .typical = 0.002}),
          .test = EffectTest::profiled,
          .modes = alike_and_single(
              {.name = "", .amplitudes = {"velocity_x", "velocity_y", "velocity_z"}, .shapes = {}}),
          .remedy = kDeclareMotion,
          .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SupportLawEffect<Law>>();
}

}  // namespace clothfit::support_drift
