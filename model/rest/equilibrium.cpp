#include "model/rest/equilibrium.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "data/input_error.h"
#include "model/rest/coarser_cloth.h"
#include "model/rest/conjugate_gradient.h"
#include "model/rest/newton.h"

namespace clothfit {
namespace {

/// A cloth that hangs lower than this many of its diagonals below its held points has fallen.
constexpr double kLongestReach = 100;

/// Throws unless the energy has a meaning and something carries the cloth.
void check(const HangingCloth& cloth, const std::vector<HeldVertexWeights>& held,
           const Eigen::Matrix3Xd& start_position_m, const Eigen::Matrix3Xd& held_target_m) {
  const auto require = [](bool good, const std::string& where, const std::string& problem,
                          const std::string& expected) {
    if (!good) throw InputError(where, problem, expected);
  };
  bool any_stiffness = false;
  for (size_t t = 0; t < kSpringTypes; ++t) {
    const double k = cloth.stiffness_n_per_m[t], l0 = cloth.natural_length_m[t];
    require(std::isfinite(k) && k >= 0, fmt::format("stiffness of spring type {}", t),
            fmt::format("{}", k), "stiffness values are in N/m, >= 0");
    require(std::isfinite(l0) && l0 > 0, fmt::format("natural length of spring type {}", t),
            fmt::format("{}", l0), "lengths are in metres, > 0");
    any_stiffness = any_stiffness || k > 0;
  }
  require(any_stiffness, "stiffness", "0 for all spring types",
          "some spring must carry the cloth's weight");
  require(cloth.mass_kg.size() == cloth.mesh.vertex_count() && cloth.mass_kg.allFinite() &&
              cloth.mass_kg.minCoeff() > 0,
          "masses", "not a positive mass for every vertex", "masses are in kilograms, > 0");
  require(cloth.gravity_m_per_s2.allFinite() && cloth.gravity_m_per_s2.norm() > 0, "gravity",
          "no weight", "gravity is a vector in m/s2, not zero");
  require(!held.empty(), "held", "no point of the cloth is held",
          "an equilibrium needs at least one held point");
  for (const HeldVertexWeights& point : held) {
    double sum = 0;
    for (const auto& [vertex, weight] : point.weights) {
      require(vertex >= 0 && vertex < cloth.mesh.vertex_count(), "held",
              fmt::format("vertex {}", vertex), "held points lie on the mesh");
      sum += weight;
    }
    require(std::abs(sum - 1) < 1e-6, "held", fmt::format("weights that sum to {}", sum),
            "the weights of a held point sum to 1");
  }
  require(start_position_m.cols() == cloth.mesh.vertex_count() && start_position_m.allFinite(),
          "start", "not a position for every vertex", "the start shape has finite coordinates");
  require(
      held_target_m.cols() == static_cast<Eigen::Index>(held.size()) && held_target_m.allFinite(),
      "held", "not a place for every held point", "held points have finite coordinates");
}

std::vector<Mesh> meshes_from_fine_to_coarse(const Mesh& mesh, const EquilibriumOptions& options) {
  std::vector<Mesh> meshes = {mesh};
  if (options.method == EquilibriumMethod::conjugate_gradient) return meshes;
  while (std::max(meshes.back().columns, meshes.back().rows) > options.coarsest_vertices)
    meshes.push_back(coarser_mesh(meshes.back(), 4));
  return meshes;
}

}  // namespace

void EquilibriumOptions::validate() const {
  const auto require = [](bool good, const std::string& name, double value,
                          const std::string& expected) {
    if (!good) throw InputError(name, fmt::format("{}", value), expected);
  };
  require(tolerance > 0, "tolerance", tolerance, "a share of the weight, > 0");
  require(coarse_tolerance > 0, "coarse_tolerance", coarse_tolerance, "a share of the weight, > 0");
  require(coarsest_vertices >= 4, "coarsest_vertices", coarsest_vertices, "a number >= 4");
  require(most_iterations >= 1, "most_iterations", most_iterations, "a number >= 1");
}

const char* describe(MinimiseReason reason) {
  switch (reason) {
    case MinimiseReason::converged:
      return "the forces are balanced";
    case MinimiseReason::iterations_used_up:
      return "the iterations are used up";
    case MinimiseReason::stalled:
      return "no step lowers the energy any more";
    case MinimiseReason::fell:
      return "the cloth falls: its springs do not carry it";
    case MinimiseReason::not_finite:
      return "the start is too far from equilibrium to compute with";
    case MinimiseReason::cancelled:
      return "cancelled";
  }
  return "";
}

EquilibriumResult find_equilibrium(const HangingCloth& cloth,
                                   const std::vector<HeldVertexWeights>& held,
                                   const Eigen::Matrix3Xd& held_target_m,
                                   const Eigen::Matrix3Xd& start_position_m,
                                   const EquilibriumOptions& options) {
  options.validate();
  check(cloth, held, start_position_m, held_target_m);
  const std::vector<Mesh> meshes = meshes_from_fine_to_coarse(cloth.mesh, options);
  const double weight_n = cloth.weight_n();
  const double reach_m = held_target_m.colwise().norm().maxCoeff() +
                         kLongestReach * std::hypot(cloth.mesh.width_m, cloth.mesh.height_m);

  EquilibriumResult result;
  result.position_m = start_position_m;
  Mesh shape_mesh = cloth.mesh;
  for (size_t level = meshes.size(); level-- > 0;) {
    const Mesh& mesh = meshes[level];
    const bool own = level == 0, first = level + 1 == meshes.size();
    HangingEnergy energy(own ? cloth : on_mesh(cloth, mesh));
    const HeldProjection projection(mesh, own ? held : on_mesh(held, cloth.mesh, mesh));
    HeldEnergy held_energy(energy, projection);
    MeshField position = MeshField::of(
        energy.layout(), shape_mesh.columns == mesh.columns && shape_mesh.rows == mesh.rows
                             ? result.position_m
                             : transfer_shape(shape_mesh, result.position_m, mesh));
    projection.place(held_target_m, position);

    StopRule stop{.gradient_n = weight_n * (own ? options.tolerance : options.coarse_tolerance),
                  .most_iterations = options.most_iterations,
                  .lowest_energy_j = -weight_n * reach_m};
    if (options.go_on)
      stop.go_on = [&](int iteration, double gradient_n) {
        return options.go_on(mesh, iteration, gradient_n / weight_n);
      };
    const double shift = (first ? 100 : 1) * pendulum_shift_per_s2(cloth);
    const MinimiseResult work = options.method == EquilibriumMethod::multigrid_newton
                                    ? minimise_by_newton(held_energy, stop, shift, position)
                                    : minimise_by_conjugate_gradients(held_energy, stop, position);
    result.stages.push_back({mesh, work});
    result.position_m = position.vectors();
    shape_mesh = mesh;
    // A coarse mesh that got nowhere still starts the next one, unless its shape is no start.
    if (!own && (work.reason == MinimiseReason::fell || work.reason == MinimiseReason::not_finite))
      result.position_m = start_position_m, shape_mesh = cloth.mesh;
    if (work.reason == MinimiseReason::cancelled && !own) {
      result.position_m = transfer_shape(mesh, result.position_m, cloth.mesh);
      break;
    }
  }
  const MinimiseResult& last = result.stages.back().work;
  result.reason = last.reason;
  result.energy_j = last.energy_j;
  result.imbalance = last.gradient_n / weight_n;
  result.iterations = last.iterations;
  result.evaluations = last.evaluations;
  result.products = last.products;
  return result;
}

Eigen::Matrix3Xd held_targets_m(const Cloth& cloth, const ParameterSet& parameters, double time_s) {
  Eigen::Matrix3Xd target_m =
      Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(cloth.held.size()));
  for (size_t h = 0; h < cloth.held.size(); ++h) {
    auto place = target_m.col(static_cast<Eigen::Index>(h));
    if (cloth.held[h].motion) {
      place = shifted(cloth.held[h].motion(time_s), parameters, h, time_s);
      continue;
    }
    for (const auto& [vertex, weight] : cloth.held[h].weights)
      if (vertex >= 0 && vertex < parameters.start_position_m.cols())
        place += weight * parameters.start_position_m.col(vertex);
  }
  return target_m;
}

EquilibriumResult find_equilibrium(const Cloth& cloth, const ParameterSet& parameters,
                                   const EquilibriumOptions& options, double time_s) {
  return find_equilibrium(HangingCloth::of(cloth, parameters), cloth.held,
                          held_targets_m(cloth, parameters, time_s), parameters.start_position_m,
                          options);
}

}  // namespace clothfit
