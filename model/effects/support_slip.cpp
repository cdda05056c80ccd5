#include "model/cloth/wording.h"
#include "model/effects/support_law.h"

/// Lets the held points creep where the cloth pulls them, with the velocity
///
///   mobility max(|F| - threshold, 0) F / |F|
///
/// F (N) is the cloth's pull on a held point, the weight included, at the beginning of the step.
/// The creep of a point is remembered. Parameters: mobility (m/(N s)), neutral at 0; threshold (N),
/// the pull up to which the point holds, which matters only where mobility does; point (index), the
/// number of the held point that creeps, or 0 for all. Ours: dry friction in a clamp, then viscous.
///
/// Dashpots pull on a support that creeps. Mobility times a support's damping (N s/m) must
/// therefore stay below 1; the mobility's bounds ensure this for cloth.
namespace clothfit::support_slip {
namespace {
struct Law {
  static constexpr int kParameters = 3, kMemory = 3;
  static constexpr bool kAtRest = false, kOfTwo = false;

  template <class Real>
  static Vector3<Real> shift(const SupportSight<Real>& at, const std::array<Real, 3>& p,
                             std::array<Real, 3>& crept_m) {
    using std::sqrt;
    const Real square = dot(at.pull_n, at.pull_n);
    // Where the root's derivative is infinite it must not be taken.
    const auto some = square > Real(1e-30);
    const Real pull = sqrt(select(some, square, Real(1.0)));
    const Real excess = select(some, pull - p[1], Real(0.0));
    const Real speed = at.is_asked(p[2]) * p[0] * select(excess > Real(0.0), excess, Real(0.0));
    const Vector3<Real> creep = Real(at.time_step_s) * speed / pull * at.pull_n;
    crept_m = {crept_m[0] + creep.x, crept_m[1] + creep.y, crept_m[2] + creep.z};
    return {crept_m[0], crept_m[1], crept_m[2]};
  }

  /// A support that creeps eases the springs that pull it. Their pull falls at the rate mobility
  /// times stiffness.
  static EffectRates rates(const Cloth& cloth, const SpringParameters& springs,
                           const std::vector<double>& parameters) {
    if (cloth.held.empty()) return {};
    double stiffness_n_per_m = 0;  // of all springs that may meet at a vertex
    for (const double k : springs.stiffness_n_per_m) stiffness_n_per_m += 2 * k;
    return {.damping_per_s = parameters[0] * stiffness_n_per_m};
  }
};

/// Pulls are told by the mass (g) whose weight they are.
std::string in_words(const FittedEffect& found) {
  const double mobility = found.value("mobility"), gram_n = 1e-3 * found.gravity();
  if (!(mobility > 0 && gram_n > 0)) return {};
  return "holds a pull of up to " + rounded(found.value("threshold") / gram_n) + " g, creeps by " +
         millimetres(mobility * gram_n) + " a second for each gram beyond, " +
         at_held_point(found, found.value("point"));
}

}  // namespace

EffectDescription describe() {
  return {
      .name = "support_slip",
      .summary = "held points creep where the cloth pulls, at mobility max(|F| - threshold, 0)",
      .parameters = {{.name = "mobility",
                      .unit = "m/(N s)",
                      .neutral = 0,
                      .lower = 0,
                      .upper = 0.1,
                      .typical = 0.005},
                     {.name = "threshold",
                      .unit = "N",
                      .neutral = 0.1,
                      .lower = 0,
                      .upper = 10,
                      .typical = 0.02},
                     point_parameter()},
      .test = EffectTest::finite,
      .modes = alike_and_single({.name = "",
                                 .amplitudes = {"mobility"},
                                 .shapes = {{.parameter = "threshold", .values = {0, 0.05, 0.2}}}}),
      .remedy = kDeclareMotion,
      .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SupportLawEffect<Law>>();
}

}  // namespace clothfit::support_slip
