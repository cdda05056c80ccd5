// Checks that a time step allocates nothing: it is taken ten thousand times a second, by several
// threads. Calls of operator new are counted, which containers and aligned arrays use; this
// program's are replaced.

#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

#include "model/effects/registry.h"
#include "model/integrate/step.h"
#include "model/integrate/tangent_step.h"
#include "tests/data/replaced_new.h"
#include "tests/model/random_cloth.h"

namespace {

std::atomic<long> allocations{0};

void before_allocation() {
  ++allocations;
}

}  // namespace

namespace clothfit {
namespace {

/// A cloth with an effect of each kind.
struct Busy {
  Cloth cloth = square_cloth(7);
  ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh),
                   .start_position_m = flat_positions(cloth.mesh)};

  explicit Busy(StrainLimitMode mode) {
    cloth.held = {held_at(cloth.mesh, 0, 0), held_at(cloth.mesh, 0.31, 0.02)};
    cloth.strain_limit.mode = mode;
    for (const char* name : {"wind", "hysteresis", "added_air_mass", "support_drift"})
      add_effect(cloth, name, "test");
    set.springs.critical_elongation.fill(0.01);
    for (const EffectDescription& effect : cloth.effect_descriptions) {
      set.effects.emplace_back();
      for (const EffectParameter& p : effect.parameters)
        set.effects.back().push_back(p.neutral + p.typical);
    }
  }
};

template <class L>
long allocations_in_ten_steps(StrainLimitMode mode) {
  const Busy busy(mode);
  const Cloth& cloth = busy.cloth;
  const ParameterSet& set = busy.set;
  EulerStepper<L> stepper(cloth);
  const LaneParameters<L> parameters = lane_parameters<L>(cloth, {&set, 1});
  LaneState<L> state = LaneState<L>::of(cloth);
  for (int l = 0; l < L::kCount; ++l) state.position_m.set_lane(l, set.start_position_m);
  const LaneVectors<L> target = stepper.held().locate(state.position_m);
  stepper.step(parameters, target, 0, 1e-4, state);

  const long before = allocations;
  for (int n = 1; n <= 10; ++n) stepper.step(parameters, target, n * 1e-4, 1e-4, state);
  return allocations - before;
}

long allocations_in_ten_steps_with_tangents() {
  const Busy busy(StrainLimitMode::off);
  TangentStepper<> stepper(busy.cloth);
  const auto parameters = TangentParameters<>::of(busy.cloth, busy.set, {});
  auto state = TangentState<>::of(busy.cloth, busy.set, {});
  const TangentVectors<> target = stepper.locate(state);
  // Effects list the blocks of their derivatives that are not zero. The lists have room for all
  // once the cloth moves.
  for (int n = 0; n < 10; ++n) stepper.step(parameters, target, n * 1e-4, 1e-4, state);

  const long before = allocations;
  for (int n = 10; n < 20; ++n) stepper.step(parameters, target, n * 1e-4, 1e-4, state);
  return allocations - before;
}

TEST(Step, AllocatesNothingWithTangents) {
  EXPECT_EQ(allocations_in_ten_steps_with_tangents(), 0);
}

TEST(Step, AllocatesNothing) {
  for (const StrainLimitMode mode : {StrainLimitMode::off, StrainLimitMode::positions,
                                     StrainLimitMode::rates_first, StrainLimitMode::consistent}) {
    SCOPED_TRACE(static_cast<int>(mode));
    EXPECT_EQ(allocations_in_ten_steps<ExactLanes>(mode), 0);
    EXPECT_EQ(allocations_in_ten_steps<FastLanes>(mode), 0);
    EXPECT_EQ(allocations_in_ten_steps<SingleLane>(mode), 0);
  }
}

TEST(Step, CountsAllocationsThatThereAre) {
  const long before = allocations;
  const auto held = std::make_unique<Cloth>();
  EXPECT_GT(allocations - before, 0);
}

}  // namespace
}  // namespace clothfit
