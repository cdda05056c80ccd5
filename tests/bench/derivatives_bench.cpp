// Compares the cost of derivatives with the fastest single simulation, in one run on one core. The
// cases are the Jacobian for eight parameters in one forward pass, the gradient by all fields with
// checkpoints, and the eight simulations that differences would take. The cases take turns and the
// best turn of each counts.
//
// Arithmetic limits a Jacobian. A spring's derivative along eight directions is 27 additions and
// multiplications (fused pairs count once) on vectors of eight, where its force in a single
// simulation is 52 on an eighth of one.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <vector>

#include "fit/problem/parameterised_model.h"
#include "model/cloth/stability.h"
#include "model/effects/registry.h"
#include "model/integrate/adjoint.h"
#include "model/integrate/tangents.h"
#include "tests/bench/swinging_cloth.h"

namespace clothfit {
namespace {

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Returns the best of `turns` of each case, the cases taking turns.
std::vector<double> best_s(const std::vector<std::function<void()>>& cases, int turns) {
  std::vector<double> best(cases.size(), 1e9);
  for (int n = 0; n < turns; ++n) {
    for (size_t c = 0; c < cases.size(); ++c) {
      const double start_s = now_s();
      cases[c]();
      best[c] = std::min(best[c], now_s() - start_s);
    }
  }
  return best;
}

/// Returns the eight parameters of a fabric with natural lengths of one kind.
std::vector<Direction> eight_directions(const Cloth& cloth, const ParameterSet& set) {
  std::vector<Direction> directions(8);
  for (size_t type = 0; type < kSpringTypes; ++type) {
    directions[type].stiffness_n_per_m[type] = 1;
    directions[type].damping_ns_per_m[type] =
        set.springs.damping_ns_per_m[type] / set.springs.stiffness_n_per_m[type];
    directions[6].damping_ns_per_m[type] = set.springs.stiffness_n_per_m[type];
    directions[7].natural_length_m[type] = set.springs.natural_length_m[type];
  }
  for (Direction& direction : directions)
    for (size_t e = 0; e < cloth.effects.size(); ++e)
      direction.effects.emplace_back(set.effects[e].size(), 0.0);
  return directions;
}

void measure(int vertices_per_side, bool wind) {
  Cloth cloth = swinging_cloth(vertices_per_side);
  ParameterSet set = cotton_sets(cloth, 1).front();
  if (wind) {
    add_effect(cloth, "wind", "benchmark");
    set.effects = {{0.01, 0.0, 0.05, 0.0}};
  }
  const std::vector<ParameterSet> eight(8, set);
  const std::vector<Direction> directions = eight_directions(cloth, set);
  Schedule schedule{.time_step_s = 0.5 * stable_time_step_s(cloth, set)};
  const int steps = 320000 / cloth.mesh.vertex_count();
  for (int frame = 0; frame <= 4; ++frame)
    schedule.frame_time_s.push_back(frame * steps / 4 * schedule.time_step_s);
  const auto look_at_all = [](int, const Eigen::Matrix3Xd& position_m) -> Eigen::Matrix3Xd {
    return Eigen::Matrix3Xd::Ones(3, position_m.cols());
  };
  bool usable = true;
  const std::vector<double> time_s = best_s(
      {[&] {
         usable &= simulate(cloth, {&set, 1}, schedule).front().usable();
       },
       [&] { usable &= simulate_with_tangents(cloth, set, directions, schedule).run.usable(); },
       [&] {
         usable &= simulate_with_gradient(cloth, set, schedule, {}, look_at_all).run.usable();
       },
       [&] { usable &= simulate(cloth, eight, schedule).front().usable(); }},
      12);
  const double spring_steps =
      static_cast<double>(cloth.spring_count()) * (steps / 4) * 4;  // frames cut evenly
  fmt::print("{:>3} x {:<3} {:>5} {:>10.0f} {:>11.2f} {:>9.2f} {:>19.2f}{}\n", vertices_per_side,
             vertices_per_side, wind ? "yes" : "no", spring_steps / time_s[0] / 1e6,
             time_s[1] / time_s[0], time_s[2] / time_s[0], time_s[3] / time_s[0],
             usable ? "" : "  DIVERGED");
}

}  // namespace
}  // namespace clothfit

int main() {
  fmt::print("single: million spring-steps per second; the others: times a single simulation\n");
  fmt::print("mesh       wind     single  8 tangents   adjoint  8 simulations alike\n");
  for (const int vertices_per_side : {9, 17, 33, 65}) clothfit::measure(vertices_per_side, false);
  clothfit::measure(17, true);
}
