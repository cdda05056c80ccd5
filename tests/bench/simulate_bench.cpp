// Times the simulations of a fit: whole ones over the frames of a recording, and the shape at rest.
// `spring_steps` is as in step_bench.cpp, which also says what limits it; `simulations` is per
// second.

#include <benchmark/benchmark.h>

#include "model/cloth/stability.h"
#include "model/integrate/relax.h"
#include "model/integrate/simulate.h"
#include "tests/bench/swinging_cloth.h"

namespace clothfit {
namespace {

/// Times 72 frames at 30 Hz, like the bundled demo, at 0.8 of the stable step. `sets` parameter
/// sets run on a 17 x 17 mesh, in real time over all threads.
void simulate_72_frames(benchmark::State& run) {
  const int count = static_cast<int>(run.range(0));
  const Cloth cloth = swinging_cloth(17);
  const std::vector<ParameterSet> sets = cotton_sets(cloth, count);
  Schedule schedule{.time_step_s = 0.8 * stable_time_step_s(cloth, sets.back())};
  for (int frame = 0; frame < 72; ++frame) schedule.frame_time_s.push_back(frame / 30.0);

  for ([[maybe_unused]] const auto _ : run)
    benchmark::DoNotOptimize(simulate(cloth, sets, schedule));

  const double steps = 71.0 * schedule.substeps(1);
  const auto runs = static_cast<double>(run.iterations());
  run.counters["steps"] = steps;
  run.counters["simulations"] = benchmark::Counter(runs * count, benchmark::Counter::kIsRate);
  run.counters["spring_steps"] =
      benchmark::Counter(runs * count * steps * static_cast<double>(cloth.spring_count()),
                         benchmark::Counter::kIsRate);
}
BENCHMARK(simulate_72_frames)
    ->Arg(1)
    ->Arg(8)
    ->Arg(64)
    ->ArgName("sets")
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void relax_8_sets(benchmark::State& run) {
  const Cloth cloth = swinging_cloth(17);
  const std::vector<ParameterSet> sets = cotton_sets(cloth, 8);
  const double time_step_s = 0.8 * stable_time_step_s(cloth, sets.back());
  for ([[maybe_unused]] const auto _ : run)
    benchmark::DoNotOptimize(relax(cloth, sets, 9.81, 0, time_step_s));
}
BENCHMARK(relax_8_sets)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clothfit
