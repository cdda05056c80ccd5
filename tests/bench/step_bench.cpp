// Times the hot loop: one thread, all six spring types, kLanes simulations side by side.
//
// The counter `spring_steps` is springs x lanes x steps per second. The limit is arithmetic: a
// spring-step takes 43 additions and multiplications (17 of them for the inverse length) and its
// share of a vertex 9 more, 52 in all, none fused. A core with two AVX-512 units does 16 a cycle at
// best: 920 million spring-steps a second at 3 GHz. A vertex and lane has 48 bytes of position and
// velocity, read and written once per step, 16 per spring. A 17 x 17 mesh of 8 lanes has 111 kB,
// which live in the second-level cache.
//
// Nothing here is asserted: timings belong to a machine and its load.

#include <benchmark/benchmark.h>

#include "model/effects/registry.h"
#include "model/integrate/step.h"
#include "tests/bench/swinging_cloth.h"

namespace clothfit {
namespace {

/// A cloth with other springs in every lane.
struct LaneCloth {
  Cloth cloth;
  LaneParameters<> parameters;
  LaneState<> state;

  explicit LaneCloth(int vertices_per_side)
      : cloth(swinging_cloth(vertices_per_side)), state(LaneState<>::of(cloth)) {
    const std::vector<ParameterSet> sets = cotton_sets(cloth, kLanes);
    parameters = lane_parameters<ExactLanes>(cloth, sets);
    for (int l = 0; l < kLanes; ++l)
      state.position_m.set_lane(l, sets[static_cast<size_t>(l)].start_position_m);
  }

  void count(benchmark::State& run) const {
    const auto per_step = static_cast<double>(cloth.spring_count()) * kLanes;
    run.counters["spring_steps"] = benchmark::Counter(
        per_step * static_cast<double>(run.iterations()), benchmark::Counter::kIsRate);
  }
};

void add_spring_forces(benchmark::State& run) {
  const LaneCloth lanes(static_cast<int>(run.range(0)));
  ClothSweep<> sweep(lanes.cloth.mesh);
  LaneVectors<> force_n = LaneVectors<>::zero(lanes.cloth.mesh.vertex_count());
  for ([[maybe_unused]] const auto _ : run) {
    sweep.add_spring_forces(lanes.parameters.springs, lanes.state.position_m,
                            lanes.state.velocity_m_per_s, force_n);
    benchmark::ClobberMemory();
  }
  lanes.count(run);
}
BENCHMARK(add_spring_forces)->Arg(9)->Arg(17)->Arg(33);

void step(benchmark::State& run) {
  LaneCloth lanes(static_cast<int>(run.range(0)));
  EulerStepper<> stepper(lanes.cloth);
  const LaneVectors<> target = stepper.held().locate(lanes.state.position_m);
  for ([[maybe_unused]] const auto _ : run) {
    stepper.step(lanes.parameters, target, 0, 1e-4, lanes.state);
    benchmark::ClobberMemory();
  }
  lanes.count(run);
}
BENCHMARK(step)->Arg(9)->Arg(17)->Arg(33)->Arg(65)->Arg(129);

void step_with_viscous_damping(benchmark::State& run) {
  LaneCloth lanes(static_cast<int>(run.range(0)));
  add_effect(lanes.cloth, "viscous_damping", "benchmark");
  lanes.parameters.effects = {{LaneValue<>::Constant(0.1)}};
  EulerStepper<> stepper(lanes.cloth);
  const LaneVectors<> target = stepper.held().locate(lanes.state.position_m);
  for ([[maybe_unused]] const auto _ : run) {
    stepper.step(lanes.parameters, target, 0, 1e-4, lanes.state);
    benchmark::ClobberMemory();
  }
  lanes.count(run);
}
BENCHMARK(step_with_viscous_damping)->Arg(17);

/// Times a cloth that hangs and swings with some of its springs at their limit; `at_limit` is their
/// share.
void step_with_strain_limit(benchmark::State& run) {
  LaneCloth lanes(17);
  lanes.cloth.strain_limit.mode = static_cast<StrainLimitMode>(run.range(0));
  for (int l = 0; l < kLanes; ++l) {
    SpringParameters springs = cotton_sets(lanes.cloth, kLanes)[static_cast<size_t>(l)].springs;
    for (double& k : springs.stiffness_n_per_m) k /= 4;
    springs.critical_elongation.fill(0.05);
    set_lane(l, springs, lanes.cloth.strain_limit, lanes.parameters);
  }
  EulerStepper<> stepper(lanes.cloth);
  const LaneVectors<> target = stepper.held().locate(lanes.state.position_m);
  double too_long = 0;
  for ([[maybe_unused]] const auto _ : run) {
    stepper.step(lanes.parameters, target, 0, 2e-4, lanes.state);
    too_long += stepper.limit_outcome().too_long.mean();
  }
  lanes.count(run);
  run.counters["at_limit"] = too_long / static_cast<double>(run.iterations()) /
                             static_cast<double>(lanes.cloth.spring_count());
}
BENCHMARK(step_with_strain_limit)
    ->Arg(static_cast<int>(StrainLimitMode::off))
    ->Arg(static_cast<int>(StrainLimitMode::positions))
    ->Arg(static_cast<int>(StrainLimitMode::consistent))
    ->ArgName("mode");

}  // namespace
}  // namespace clothfit
