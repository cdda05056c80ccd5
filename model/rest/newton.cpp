#include "model/rest/newton.h"

#include <algorithm>
#include <cmath>

#include "model/rest/lattice_multigrid.h"
#include "model/rest/line_search.h"

namespace clothfit {
namespace {

/// Root mean square of the vertices' residual forces as a share of a vertex's weight. Below it the
/// exact second derivative is used.
constexpr double kNearBalance = 0.1;
constexpr int kMostInner = 60;
constexpr double kEnoughSlope = 0.9;  ///< a Newton step needs no exact line search

/// Returns the vertices that the preconditioner holds: of every held point the one that weighs
/// most. It takes the others of a point between vertices for free; the projection corrects that.
std::vector<int> leading_vertices(const HeldProjection& held) {
  std::vector<int> leading;
  for (const HeldVertexWeights& point : held.held())
    leading.push_back(
        std::ranges::max_element(point.weights, {}, &HeldVertexWeights::Weight::weight)->vertex);
  std::ranges::sort(leading);
  leading.erase(std::ranges::unique(leading).begin(), leading.end());
  return leading;
}

/// The linear system of one step, and the means to solve it.
class NewtonSystem {
 public:
  NewtonSystem(HangingEnergy& energy, const HeldProjection& held)
      : energy_(energy),
        held_(held),
        multigrid_(energy.layout(), leading_vertices(held)),
        mass_kg_(Eigen::ArrayXd::Zero(energy.layout().plane())),
        residual_(energy.layout()),
        conditioned_(energy.layout()),
        search_(energy.layout()),
        product_(energy.layout()) {
    const HangingCloth& cloth = energy.cloth();
    for (int v = 0; v < cloth.mesh.vertex_count(); ++v)
      mass_kg_[energy.layout().at(v)] = cloth.mass_kg[v];
  }

  /// Takes the second derivative at `position_m`.
  void set(const MeshField& position_m, Curvature curvature, double shift_per_s2) {
    energy_.linearise(position_m, Curvature::clamped, clamped_);
    if (curvature == Curvature::exact) energy_.linearise(position_m, Curvature::exact, exact_);
    tangent_ = curvature == Curvature::exact ? &exact_ : &clamped_;
    shift_n_per_m_ = shift_per_s2 * mass_kg_;
    multigrid_.set(clamped_, shift_n_per_m_);
  }

  /// Solves for `direction` until the residual is at most `enough_n`; a direction of negative
  /// curvature ends it early. Returns the number of products.
  int solve(const MeshField& gradient, double enough_n, MeshField& direction) {
    direction.values.setZero();
    residual_.values = -gradient.values;
    precondition();
    search_.values = conditioned_.values;
    double descent = dot(residual_, conditioned_);
    for (int n = 1; n <= kMostInner; ++n) {
      multiply();
      const double curvature = dot(search_, product_);
      if (!(curvature > 0)) {
        if (n == 1) direction.values = search_.values;
        return n;
      }
      const double step = descent / curvature;
      add_scaled(step, search_, direction);
      add_scaled(-step, product_, residual_);
      if (norm(residual_) <= enough_n) return n;
      precondition();
      const double next = dot(residual_, conditioned_);
      scale_and_add(conditioned_, next / descent, search_);
      descent = next;
    }
    return kMostInner;
  }

 private:
  void precondition() {
    multigrid_.apply(residual_, conditioned_);
    held_.project(conditioned_);
  }
  void multiply() {
    energy_.multiply(*tangent_, search_, product_);
    const std::ptrdiff_t plane = energy_.layout().plane();
    for (int axis = 0; axis < 3; ++axis)
      Eigen::Map<Eigen::ArrayXd>(product_.plane(axis), plane) +=
          shift_n_per_m_ * Eigen::Map<const Eigen::ArrayXd>(search_.plane(axis), plane);
    held_.project(product_);
  }

  HangingEnergy& energy_;
  const HeldProjection& held_;
  LatticeMultigrid multigrid_;
  Eigen::ArrayXd mass_kg_, shift_n_per_m_;
  EnergyTangent clamped_, exact_;
  const EnergyTangent* tangent_ = nullptr;
  MeshField residual_, conditioned_, search_, product_;
};

}  // namespace

double pendulum_shift_per_s2(const HangingCloth& cloth) {
  return cloth.gravity_m_per_s2.norm() / cloth.mesh.height_m;
}

MinimiseResult minimise_by_newton(HeldEnergy& energy, const StopRule& stop,
                                  double first_shift_per_s2, MeshField& position_m) {
  const int evaluations_before = energy.evaluations();
  const double weight_n = energy.unheld().cloth().weight_n();
  const double vertices = energy.unheld().cloth().mesh.vertex_count();
  const double slowest_per_s2 = pendulum_shift_per_s2(energy.unheld().cloth());
  // The least shift is small enough not to slow the last steps, and large enough for the
  // arithmetic.
  const double least_shift = 1e-4 * slowest_per_s2, most_shift = 1e12 * slowest_per_s2;
  NewtonSystem system(energy.unheld(), energy.held());
  MeshField gradient(energy.layout()), new_gradient(energy.layout()), trial(energy.layout());
  MeshField direction(energy.layout());
  LinePlace here{.energy_j = energy.energy_and_gradient(position_m, gradient)};
  double shift = first_shift_per_s2;

  MinimiseResult result{.energy_j = here.energy_j, .gradient_n = norm(gradient)};
  while (!is_over(stop, result)) {
    // The force is a share of the vertices' own weight, so that 0.1 means the same on every mesh.
    const double lacking = result.gradient_n * std::sqrt(vertices) / weight_n;
    shift = std::max(shift, least_shift);
    system.set(position_m, lacking < kNearBalance ? Curvature::exact : Curvature::clamped, shift);
    // The system is solved ever more closely, so that the last steps converge faster than linearly.
    const double enough = std::clamp(std::sqrt(0.15 * lacking), 1e-3, 0.3);
    result.products += system.solve(gradient, enough * result.gradient_n, direction);
    here.slope_n = dot(direction, gradient);
    const LinePlace found = here.slope_n < 0 ? search_line(energy, position_m, direction, here, 1,
                                                           kEnoughSlope, trial, new_gradient)
                                             : LinePlace{};
    if (found.step == 0) {
      if (shift > most_shift) {
        result.reason = MinimiseReason::stalled;
        break;
      }
      shift *= 10;
      continue;
    }
    ++result.iterations;
    std::swap(position_m.values, trial.values);
    std::swap(gradient.values, new_gradient.values);
    here.energy_j = found.energy_j;
    result.energy_j = here.energy_j;
    result.gradient_n = norm(gradient);
    if (found.step > 0.5)
      shift *= 0.25;
    else if (found.step < 0.1)
      shift *= 4;
  }
  result.evaluations = energy.evaluations() - evaluations_before;
  return result;
}

}  // namespace clothfit
