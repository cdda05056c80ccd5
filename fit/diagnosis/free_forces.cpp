#include "fit/diagnosis/free_forces.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "data/parallel.h"
#include "model/cloth/cloth.h"
#include "model/effects/number.h"

namespace clothfit {
namespace {

/// A given force per unit of each parameter while it lasts. A diagnosis has hundreds of them in one
/// run. Out of its time a force costs nothing, in its time a product for each vertex.
class FreeForce final : public Effect {
 public:
  FreeForce(Eigen::VectorXd force_per_unit_kg, double from_s, double until_s)
      : force_per_unit_kg_(std::move(force_per_unit_kg)), from_s_(from_s), until_s_(until_s) {}

  void add_force(const EffectScene<ExactLanes>& scene, const EffectValues<ExactLanes>& parameters,
                 EffectMemory<ExactLanes>&, LaneVectors<ExactLanes>& force_n) const override {
    add(scene, parameters, force_n);
  }
  void add_force(const EffectScene<FastLanes>& scene, const EffectValues<FastLanes>& parameters,
                 EffectMemory<FastLanes>&, LaneVectors<FastLanes>& force_n) const override {
    add(scene, parameters, force_n);
  }
  void add_force(const EffectScene<SingleLane>& scene, const EffectValues<SingleLane>& parameters,
                 EffectMemory<SingleLane>&, LaneVectors<SingleLane>& force_n) const override {
    add(scene, parameters, force_n);
  }

  EffectRates rates(const Cloth&, const SpringParameters&,
                    const std::vector<double>&) const override {
    return {};
  }

 private:
  template <class L>
  void add(const EffectScene<L>& scene, const EffectValues<L>& parameters,
           LaneVectors<L>& force_n) const {
    if (scene.time_s < from_s_ || scene.time_s >= until_s_) return;
    for (Eigen::Index k = 0; k < force_per_unit_kg_.size(); ++k) {
      const auto of_vertex = static_cast<typename L::Number>(force_per_unit_kg_[k]);
      force_n.x.col(k) += of_vertex * parameters[0];
      force_n.y.col(k) += of_vertex * parameters[1];
      force_n.z.col(k) += of_vertex * parameters[2];
    }
  }

  Eigen::VectorXd force_per_unit_kg_;  ///< N per m/s2
  double from_s_, until_s_;
};

/// Differentiates one recording's residuals.
Eigen::MatrixXd derivatives_in(FitProblem problem, const PooledPart& part, int frames,
                               int stretches) {
  constexpr double kUnbounded = std::numeric_limits<double>::infinity();
  const int first = problem.space.size();
  Eigen::VectorXd values = part.values;
  double from_s = -kUnbounded;
  for (int stretch = 0, frame = 0; stretch < stretches; ++stretch) {
    while (frame < frames && FreeForces::stretch_of(frame, frames, stretches) <= stretch) ++frame;
    // A force that acts on the way to a frame acts from the frame before it on.
    const double until_s = stretch + 1 == stretches
                               ? kUnbounded
                               : problem.frame_time_s[static_cast<size_t>(frame - 1)];
    for (int i = 0; i < FreeForces::kWaves; ++i)
      for (int j = 0; i + j < FreeForces::kWaves; ++j) {
        const auto force = make_free_force(problem.cloth, i, j, from_s, until_s);
        for (size_t axis = 0; axis < 3; ++axis) {
          FitProblem::EmergingTerm term{.parameter = problem.space.size(),
                                        .effect = force,
                                        .values = std::vector<double>(3, 0.0),
                                        .change = 1};
          term.values[axis] = term.change;
          problem.emerging.push_back(std::move(term));
          problem.space.parameters.push_back({.name = "force",
                                              .unit = "m/s2",
                                              .role = ParameterRole::effect,
                                              .lower = -kUnbounded,
                                              .upper = kUnbounded});
        }
      }
    from_s = until_s;
  }
  values.conservativeResize(problem.space.size());
  values.tail(problem.space.size() - first).setZero();
  std::vector<int> coordinates(static_cast<size_t>(problem.space.size() - first));
  std::iota(coordinates.begin(), coordinates.end(), first);
  Linearisation linear =
      TrajectoryObjective(problem, frames, part.steps).linearise_by(values, coordinates);
  if (!linear.usable) return {};
  return std::move(linear.residual_by_coordinate);
}

}  // namespace

std::shared_ptr<const Effect> make_free_force(const Cloth& cloth, int waves_along_s,
                                              int waves_along_t, double from_s, double until_s) {
  const Mesh& mesh = cloth.mesh;
  const auto wave = [](int waves, int k, int count) {
    return sine_of_turns(0.25 + 0.5 * waves * k / (count - 1));
  };
  Eigen::VectorXd force_per_unit_kg = cloth.mass_kg;
  for (int i = 0; i < mesh.rows; ++i)
    for (int j = 0; j < mesh.columns; ++j)
      force_per_unit_kg[mesh.vertex(i, j)] *=
          wave(waves_along_s, j, mesh.columns) * wave(waves_along_t, i, mesh.rows);
  return std::make_shared<FreeForce>(std::move(force_per_unit_kg), from_s, until_s);
}

FreeForces free_forces(const DiagnosisSetup& mesh, const FittedModel& model, int stretches) {
  FittedModel there = model_at(mesh, model.hypotheses, model.values());
  FreeForces forces{.stretches = stretches, .columns = Columns(model.parts.size())};
  for_each_index(model.parts.size(), [&](size_t n) {
    forces.columns[n] =
        derivatives_in(*there.problems[n], there.parts[n], model.parts[n].frames, stretches);
  });
  for (size_t n = 0; n < model.parts.size(); ++n)
    if (forces.columns[n].rows() != model.parts[n].linear.residual.size() ||
        forces.columns[n].cols() == 0)
      return {};
  return forces;
}

}  // namespace clothfit
