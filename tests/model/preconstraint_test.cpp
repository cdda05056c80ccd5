// Checks that flexion springs longer than twice the structural ones give a cloth planar rigidity
// [louchet1995, section 2.1]. Not checked here: the springs' forces (cloth_sweep_test.cpp).

#include <gtest/gtest.h>

#include <cmath>

#include "model/cloth/stability.h"
#include "model/effects/registry.h"
#include "model/fabric/louchet18.h"
#include "model/integrate/simulate.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

constexpr int kAlong = 11;  ///< vertices along the strip
constexpr double kSpacing_m = 0.02;
constexpr double kMass_kg = 4e-5;  ///< mass of a vertex: 0.1 kg/m^2
constexpr double kTension_n_per_m = 400;
constexpr double kFlexion_n_per_m = 20;
constexpr double kGravity_m_per_s2 = 0.02;  ///< sags the strip by about a hundredth of its length

/// A strip of three vertices across, clamped at its first two rows. Its flexion springs along it
/// are `share` longer than twice the spacing. It has no shear springs: each of its three chains
/// bends for itself, and all alike.
struct Strip {
  bool along_t;
  Cloth cloth;
  ParameterSet set;

  Strip(double share, bool runs_along_t)
      : along_t(runs_along_t),
        cloth(Cloth::of(runs_along_t ? Mesh{.columns = 3,
                                            .rows = kAlong,
                                            .width_m = 2 * kSpacing_m,
                                            .height_m = (kAlong - 1) * kSpacing_m}
                                     : Mesh{.columns = kAlong,
                                            .rows = 3,
                                            .width_m = (kAlong - 1) * kSpacing_m,
                                            .height_m = 2 * kSpacing_m},
                        Eigen::VectorXd::Constant(3 * kAlong, kMass_kg))) {
    Louchet18 springs;
    springs.natural_length_m = flat_lengths(cloth.mesh);
    springs.natural_length_m[along_t ? flexion_t : flexion_s] *= 1 + share;
    springs.stiffness_n_per_m = {kTension_n_per_m, kTension_n_per_m, 0, 0,
                                 kFlexion_n_per_m, kFlexion_n_per_m};
    set.springs = spring_parameters(springs);
    set.springs.damping_ns_per_m.fill(0.01);
    for (int n = 0; n < 2; ++n)
      for (int across = 0; across < 3; ++across)
        cloth.held.push_back({.weights = {{vertex(n, across), 1.0}}, .motion = {}});
    add_effect(cloth, "viscous_damping", "test");
    set.effects = {{4.0}};  // about as fast as the strip sways
    set.start_position_m = flat_positions(cloth.mesh);
  }

  int vertex(int n, int across) const {
    return along_t ? cloth.mesh.vertex(n, across) : cloth.mesh.vertex(across, n);
  }

  /// Returns the strip after `duration_s` under a weight across its plane.
  Eigen::Matrix3Xd after(double duration_s, double gravity_m_per_s2) const {
    ParameterSet loaded = set;
    loaded.gravity_m_per_s2 = {0, 0, -gravity_m_per_s2};
    const Schedule schedule{.frame_time_s = {0, duration_s},
                            .time_step_s = 0.6 * stable_time_step_s(cloth, set)};
    return simulate(cloth, {&loaded, 1}, schedule).front().position_m.back();
  }

  double sag_m(const Eigen::Matrix3Xd& position_m) const {
    return -position_m(2, vertex(kAlong - 1, 1));
  }
};

TEST(Preconstraint, GivesAStripTheBendingStiffnessOfTheTheory) {
  for (const bool along_t : {true, false}) {
    SCOPED_TRACE(along_t ? "along t" : "along s");
    const double share = 0.02;
    Strip strip(share, along_t);
    strip.set.start_position_m = strip.after(3, 0);  // the strip lengthens in its plane first
    const Eigen::Matrix3Xd settled = strip.set.start_position_m;
    const auto place_m = [&](int n) { return settled(along_t ? 1 : 0, strip.vertex(n, 1)); };
    ASSERT_LT(settled.row(2).norm(), 1e-12);

    const double sag_m = strip.sag_m(strip.after(12, kGravity_m_per_s2));

    // The strip is a chain of rigid links with a hinge at every inner vertex. Links p and q meet at
    // an angle there, and the flexion spring across them pushes with C. It is shorter by p q
    // angle^2 / (2 (p + q)), which makes it a hinge of stiffness C p q / (p + q). Statics do the
    // rest.
    double expected_m = 0, bending_n_m = 0;
    for (int hinge = 1; hinge < kAlong - 1; ++hinge) {
      const double p = place_m(hinge) - place_m(hinge - 1);
      const double q = place_m(hinge + 1) - place_m(hinge);
      const double push_n = kFlexion_n_per_m * (2 * kSpacing_m * (1 + share) - p - q);
      const double stiffness_n_m = push_n * p * q / (p + q);
      double moment_n_m = 0;
      for (int beyond = hinge + 1; beyond < kAlong; ++beyond)
        moment_n_m += kMass_kg * kGravity_m_per_s2 * (place_m(beyond) - place_m(hinge));
      expected_m += moment_n_m / stiffness_n_m * (place_m(kAlong - 1) - place_m(hinge));
      bending_n_m += stiffness_n_m / (kAlong - 2);
    }
    ASSERT_GT(sag_m, 1e-3);
    // Angles are small: the sag is two hundredths of the length, squared 4e-4. Swaying has died
    // down to exp(-2 * 12) of it.
    EXPECT_NEAR(sag_m, expected_m, 2e-3 * expected_m);

    // As a continuum it has B = k45 (l45 - 2 a) a / 2 (N m). Each structural spring holds two
    // flexion springs back and is stretched by them, which removes 4 k45 / k01 of their push again.
    const double theory_n_m = kFlexion_n_per_m * (2 * kSpacing_m * share) * kSpacing_m / 2;
    const double held_back = 1 + 4 * kFlexion_n_per_m / kTension_n_per_m;
    EXPECT_NEAR(bending_n_m, theory_n_m / held_back, 0.04 * theory_n_m);  // the ends, and a' > a
  }
}

TEST(Preconstraint, IsWhatHoldsAStripUp) {
  for (const bool along_t : {true, false}) {
    SCOPED_TRACE(along_t ? "along t" : "along s");
    const double with_m =
        Strip(0.02, along_t).sag_m(Strip(0.02, along_t).after(12, kGravity_m_per_s2));
    const double twice_m =
        Strip(0.04, along_t).sag_m(Strip(0.04, along_t).after(12, kGravity_m_per_s2));
    const double without_m =
        Strip(0, along_t).sag_m(Strip(0, along_t).after(12, kGravity_m_per_s2));

    EXPECT_GT(without_m, 10 * with_m);
    EXPECT_NEAR(twice_m, with_m / 2, 0.05 * with_m);
  }
}

}  // namespace
}  // namespace clothfit
