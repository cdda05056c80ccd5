// How fast a time step is beside Bullet's soft body, in one run on one core: simulations in lanes
// (`exact` and `fast`) and one alone (`single`), with the strain limit off and on, on each
// instruction set; then how the time grows with the mesh and falls with threads.
//
// Counted are spring-steps per second: springs times simulations times steps; for Bullet links
// times steps. Compared cases take turns, many times, and the best turn of each counts, so that a
// busy machine slows none of them alone. The cloth swings: each case runs the same steps of its own
// swing in every turn.
//
//   bullet_bench [--targets targets.json]
//
// `of peak`: additions and multiplications, a fused pair counted once, as a share of what the
// core's vector units do when nothing else hinders them (peak_rate.h).

#include <fmt/format.h>
#include <hwy/targets.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "model/simulate.h"
#include "tests/bench/bullet_patch.h"
#include "tests/bench/peak_rate.h"
#include "tests/bench/stepped_lanes.h"
#include "tests/model/instruction_sets.h"

namespace clothfit {
namespace {

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Something to be timed, and how fast it was at best.
struct Case {
  std::string name;
  double spring_steps_per_turn = 0;
  std::function<void()> prepare;
  std::function<void()> turn;
  double best_per_s = 0;
};

void take_turns(std::vector<Case>& cases, int turns) {
  for (int n = 0; n < turns; ++n) {
    for (Case& one : cases) {
      one.prepare();
      one.best_per_s = std::max(one.best_per_s, one.spring_steps_per_turn / seconds_of(one.turn));
    }
  }
}

double stable_step_s(int vertices_per_side) {
  return 2e-4 * 16 / (vertices_per_side - 1);
}

/// Soft sets, so that a twentieth is what the weight stretches some springs by. The last is stiffer
/// than the first by `spread`.
std::vector<ParameterSet> soft_sets(const Cloth& cloth, int count, double spread) {
  std::vector<ParameterSet> sets = cotton_sets(cloth, count);
  for (int n = 0; n < count; ++n) {
    ParameterSet& set = sets[static_cast<size_t>(n)];
    for (double& k : set.springs.stiffness_n_per_m)
      k *= 0.25 * (1 + spread * n / std::max(1, count - 1));
  }
  return sets;
}

/// A cloth in lanes at one moment of its swing, from which the same steps are taken again.
template <class L>
struct Swing {
  Cloth cloth;
  double time_step_s;
  int steps;
  SteppedLanes<L> lanes;
  double at_limit = 0;  ///< share of the springs that the limit shortens in a step

  Swing(int vertices_per_side, int turn_steps, double swing_s, double spread = 0.02)
      : cloth(swinging_cloth(vertices_per_side)),
        time_step_s(stable_step_s(vertices_per_side)),
        steps(turn_steps),
        lanes(cloth, soft_sets(cloth, L::kCount, spread), 0.05, true) {
    for (double t = 0; t < swing_s; t += time_step_s) lanes.step(time_step_s);
    lanes.save();
    double too_long = 0;
    for (int n = 0; n < steps; ++n) {
      lanes.step(time_step_s);
      too_long += lanes.too_long();
    }
    at_limit = too_long / steps / static_cast<double>(cloth.spring_count());
  }

