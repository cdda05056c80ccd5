#include <cmath>

#include "model/cloth/wording.h"
#include "model/effects/support_law.h"

/// Holds two held points with motions of their own by one rigid body, which keeps their distance.
/// The known motions let the distance wander. With D from one to the other there, and L their
/// distance over the flat cloth,
///
///   shift = -+ share / 2 [(1 + slack) L D / |D| - D],
///
/// the body's middle and direction being those of the two. Tracks of a cloth's corners jump by more
/// than those of its inside, and a cloth whose corners come closer bulges. Parameters: share (1),
/// neutral at 0, and 1 for a rigid body; slack (1), which matters only where the share does, below
/// 0 where the cloth is held less than taut. The effect acts only with exactly two driven points.
/// Ours.
namespace clothfit::rigid_support {
namespace {
struct Law {
  static constexpr int kParameters = 2, kMemory = 0;
  static constexpr bool kAtRest = true, kOfTwo = true;

  template <class Real>
  static Vector3<Real> shift(const SupportSight<Real>& at, const std::array<Real, 2>& p,
                             std::array<Real, 0>&) {
    const Eigen::Vector3d& d = at.to_partner_m;
    const double distance_m = d.norm();
    if (distance_m == 0) return {Real(0.0), Real(0.0), Real(0.0)};
    const Real longer = (Real(1.0) + p[1]) * Real(at.partner_over_cloth_m / distance_m) - Real(1.0);
    const Real part = Real(-0.5) * p[0] * longer;
    return {part * Real(d.x()), part * Real(d.y()), part * Real(d.z())};
  }

  static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&) {
    return {};
  }
};

/// The distance goes the share of the way to (1 + slack) times that of the two points in the flat
/// cloth.
std::string in_words(const FittedEffect& found) {
  std::vector<Eigen::Vector2d> driven_m;
  for (const FittedEffect::HeldPlace& place : found.held)
    if (place.driven) driven_m.push_back(place.at_m);
  const double share = found.value("share"), slack = found.value("slack");
  if (driven_m.size() != 2 || share == 0) return {};
  const double flat_m = (driven_m[1] - driven_m[0]).norm();
  const std::string beside = slack == 0 ? "as over the flat cloth"
                                        : millimetres(std::abs(slack) * flat_m) +
                                              (slack < 0 ? " less" : " more") +
                                              " than over the flat cloth";
  return "the two held points are drawn to " + millimetres((1 + slack) * flat_m) + " apart, " +
         beside + ", " + rounded(100 * share) + " % of the way";
}

}  // namespace

EffectDescription describe() {
  return {
      .name = "rigid_support",
      .summary = "two driven points at one distance, shift = -+ share/2 [(1 + slack) L D/|D| - D]",
      .parameters =
          {{.name = "share", .unit = "1", .neutral = 0, .lower = 0, .upper = 1.2, .typical = 0.1},
           {.name = "slack",
            .unit = "1",
            .neutral = 0,
            .lower = -0.15,
            .upper = 0.05,
            .typical = 0.01}},
      .test = EffectTest::profiled,
      .modes = {{.name = "",
                 .amplitudes = {"share"},
                 .shapes = {{.parameter = "slack", .values = {-0.08, -0.04, -0.02, 0}}}}},
      .driven_points = {2, 2},
      .remedy = "track the body that holds both points, and declare the paths that it gives",
      .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SupportLawEffect<Law>>();
}

}  // namespace clothfit::rigid_support
