// How fast the hot loop is: one thread, all six spring types, kLanes simulations side by side.
//
// The counter `spring_steps` is springs x lanes x steps per second. The limit is the divider: each
// spring-step takes one square root and one division of doubles, both of which go through the one
// unit that a core has for them. Intel's cores from Skylake on take about 12 and 8 cycles for four
// doubles with AVX2 and twice that for eight with AVX-512 (uops.info), so 5 cycles for one lane's
// spring-step: 420 million a second at 2.1 GHz, on one core. The rest of the arithmetic and the
// memory traffic run beside it at best: a 17 x 17 mesh of 8 lanes has 170 kB of positions,
// velocities and forces, which live in the second-level cache.
//
// Nothing here is asserted: timings belong to a machine and its load.

#include <benchmark/benchmark.h>

#include "model/step.h"
#include "tests/bench/swinging_cloth.h"

namespace clothfit {
namespace {

/// A cloth with other springs in every lane.
struct LaneCloth {
  Cloth cloth;
  LaneParameters parameters;
  LaneState state;
  LaneVectors force_n;

  explicit LaneCloth(int vertices_per_side)
      : cloth(swinging_cloth(vertices_per_side)),
        state{LaneVectors::zero(cloth.mesh.vertex_count()),
              LaneVectors::zero(cloth.mesh.vertex_count())},
        force_n(LaneVectors::zero(cloth.mesh.vertex_count())) {
    const std::vector<ParameterSet> sets = cotton_sets(cloth, kLanes);
    for (int l = 0; l < kLanes; ++l) {
      const ParameterSet& set = sets[static_cast<size_t>(l)];
      for (size_t type = 0; type < kSpringTypes; ++type) {
        parameters.springs.natural_length_m[type][l] = set.springs.natural_length_m[type];
        parameters.springs.stiffness_n_per_m[type][l] = set.springs.stiffness_n_per_m[type];
        parameters.springs.damping_ns_per_m[type][l] = set.springs.damping_ns_per_m[type];
      }
      parameters.gravity_x[l] = set.gravity_m_per_s2.x();
      parameters.gravity_y[l] = set.gravity_m_per_s2.y();
      parameters.gravity_z[l] = set.gravity_m_per_s2.z();
      state.position_m.set_lane(l, set.start_position_m);
    }
  }

  void count(benchmark::State& run) const {
    const auto per_step = static_cast<double>(spring_count(cloth)) * kLanes;
    run.counters["spring_steps"] = benchmark::Counter(
        per_step * static_cast<double>(run.iterations()), benchmark::Counter::kIsRate);
  }
};

void add_spring_forces(benchmark::State& run) {
  LaneCloth lanes(static_cast<int>(run.range(0)));
  for ([[maybe_unused]] const auto _ : run) {
    clothfit::add_spring_forces(lanes.cloth.springs, lanes.parameters.springs,
                                lanes.state.position_m, lanes.state.velocity_m_per_s,
                                lanes.force_n);
    benchmark::ClobberMemory();
  }
  lanes.count(run);
}
BENCHMARK(add_spring_forces)->Arg(9)->Arg(17)->Arg(33);

void integrate_euler(benchmark::State& run) {
  LaneCloth lanes(static_cast<int>(run.range(0)));
  for ([[maybe_unused]] const auto _ : run) {
    // No force and no velocity: the numbers stay what they are however long this runs.
    clothfit::integrate_euler(lanes.cloth.mass_kg, 1e-4, lanes.force_n,
                              lanes.state.velocity_m_per_s, lanes.state.position_m);
    benchmark::ClobberMemory();
  }
  run.counters["vertex_steps"] =
      benchmark::Counter(static_cast<double>(lanes.cloth.mesh.vertex_count()) * kLanes *
                             static_cast<double>(run.iterations()),
                         benchmark::Counter::kIsRate);
}
BENCHMARK(integrate_euler)->Arg(17);

void step(benchmark::State& run) {
  LaneCloth lanes(static_cast<int>(run.range(0)));
  const HeldPlacement held(lanes.cloth);
  const LaneVectors target = held.locate(lanes.state.position_m);
  for ([[maybe_unused]] const auto _ : run) {
    clothfit::step(lanes.cloth, lanes.parameters, held, target, 0, 1e-4, lanes.state,
                   lanes.force_n);
    benchmark::ClobberMemory();
  }
  lanes.count(run);
}
BENCHMARK(step)->Arg(9)->Arg(17)->Arg(33);

void step_with_viscous_damping(benchmark::State& run) {
  LaneCloth lanes(static_cast<int>(run.range(0)));
  lanes.cloth.add_effect("viscous_damping", "benchmark");
  lanes.parameters.effects = {{LaneValue::Constant(0.1)}};
  const HeldPlacement held(lanes.cloth);
  const LaneVectors target = held.locate(lanes.state.position_m);
  for ([[maybe_unused]] const auto _ : run) {
    clothfit::step(lanes.cloth, lanes.parameters, held, target, 0, 1e-4, lanes.state,
                   lanes.force_n);
    benchmark::ClobberMemory();
  }
  lanes.count(run);
}
BENCHMARK(step_with_viscous_damping)->Arg(17);

}  // namespace
}  // namespace clothfit
