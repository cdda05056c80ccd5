// Checks which spring is blamed for a diverging run. Not checked here: when a step is stable
// (stability_test.cpp) and how a run reports its end (simulate_test.cpp).

#include "model/integrate/divergence.h"

#include <gtest/gtest.h>

#include <cmath>

#include "model/cloth/stability.h"
#include "tests/model/random_cloth.h"

namespace clothfit {
namespace {

/// A hung cloth of which one vertex is light. Its springs alone are too stiff for a step that all
/// others could take.
struct LightVertex {
  Cloth cloth = square_cloth(9);
  ParameterSet set;
  int vertex = 0;

  LightVertex(int i, int j, double share) : vertex(cloth.mesh.vertex(i, j)) {
    cloth.mass_kg[vertex] *= share;
    cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, cloth.mesh.width_m, 0)};
    set.springs = spring_parameters(cotton(), cloth.mesh);
    set.springs.damping_ns_per_m.fill(0);
    set.start_position_m = hung_flat(cloth.mesh);
    Uniform uniform(3);
    set.start_position_m += uniform.vectors(cloth.mesh.vertex_count(), 1e-5);
  }

  Schedule schedule(double time_step_s) const {
    Schedule result{.frame_time_s = {}, .time_step_s = time_step_s};
    for (int f = 0; f <= 30; ++f) result.frame_time_s.push_back(f / 60.0);
    return result;
  }
};

TEST(Divergence, IsNothingWhereTheStepIsStable) {
  const LightVertex light(4, 4, 1);

  EXPECT_FALSE(find_divergence(light.cloth, light.set,
                               light.schedule(0.6 * stable_time_step_s(light.cloth, light.set))));
}

TEST(Divergence, NamesASpringOfTheVertexThatCannotFollow) {
  const LightVertex even(4, 4, 1);
  for (const auto& [i, j] : {std::pair(5, 2), {2, 6}, {8, 8}}) {
    SCOPED_TRACE(testing::Message() << "light vertex " << i << ", " << j);
    const LightVertex light(i, j, 0.05);
    // The step is stable for all but the light vertex, whose frequency is the root of 20 times as
    // high.
    const double h = 0.6 * stable_time_step_s(even.cloth, even.set);
    ASSERT_GT(h, 1.5 * stable_time_step_s(light.cloth, light.set));

    const auto divergence = find_divergence(light.cloth, light.set, light.schedule(h));

    ASSERT_TRUE(divergence);
    ASSERT_TRUE(divergence->spring);
    const Spring& spring = divergence->spring->spring;
    EXPECT_TRUE(spring.a == light.vertex || spring.b == light.vertex)
        << spring.a << " - " << spring.b;
    EXPECT_GT(divergence->spring->length_m,
              kLengthBeyondReason * divergence->spring->natural_length_m);
  }
}

TEST(Divergence, IsFoundAtItsStepAndTime) {
  const LightVertex light(5, 2, 0.05);
  const double h = 2 * stable_time_step_s(light.cloth, light.set);
  const Schedule schedule = light.schedule(h);

  const auto divergence = find_divergence(light.cloth, light.set, schedule);
  ASSERT_TRUE(divergence);

  // The second route has every step of the run as a frame of its own. No step is longer than that,
  // and times rise evenly within each frame interval.
  Schedule all{.frame_time_s = {0}, .time_step_s = h};
  for (int frame = 1; frame <= 30; ++frame) {
    const double from_s = schedule.frame_time_s[static_cast<size_t>(frame) - 1];
    const double step_s =
        (schedule.frame_time_s[static_cast<size_t>(frame)] - from_s) / schedule.substeps(frame);
    for (int n = 1; n <= schedule.substeps(frame); ++n)
      all.frame_time_s.push_back(from_s + n * step_s);
  }
  const SimulateResult steps = simulate(light.cloth, {&light.set, 1}, all).front();
  const auto& blamed = *divergence->spring;
  const auto length_after = [&](int step) {
    const Eigen::Matrix3Xd& p = steps.position_m[static_cast<size_t>(step)];
    return (p.col(blamed.spring.b) - p.col(blamed.spring.a)).norm();
  };
  EXPECT_NEAR(all.frame_time_s[static_cast<size_t>(divergence->step)], divergence->time_s, 1e-12);
  // The instability multiplies rounding too: the steps before frames' ends are rounded differently.
  EXPECT_NEAR(length_after(divergence->step), blamed.length_m, 1e-6 * blamed.length_m);
  EXPECT_GT(length_after(divergence->step), kLengthBeyondReason * blamed.natural_length_m);
  EXPECT_LT(length_after(divergence->step - 1), kLengthBeyondReason * blamed.natural_length_m);
  EXPECT_GE(divergence->frame, 1);
  EXPECT_LE(divergence->time_s, schedule.frame_time_s[static_cast<size_t>(divergence->frame)]);
  EXPECT_GT(divergence->time_s, schedule.frame_time_s[static_cast<size_t>(divergence->frame) - 1]);
}

TEST(Divergence, IsNamedEvenWhereOneStepBlowsEverythingUp) {
  const LightVertex light(5, 2, 0.05);
  const double h = 200 * stable_time_step_s(light.cloth, light.set);

  const auto divergence = find_divergence(light.cloth, light.set, light.schedule(h));

  ASSERT_TRUE(divergence);
  ASSERT_TRUE(divergence->spring);
  EXPECT_TRUE(std::isfinite(divergence->spring->length_m));
}

TEST(Divergence, TellsAFlightFromABrokenSpring) {
  LightVertex light(4, 4, 1);
  light.cloth.held.clear();
  light.set.gravity_m_per_s2 = {0, 0, -1e4};  // it falls out of the scene, whole

  const auto divergence = find_divergence(
      light.cloth, light.set, light.schedule(0.6 * stable_time_step_s(light.cloth, light.set)));

  ASSERT_TRUE(divergence);
  EXPECT_FALSE(divergence->spring);
  EXPECT_GE(divergence->vertex, 0);
}

TEST(Divergence, BlamesTheStartForWhatIsNotANumberThere) {
  LightVertex light(4, 4, 1);
  light.set.start_position_m(0, 7) = NAN;

  const auto divergence = find_divergence(light.cloth, light.set, light.schedule(1e-4));

  ASSERT_TRUE(divergence);
  EXPECT_EQ(divergence->step, 0);
  EXPECT_FALSE(divergence->spring);
}

TEST(Divergence, CallsSpringsByTheirFamily) {
  EXPECT_STREQ(spring_family(structural_t), "structural");
  EXPECT_STREQ(spring_family(structural_s), "structural");
  EXPECT_STREQ(spring_family(shear_up), "shear");
  EXPECT_STREQ(spring_family(flexion_s), "flexion");
}

}  // namespace
}  // namespace clothfit
