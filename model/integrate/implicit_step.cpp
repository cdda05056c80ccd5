#include "model/integrate/implicit_step.h"

#include <algorithm>
#include <cassert>
#include <tuple>
#include <vector>

#include "data/input_error.h"
#include "model/integrate/step.h"

namespace clothfit {
namespace {

/// Returns the effects' forces (N), 3 x vertices, and advances their memories.
Eigen::Matrix3Xd effect_forces_n(const Cloth& cloth, const ParameterSet& parameters, double time_s,
                                 double time_step_s, ImplicitState& state) {
  const LaneParameters<SingleLane> lane = lane_parameters<SingleLane>(cloth, {&parameters, 1});
  const int vertices = cloth.mesh.vertex_count();
  auto position = LaneVectors<SingleLane>::zero(vertices), velocity = position, force = position;
  position.set_lane(0, state.position_m);
  velocity.set_lane(0, state.velocity_m_per_s);
  const EffectScene<SingleLane> scene{
      cloth, lane.springs, lane.gravity_m_per_s2, position, velocity, time_s, time_step_s};
  for (size_t e = 0; e < cloth.effects.size(); ++e) {
    if (state.effect_memory.size() <= e)
      state.effect_memory.push_back(
          EffectMemory<SingleLane>::Zero(1, cloth.effects[e]->memory_size(cloth)));
    cloth.effects[e]->add_force(scene, lane.effects[e], state.effect_memory[e], force);
  }
  return force.lane(0);
}

/// A spring's contribution to its ends: its pull on the first, and its resistance.
struct SpringLoad {
  Eigen::Vector3d pull_n;
  Eigen::Matrix3d stiffness_n_per_m;  ///< clamped: positive semidefinite
  Eigen::Matrix3d damping_ns_per_m;
};

SpringLoad load_of(double k, double l0, double c, const Eigen::Vector3d& along,
                   const Eigen::Vector3d& rate) {
  const double length = along.norm();
  if (length < 1e-140)  // no direction: no pull, as in the time step
    return {Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
  const Eigen::Vector3d u = along / length;
  const Eigen::Matrix3d uu = u * u.transpose();
  const double transverse = std::max(0.0, k * (1 - l0 / length));
  return {(k * (length - l0) + c * u.dot(rate)) * u,
          transverse * (Eigen::Matrix3d::Identity() - uu) + k * uu, c * uu};
}

}  // namespace

ImplicitStepper::ImplicitStepper(const Cloth& cloth)
    : cloth_(cloth),
      held_(cloth.mesh, cloth.held),
      motions_(allowed_motions(held_, cloth.mesh.vertex_count())) {
  for (size_t e = 0; e < cloth.effects.size(); ++e)
    if (cloth.effects[e]->changes_force() || cloth.effects[e]->shifts_supports())
      throw InputError(
          "implicit step",
          "effect '" + cloth.effect_descriptions[e].name + "' acts on inertia or supports",
          "only effects that add a force; take the Euler scheme");
}

bool ImplicitStepper::step(const ParameterSet& parameters, const Eigen::Matrix3Xd& held_target_m,
                           double time_s, double time_step_s, ImplicitState& state) {
  assert(time_step_s > 0 && held_target_m.cols() == held_.count());
  const double h = time_step_s;
  const Eigen::Matrix3Xd &p = state.position_m, &v = state.velocity_m_per_s;
  Eigen::Matrix3Xd force_n = parameters.gravity_m_per_s2 * cloth_.mass_kg.transpose();
  if (!cloth_.effects.empty())
    force_n += effect_forces_n(cloth_, parameters, time_s, time_step_s, state);

  // The system is the matrix M - h D - h^2 K and the impulse h (f + h K v).
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(36 * cloth_.spring_count() + 3 * static_cast<size_t>(p.cols()));
  for (int n = 0; n < p.cols(); ++n)
    for (int c = 0; c < 3; ++c) entries.emplace_back(3 * n + c, 3 * n + c, cloth_.mass_kg[n]);
  Eigen::Matrix3Xd impulse = Eigen::Matrix3Xd::Zero(3, p.cols());
  for (size_t t = 0; t < kSpringTypes; ++t) {
    for (const Spring& spring : cloth_.springs[t]) {
      const Eigen::Vector3d rate = v.col(spring.b) - v.col(spring.a);
      const SpringLoad load =
          load_of(parameters.springs.stiffness_n_per_m[t], parameters.springs.natural_length_m[t],
                  parameters.springs.damping_ns_per_m[t], p.col(spring.b) - p.col(spring.a), rate);
      const Eigen::Vector3d on_a = h * (load.pull_n + h * load.stiffness_n_per_m * rate);
      impulse.col(spring.a) += on_a;
      impulse.col(spring.b) -= on_a;
      const Eigen::Matrix3d block = h * load.damping_ns_per_m + h * h * load.stiffness_n_per_m;
      for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
          for (const auto& [at, to, sign] : {std::tuple{spring.a, spring.a, 1},
                                             {spring.b, spring.b, 1},
                                             {spring.a, spring.b, -1},
                                             {spring.b, spring.a, -1}})
            entries.emplace_back(3 * at + row, 3 * to + column, sign * block(row, column));
    }
  }
  impulse += h * force_n;
  Sparse matrix(3 * p.cols(), 3 * p.cols());
  matrix.setFromTriplets(entries.begin(), entries.end());

  // Held points must be at their targets at the end, which fixes their part of dv.
  const FieldLayout layout = FieldLayout::of(cloth_.mesh);
  MeshField given(layout);
  if (held_.count() > 0) {
    const Eigen::Matrix3Xd now_m = held_.locate(MeshField::of(layout, p));
    const Eigen::Matrix3Xd rate = held_.locate(MeshField::of(layout, v));
    held_.place((held_target_m - now_m) / h - rate, given);
  }
  const Eigen::Matrix3Xd given_vectors = given.vectors();
  const Eigen::Map<const Eigen::VectorXd> prescribed(given_vectors.data(), given_vectors.size());
  const Eigen::Map<const Eigen::VectorXd> right(impulse.data(), impulse.size());
  const Sparse reduced = motions_.transpose() * matrix * motions_;
  if (!analysed_) factors_.analyzePattern(reduced);
  analysed_ = true;
  factors_.factorize(reduced);
  const bool good = factors_.info() == Eigen::Success;
  const Eigen::VectorXd free = factors_.solve(motions_.transpose() * (right - matrix * prescribed));
  const Eigen::VectorXd change = prescribed + motions_ * free;
  state.velocity_m_per_s += Eigen::Map<const Eigen::Matrix3Xd>(change.data(), 3, p.cols());
  state.position_m += h * state.velocity_m_per_s;
  return good && state.position_m.allFinite();
}

}  // namespace clothfit