  Case timed(const std::string& name, int64_t highway_target, bool limited) {
    return {.name = name,
            .spring_steps_per_turn = static_cast<double>(cloth.spring_count()) * L::kCount * steps,
            .prepare =
                [this, highway_target, limited] {
                  hwy::GetChosenTarget().Update(highway_target);
                  lanes.restore();
                  lanes.set_limited(limited);
                  lanes.step(time_step_s);  // what it works on comes into the caches
                },
            .turn =
                [this] {
                  for (int n = 0; n < steps; ++n) lanes.step(time_step_s);
                }};
  }
};

struct Bullet {
  BulletPatch patch;
  double time_step_s;
  int steps;
  Bullet(int vertices_per_side, int turn_steps)
      : patch(vertices_per_side), time_step_s(stable_step_s(vertices_per_side)), steps(turn_steps) {
    for (int n = 0; n < 500; ++n) patch.step(time_step_s);
  }
  Case timed() {
    return {.name = "Bullet",
            .spring_steps_per_turn = static_cast<double>(patch.link_count()) * steps,
            .prepare = [this] { patch.step(time_step_s); },
            .turn =
                [this] {
                  for (int n = 0; n < steps; ++n) patch.step(time_step_s);
                }};
  }
};

std::vector<InstructionSet> vector_sets() {
  std::vector<InstructionSet> sets = instruction_sets();
  sets.pop_back();  // what every processor runs
  return sets;
}

/// Additions and multiplications of a spring-step, a fused pair counted once, with its share of a
/// vertex's. Counted in cloth_sweep.cpp.
constexpr double kExactOperations = 43 + 9;
constexpr double kFastOperations = 27 + 5;

struct Target {
  std::string name;
  double at_least;
  double value;
};

void print_row(const Case& one, double bullet_per_s, double peak_per_s, double operations,
               double at_limit) {
  fmt::print("  {:<24}{:>9.0f}{:>10.1f}{:>11.0f} %{:>10.1f} %\n", one.name, one.best_per_s / 1e6,
             one.best_per_s / bullet_per_s, 100 * one.best_per_s * operations / peak_per_s,
             100 * at_limit);
}

void print_head() {
  fmt::print("  {:<24}{:>9}{:>10}{:>13}{:>12}\n", "", "million/s", "x Bullet", "of peak",
             "at limit");
}

const char* on_or_off(bool limited) {
  return limited ? "on" : "off";
}

void compare_17_x_17(int turns, std::vector<Target>& targets) {
  Bullet bullet(17, 100);
  Swing<ExactLanes> exact(17, 50, 0.25);
  Swing<FastLanes> fast(17, 50, 0.25);
  Swing<ExactLanes> unlike_exact(17, 50, 0.25, 1.0);
  Swing<FastLanes> unlike_fast(17, 50, 0.25, 1.0);

  std::vector<Case> cases = {bullet.timed()};
  const std::vector<InstructionSet> sets = vector_sets();
  std::vector<PeakRate> peaks(sets.size());
  for (const InstructionSet& set : sets) {
    for (const bool limited : {false, true}) {
      const std::string tail = fmt::format(", limit {}", on_or_off(limited));
      cases.push_back(exact.timed("exact" + tail, set.highway_target, limited));
      cases.push_back(fast.timed("fast" + tail, set.highway_target, limited));
    }
    cases.push_back(unlike_exact.timed("exact, unlike lanes, on", set.highway_target, true));
    cases.push_back(unlike_fast.timed("fast, unlike lanes, on", set.highway_target, true));
  }
  for (int n = 0; n < turns; n += 10) {
    take_turns(cases, 10);
    for (size_t s = 0; s < sets.size(); ++s) {
      hwy::GetChosenTarget().Update(sets[s].highway_target);
      const PeakRate peak = measure_peak_rate();
      peaks[s].double_per_s = std::max(peaks[s].double_per_s, peak.double_per_s);
      peaks[s].float_per_s = std::max(peaks[s].float_per_s, peak.float_per_s);
    }
  }

  const double yard = cases[0].best_per_s;
  fmt::print("17 x 17 vertices, {} springs; Bullet: {} links, {:.1f} million link-steps/s\n",
             exact.cloth.spring_count(), bullet.patch.link_count(), yard / 1e6);
  size_t at = 1;
  for (size_t s = 0; s < sets.size(); ++s) {
    fmt::print("{}: peak {:.1f} G double/s, {:.1f} G float/s\n", sets[s].name(),
               peaks[s].double_per_s / 1e9, peaks[s].float_per_s / 1e9);
    print_head();
    const auto row = [&](double peak, double operations, double at_limit) {
      print_row(cases[at], yard, peak, operations, at_limit);
      const double floor =
          sets[s].highway_target == HWY_AVX3   ? (operations == kExactOperations ? 9 : 35)
          : sets[s].highway_target == HWY_AVX2 ? (operations == kExactOperations ? 6 : 22)
                                               : 0;
      if (floor > 0)
        targets.push_back({fmt::format("{}, 17 x 17, {}", cases[at].name, sets[s].name()), floor,
                           cases[at].best_per_s / yard});
      ++at;
    };
    for (const bool limited : {false, true}) {
      row(peaks[s].double_per_s, kExactOperations, limited ? exact.at_limit : 0);
      row(peaks[s].float_per_s, kFastOperations, limited ? fast.at_limit : 0);
    }
    row(peaks[s].double_per_s, kExactOperations, unlike_exact.at_limit);
    row(peaks[s].float_per_s, kFastOperations, unlike_fast.at_limit);
  }
}

}  // namespace
}  // namespace clothfit

int main() {
  std::vector<clothfit::Target> targets;
  clothfit::compare_17_x_17(30, targets);
}
