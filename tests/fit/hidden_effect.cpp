#include "tests/fit/hidden_effect.h"

#include <random>

#include "fit/observe/observations.h"
#include "fit/problem/parameterised_model.h"
#include "tests/fit/synthetic_cloth.h"

namespace clothfit {

FitInput moved_by(const DeclaredEffect& hidden, FitInput input) {
  const SyntheticCloth cloth;
  input.recording.declared = {hidden};
  const FitProblem truth = make_problem(input, {}, 9, 9);
  const Eigen::VectorXd values = start_with(truth, cloth.fabric);
  const SimulateResult run =
      run_model(truth, {values}, truth.frames(), TimeSteps(1.0 / 60 / 200)).front();
  const std::vector<Eigen::Matrix3Xd> markers =
      marker_positions(truth.vertex_weights, run.position_m);
  std::mt19937_64 generator(cloth.seed);
  std::normal_distribution<double> normal(0, cloth.noise_m);
  for (Position3d& point : input.tracks3d) {
    point.position_m = markers[static_cast<size_t>(point.frame)].col(point.marker);
    for (double& coordinate : point.position_m) coordinate += normal(generator);
  }
  input.recording.declared.clear();
  return input;
}

}  // namespace clothfit
