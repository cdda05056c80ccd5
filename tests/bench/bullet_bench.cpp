// Compares the speed of a time step with Bullet's soft body, in one run on one core. Simulations
// run in lanes (`exact` and `fast`) and one alone (`single`), with the strain limit off and on, on
// each instruction set. Then it shows how the time grows with the mesh and falls with threads.
//
// Spring-steps per second are counted: springs times simulations times steps; for Bullet links
// times steps. Compared cases take turns, many times, and the best turn of each counts. So a busy
// machine slows none of them alone. The cloth swings: each case runs the same steps of its own
// swing in every turn.
//
//   bullet_bench [--targets targets.json] [--turns N]
//
// `of peak` counts additions and multiplications, a fused pair once. It is their share of what the
// core's vector units do when nothing else hinders them (peak_rate.h).

#include <fmt/format.h>
#include <hwy/targets.h>
#include <tbb/global_control.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "model/integrate/simulate.h"
#include "tests/bench/bullet_patch.h"
#include "tests/bench/peak_rate.h"
#include "tests/bench/stepped_lanes.h"
#include "tests/model/instruction_sets.h"

namespace clothfit {
namespace {

double wall_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Returns seconds that the processor worked for this thread: others that share the machine do not
/// count.
double thread_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// A case to be timed, and its best speed.
struct Case {
  std::string name;
  double spring_steps_per_turn = 0;
  std::function<void()> prepare;
  std::function<void()> turn;  ///< about a millisecond, so that few are interrupted
  double best_per_s = 0;
};

void take_turns(std::vector<Case>& cases, int turns, double (*clock_s)() = thread_s) {
  for (int n = 0; n < turns; ++n) {
    for (Case& one : cases) {
      one.prepare();
      const double start_s = clock_s();
      one.turn();
      one.best_per_s = std::max(one.best_per_s, one.spring_steps_per_turn / (clock_s() - start_s));
    }
  }
}

double stable_step_s(int vertices_per_side) {
  return 2e-4 * 16 / (vertices_per_side - 1);
}

/// Returns soft sets, so that the weight stretches some springs by a twentieth. The last is stiffer
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
                  lanes.step(time_step_s);  // brings its data into the caches
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
  sets.pop_back();  // every processor runs these
  return sets;
}

/// Additions and multiplications of a spring-step, a fused pair counted once, with its share of a
/// vertex's. They are counted in cloth_sweep.cpp.
constexpr double kExactOperations = 43 + 9;
constexpr double kFastOperations = 27 + 3;

/// A row of a table of targets (docs/formats.md: clothfit-targets/1).
struct Target {
  std::string name;
  double at_least;
  double value;
  std::string unit = "x";
};

void print_head() {
  fmt::print("  {:<30}{:>9}{:>10}{:>11}{:>11}{:>8}\n", "", "million/s", "x Bullet", "of peak",
             "at limit", "bytes");
}

/// Prints a row. `number_bytes`: 12 numbers of a vertex are read or written in a step.
void print_row(const Case& one, double bullet_per_s, double peak_per_s, double operations,
               double at_limit, double bytes) {
  fmt::print("  {:<30}{:>9.0f}{:>10.1f}{:>9.0f} %{:>9.1f} %{:>8.1f}\n", one.name,
             one.best_per_s / 1e6, one.best_per_s / bullet_per_s,
             100 * one.best_per_s * operations / peak_per_s, 100 * at_limit, bytes);
}

/// Returns bytes of a vertex's position and velocity, read and written once per step, by the
/// spring.
double bytes_per_spring_step(const Cloth& cloth, size_t number_bytes) {
  return 12.0 * static_cast<double>(number_bytes) * cloth.mesh.vertex_count() /
         static_cast<double>(cloth.spring_count());
}

/// All cases on one instruction set, with the strain limit off and on; targets by the kind.
struct Kind {
  std::string name;
  double operations;
  bool in_float;
};
const Kind kExact{"exact, 8 lanes", kExactOperations, false};
const Kind kFast{"fast, 16 lanes", kFastOperations, true};
const Kind kSingle{"single", kExactOperations, false};

struct Row {
  Case timed;
  const Kind* kind;
  double at_limit;
  double bytes;
  double at_least;  ///< 0: no target
};

template <class L>
void add_rows(Swing<L>& swing, const Kind& kind, const std::string& variant, int64_t target,
              double at_least, std::vector<Row>& rows) {
  for (const bool limited : {false, true})
    rows.push_back(
        {swing.timed(fmt::format("{}{}, limit {}", kind.name, variant, limited ? "on" : "off"),
                     target, limited),
         &kind, limited ? swing.at_limit : 0,
         bytes_per_spring_step(swing.cloth, sizeof(typename L::Number)), at_least});
}

PeakRate best_of(const PeakRate& a, const PeakRate& b) {
  return {std::max(a.double_per_s, b.double_per_s), std::max(a.float_per_s, b.float_per_s)};
}

/// Times the rows of every instruction set and Bullet in turns and prints a table for each set.
void compare(Bullet& bullet, const std::vector<InstructionSet>& sets,
             std::vector<std::vector<Row>> rows, int turns, std::vector<Target>& targets) {
  std::vector<Case> cases = {bullet.timed()};
  for (const std::vector<Row>& of_set : rows)
    for (const Row& row : of_set) cases.push_back(row.timed);
  std::vector<PeakRate> peaks(sets.size());
  for (int n = 0; n < turns; ++n) {
    take_turns(cases, 1);
    for (size_t s = 0; s < sets.size(); ++s) {
      hwy::GetChosenTarget().Update(sets[s].highway_target);
      peaks[s] = best_of(peaks[s], measure_peak_rate());
    }
  }
  const double yard = cases[0].best_per_s;
  fmt::print("Bullet: {} links, {:.1f} million link-steps/s\n", bullet.patch.link_count(),
             yard / 1e6);
  size_t at = 1;
  for (size_t s = 0; s < sets.size(); ++s) {
    fmt::print("{}: peak {:.1f} G operations/s in double, {:.1f} G in float\n", sets[s].name(),
               peaks[s].double_per_s / 1e9, peaks[s].float_per_s / 1e9);
    print_head();
    for (const Row& row : rows[s]) {
      const Case& timed = cases[at++];
      print_row(timed, yard, row.kind->in_float ? peaks[s].float_per_s : peaks[s].double_per_s,
                row.kind->operations, row.at_limit, row.bytes);
      if (row.at_least > 0)
        targets.push_back({fmt::format("{}, {}", timed.name, sets[s].name()), row.at_least,
                           timed.best_per_s / yard});
    }
  }
}

/// Returns the target of each kind, in Bullet's rates.
double target_of(int64_t highway_target, double on_avx3, double on_avx2) {
  return highway_target == HWY_AVX3 ? on_avx3 : highway_target == HWY_AVX2 ? on_avx2 : 0;
}

void compare_17_x_17(int turns, std::vector<Target>& targets) {
  Bullet bullet(17, 20);
  Swing<ExactLanes> exact(17, 50, 0.25), unlike_exact(17, 50, 0.25, 1.0);
  Swing<FastLanes> fast(17, 50, 0.25), unlike_fast(17, 50, 0.25, 1.0);
  Swing<SingleLane> single(17, 200, 0.25);
  const std::vector<InstructionSet> sets = vector_sets();
  std::vector<std::vector<Row>> rows(sets.size());
  for (size_t s = 0; s < sets.size(); ++s) {
    const int64_t set = sets[s].highway_target;
    add_rows(exact, kExact, "", set, target_of(set, 9, 6), rows[s]);
    add_rows(fast, kFast, "", set, target_of(set, 35, 22), rows[s]);
    add_rows(single, kSingle, "", set, 0, rows[s]);
    // These lanes are at their limits at different times, the last twice as stiff as the first.
    add_rows(unlike_exact, kExact, ", unlike", set, 0, rows[s]);
    add_rows(unlike_fast, kFast, ", unlike", set, 0, rows[s]);
  }
  fmt::print("\n17 x 17 vertices, {} springs. ", exact.cloth.spring_count());
  compare(bullet, sets, std::move(rows), turns, targets);
}

void compare_65_x_65(int turns, std::vector<Target>& targets) {
  Bullet bullet(65, 2);
  Swing<SingleLane> single(65, 20, 0.25);
  const std::vector<InstructionSet> sets = vector_sets();
  std::vector<std::vector<Row>> rows(sets.size());
  for (size_t s = 0; s < sets.size(); ++s)
    add_rows(single, kSingle, "", sets[s].highway_target, target_of(sets[s].highway_target, 10, 0),
             rows[s]);
  fmt::print("\n65 x 65 vertices, {} springs. ", single.cloth.spring_count());
  compare(bullet, sets, std::move(rows), turns, targets);
}

template <class L>
void print_growth(const std::string& name, int turns) {
  const int64_t best = vector_sets().front().highway_target;
  std::vector<std::unique_ptr<Swing<L>>> swings;
  std::vector<Case> cases;
  for (const int side : {9, 17, 33, 65, 129}) {
    swings.push_back(std::make_unique<Swing<L>>(side, 1 + 20000 / (side * side), 0.0));
    cases.push_back(swings.back()->timed(name, best, false));
  }
  take_turns(cases, turns);
  fmt::print("  {:<16}", name);
  for (const Case& one : cases) fmt::print("{:>9.0f}", one.best_per_s / 1e6);
  const double growth = cases.front().best_per_s / cases.back().best_per_s;
  fmt::print("{:>9.2f}\n", growth);
}

void compare_meshes(int turns) {
  fmt::print("\nMillion spring-steps/s by vertices per side; time per spring-step, 129 by 9\n");
  fmt::print("  {:<16}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}\n", "", 9, 17, 33, 65, 129, "growth");
  print_growth<ExactLanes>("exact, 8 lanes", turns);
  print_growth<FastLanes>("fast, 16 lanes", turns);
  print_growth<SingleLane>("single", turns);
}

/// Times whole simulations of 64 parameter sets, 17 x 17, groups of lanes in parallel.
void compare_threads(int turns) {
  hwy::GetChosenTarget().Update(vector_sets().front().highway_target);
  const Cloth cloth = swinging_cloth(17);
  const std::vector<ParameterSet> sets = soft_sets(cloth, 64, 0.02);
  Schedule schedule{.time_step_s = 2e-4};
  for (int frame = 0; frame < 3; ++frame) schedule.frame_time_s.push_back(frame / 30.0);
  const double work = 64.0 * static_cast<double>(cloth.spring_count()) * 2 * schedule.substeps(1);
  std::vector<Case> cases;
  for (const size_t threads : {size_t{1}, size_t{2}})
    cases.push_back({.name = fmt::format("{}", threads),
                     .spring_steps_per_turn = work,
                     .prepare = [] {},
                     .turn =
                         [&, threads] {
                           const tbb::global_control control(
                               tbb::global_control::max_allowed_parallelism, threads);
                           simulate(cloth, sets, schedule);
                         }});
  take_turns(cases, turns, wall_s);
  const double gain = cases[1].best_per_s / cases[0].best_per_s;
  fmt::print(
      "\nsimulate(), 64 sets, exact: {:.0f} million spring-steps/s on one thread, {:.0f} on "
      "two: {:.2f} times\n",
      cases[0].best_per_s / 1e6, cases[1].best_per_s / 1e6, gain);
}

void write_targets(const std::string& path, const std::vector<Target>& targets) {
  nlohmann::json list = nlohmann::json::array();
  for (const Target& target : targets)
    list.push_back({{"name", target.name},
                    {"target", fmt::format(">= {}", target.at_least)},
                    {"value", target.value},
                    {"unit", target.unit},
                    {"met", target.value >= target.at_least},
                    {"note", ""}});
  std::ofstream(path) << nlohmann::json{{"format", "clothfit-targets/1"},
                                        {"command", "bench"},
                                        {"targets", list}}
                             .dump(2)
                      << "\n";
}

int run(const std::string& targets_path, int turns) {
  std::vector<Target> targets;
  compare_17_x_17(turns, targets);
  compare_65_x_65(turns, targets);
  compare_meshes(turns);
  compare_threads(turns);
  fmt::print("\nTargets\n");
  for (const Target& target : targets)
    fmt::print("  {:<52} >= {:>4}{:>9.2f}  {}\n", target.name, target.at_least, target.value,
               target.value >= target.at_least ? "met" : "missed");
  if (!targets_path.empty()) write_targets(targets_path, targets);
  return 0;
}

}  // namespace
}  // namespace clothfit

int main(int argc, char** argv) {
  CLI::App app{"How fast a time step is beside Bullet's soft body"};
  std::string targets_path;
  int turns = 300;
  app.add_option("--targets", targets_path, "file for the table of targets (clothfit-targets/1)");
  app.add_option("--turns", turns, "how often everything is timed")->check(CLI::PositiveNumber);
  app.allow_extras();  // the arguments of `./run bench` are for Google Benchmark too
  CLI11_PARSE(app, argc, argv);
  return clothfit::run(targets_path, turns);
}
