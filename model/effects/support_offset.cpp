#include "model/cloth/wording.h"
#include "model/effects/support_law.h"

/// Holds points that follow a motion beside the places it gives, all by the same constant:
///
///   shift = offset
///
/// at every time, the rest before the start included. A tracker may see a corner of the cloth
/// beside its place in the clamp. A tool's path may lead elsewhere on the tool than to the clamp.
/// Points that rest are held where the cloth started, and are not shifted. Parameters: offset_x,
/// offset_y, offset_z (m), neutral at 0; point (index), the number of the held point that is
/// shifted, or 0 for all. Ours.
namespace clothfit::support_offset {
namespace {
struct Law {
  static constexpr int kParameters = 4, kMemory = 0;
  static constexpr bool kAtRest = true, kOfTwo = false;

  template <class Real>
  static Vector3<Real> shift(const SupportSight<Real>& at, const std::array<Real, 4>& p,
                             std::array<Real, 0>&) {
    if (!at.driven) return {Real(0.0), Real(0.0), Real(0.0)};
    return at.is_asked(p[3]) * Vector3<Real>{p[0], p[1], p[2]};
  }

  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

std::string in_words(const FittedEffect& found) {
  const Eigen::Vector3d offset_m = found.vector("offset");
  if (offset_m.isZero(0)) return {};
  return millimetres(offset_m.norm()) + " towards " + unit_vector(offset_m) + ", " +
         at_held_point(found, found.value("point"));
}

}  // namespace

EffectDescription describe() {
  return {.name = "support_offset",
          .summary = "driven held points beside where they are said to be, shift = offset",
          .parameters = vector_at_point({.name = "offset",
                                         .unit = "m",
                                         .neutral = 0,
                                         .lower = -0.05,
                                         .upper = 0.05,
                                         .typical = 0.002}),
          .test = EffectTest::profiled,
          .modes = alike_and_single(
              {.name = "", .amplitudes = {"offset_x", "offset_y", "offset_z"}, .shapes = {}}),
          .driven_points = {1, std::numeric_limits<int>::max()},
          .remedy = "track or survey the cloth where it is held, not beside it",
          .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SupportLawEffect<Law>>();
}

}  // namespace clothfit::support_offset
