#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "model/cloth/stability.h"
#include "model/effects/registry.h"
#include "model/integrate/relax.h"
#include "model/integrate/simulate.h"
#include "tests/model/random_cloth.h"

namespace clothfit {

/// A sheet that hangs flat from its upper edge, with effects on it.
struct Curtain {
  Cloth cloth = square_cloth(7);
  ParameterSet set{.springs = spring_parameters(cotton(), cloth.mesh),
                   .start_position_m = hung_flat(cloth.mesh)};

  explicit Curtain(const std::vector<std::pair<std::string, std::vector<double>>>& effects) {
    for (int j = 0; j < 7; ++j) cloth.held.push_back(held_at(cloth.mesh, 0.4 * j / 6, 0));
    for (const auto& [name, parameters] : effects) {
      add_effect(cloth, name, "test");
      set.effects.push_back(parameters);
    }
  }
  double time_step_s() const { return 0.5 * stable_time_step_s(cloth, set); }
  ParameterSet at_rest() const {
    ParameterSet start = set;
    start_at_rest(cloth, {&start, 1}, 9.81, 0, time_step_s());
    return start;
  }
  /// Returns how far any vertex comes from its start within half a second.
  double way_m(const ParameterSet& start) const {
    Schedule schedule{.time_step_s = time_step_s()};
    for (int f = 0; f <= 30; ++f) schedule.frame_time_s.push_back(f / 60.0);
    const SimulateResult run = simulate(cloth, {&start, 1}, schedule).front();
    double furthest_m = 0;
    for (const Eigen::Matrix3Xd& p : run.position_m)
      furthest_m = std::max(furthest_m, (p - start.start_position_m).colwise().norm().maxCoeff());
    return furthest_m;
  }
};

}  // namespace clothfit
