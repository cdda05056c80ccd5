#include "model/equilibrium/newton.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "model/equilibrium/line_search.h"

namespace clothfit {
namespace {

/// The vertices that the preconditioner leaves alone: of every held point the one that weighs most.
std::vector<int> leading_vertices(const HeldProjection& held) {
  std::vector<int> leading;
  for (const HeldVertexWeights& point : held.held()) {
    const auto most = std::ranges::max_element(
        point.weights, {}, [](const HeldVertexWeights::Weight& w) { return std::abs(w.weight); });
    leading.push_back(most->vertex);
  }
  std::ranges::sort(leading);
  leading.erase(std::ranges::unique(leading).begin(), leading.end());
  return leading;
}

}  // namespace

MinimiseResult minimise_by_newton(HeldEnergy& energy, const StopRule& stop,
                                  const NewtonOptions& options, MeshField& position_m) {
  MinimiseResult result;
  const int evaluations_before = energy.evaluations();
  HangingEnergy& unheld = energy.unheld();
  const FieldLayout& layout = energy.layout();
  const HeldProjection& held = energy.held();
  const HangingCloth& cloth = unheld.cloth();
  LatticeMultigrid multigrid(layout, leading_vertices(held));
  Eigen::ArrayXd mass = Eigen::ArrayXd::Zero(layout.plane());
  for (int v = 0; v < cloth.mesh.vertex_count(); ++v) mass[layout.at(v)] = cloth.mass_kg[v];

  MeshField gradient(layout), new_gradient(layout), trial(layout), direction(layout),
      residual(layout), conditioned(layout), search(layout), product(layout);
  LinePlace here{.energy_j = energy.energy_and_gradient(position_m, gradient)};
  result.gradient_n = norm(gradient);
  const double slowest = cloth.gravity_m_per_s2.norm() / cloth.mesh.height_m;
  double shift = options.first_shift_per_s2;
  const double least_shift = 1e-4 * slowest;
  EnergyTangent tangent, clamped;
  double last_gradient = result.gradient_n;
  for (;; ++result.iterations) {
    result.energy_j = here.energy_j;
    if (!std::isfinite(here.energy_j) || !std::isfinite(result.gradient_n)) {
      result.reason = MinimiseReason::not_finite;
      break;
    }
    if (result.gradient_n <= stop.gradient_n) {
      result.reason = MinimiseReason::converged;
      break;
    }
    if (result.iterations == stop.most_iterations) break;

    shift = std::max(shift, least_shift);
    unheld.linearise(position_m, Curvature::clamped, clamped);
    if (options.curvature == Curvature::exact)
      unheld.linearise(position_m, Curvature::exact, tangent);
    const EnergyTangent& used = options.curvature == Curvature::exact ? tangent : clamped;
    multigrid.set(clamped, shift * mass);

    // Preconditioned conjugate gradients on (H + shift M) direction = -gradient.
    direction.values.setZero();
    residual.values = -gradient.values;
    const double enough =
        std::clamp(0.5 * std::sqrt(result.gradient_n / cloth.weight_n() * 10), 1e-3, 0.3) *
        result.gradient_n;
    multigrid.apply(residual, conditioned);
    held.project(conditioned);
    search.values = conditioned.values;
    double rz = dot(residual, conditioned);
    int inner = 0;
    bool negative = false;
    for (; inner < 60; ++inner) {
      unheld.multiply(used, search, product);
      ++result.products;
      for (int axis = 0; axis < 3; ++axis)
        Eigen::Map<Eigen::ArrayXd>(product.plane(axis), layout.plane()) +=
            shift * mass * Eigen::Map<const Eigen::ArrayXd>(search.plane(axis), layout.plane());
      held.project(product);
      const double curvature = dot(search, product);
      if (!(curvature > 0)) {
        negative = true;
        if (inner == 0) direction.values = search.values;
        break;
      }
      const double step = rz / curvature;
      add_scaled(step, search, direction);
      add_scaled(-step, product, residual);
      if (norm(residual) <= enough) break;
      multigrid.apply(residual, conditioned);
      held.project(conditioned);
      const double next = dot(residual, conditioned);
      scale_and_add(conditioned, next / rz, search);
      rz = next;
    }
    here.slope_n = dot(direction, gradient);
    const LinePlace found =
        search_line(energy, position_m, direction, here, 1, 0.9, trial, new_gradient);
    if (options.verbose)
      std::printf("   newton %3d E %.10f g/W %.3e shift %.2e inner %d%s step %.3g ev %d\n",
                  result.iterations, here.energy_j, result.gradient_n / cloth.weight_n(), shift,
                  inner, negative ? " neg" : "", found.step, energy.evaluations());
    if (found.step == 0) {
      if (shift > 1e9 * slowest) {
        result.reason = MinimiseReason::stalled;
        break;
      }
      shift *= 10;
      continue;
    }
    std::swap(position_m.values, trial.values);
    std::swap(gradient.values, new_gradient.values);
    here.energy_j = found.energy_j;
    last_gradient = result.gradient_n;
    result.gradient_n = norm(gradient);
    if (found.step > 0.5)
      shift *= 0.25;
    else if (found.step < 0.1)
      shift *= 4;
    static_cast<void>(last_gradient);
  }
  result.evaluations = energy.evaluations() - evaluations_before;
  return result;
}

}  // namespace clothfit
