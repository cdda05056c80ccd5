// Times how a hanging cloth finds its equilibrium. The founding paper's conjugate gradients run on
// one mesh, its cascade from coarse to fine, and Newton's method with multigrid, all with the same
// kernels in the same run. Then it shows how the time grows with the number of particles, and
// shapes at rest beside relaxation. Prints tables; a minute or two in all.
//
// The cloth is square, 0.2 kg/m2, tension 50, shear 20, flexion 10 N/m. It is held at two corners
// and starts flat, either `lying` (it has to swing down) or `hung` (it only has to sag). Balanced
// means that the 2-norm of the forces on all free vertices is below 1e-3 of the weight.
//
// Nothing here is asserted: timings belong to a machine and its load.

#include <fmt/format.h>
#include <tbb/info.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <vector>

#include "model/cloth/stability.h"
#include "model/integrate/relax.h"
#include "model/integrate/simulate.h"
#include "model/rest/equilibrium.h"
#include "model/rest/rest_shapes.h"

namespace clothfit {
namespace {

template <class Work>
double seconds_of(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Returns the processor's time, of all threads together, which a busy machine disturbs less.
template <class Work>
double processor_seconds_of(const Work& work) {
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

template <class Work>
double best_seconds_of(int times, const Work& work) {
  double best = seconds_of(work);
  for (int n = 1; n < times; ++n) best = std::min(best, seconds_of(work));
  return best;
}

enum class Start { lying, hung };

struct Sheet {
  Cloth cloth;
  ParameterSet set;
};

Sheet sheet(int vertices_per_side, double size_m, Start start, int corners = 2) {
  const Mesh mesh{.columns = vertices_per_side,
                  .rows = vertices_per_side,
                  .width_m = size_m,
                  .height_m = size_m};
  Sheet result{Cloth::of(mesh, masses_by_area(mesh, 0.2 * size_m * size_m)), {}};
  result.cloth.held = {held_at(mesh, 0, 0)};
  if (corners == 2) result.cloth.held.push_back(held_at(mesh, size_m, 0));
  const Fabric fabric{.tension_warp_n_per_m = 50,
                      .tension_weft_n_per_m = 50,
                      .shear_n_per_m = 20,
                      .flexion_warp_n_per_m = 10,
                      .flexion_weft_n_per_m = 10,
                      .damping_warp_s = 1e-3,
                      .damping_weft_s = 1e-3};
  result.set = {.springs = spring_parameters(fabric, mesh),
                .start_position_m = flat_positions(mesh)};
  Eigen::Matrix3Xd& p = result.set.start_position_m;
  if (start == Start::hung) {
    p.row(2) = -p.row(1);
    p.row(1).setZero();
  }
  return result;
}

void time_kernels() {
  const Sheet on = sheet(173, 1, Start::lying);
  HangingEnergy energy(HangingCloth::of(on.cloth, on.set));
  const MeshField position = MeshField::of(energy.layout(), on.set.start_position_m);
  MeshField gradient(energy.layout()), product(energy.layout());
  EnergyTangent tangent;
  energy.linearise(position, Curvature::clamped, tangent);
  constexpr int kCalls = 100;
  const auto per_call = [&](const auto& call) {
    return best_seconds_of(5,
                           [&] {
                             for (int n = 0; n < kCalls; ++n) call();
                           }) /
           kCalls;
  };
  const double evaluate_s = per_call([&] { energy.energy_and_gradient(position, gradient); });
  const double multiply_s = per_call([&] { energy.multiply(tangent, position, product); });
  const auto springs = static_cast<double>(on.cloth.spring_count());
  fmt::print("kernels, 173 x 173, all threads ({}):\n", tbb::info::default_concurrency());
  fmt::print("  energy and gradient      {:.3f} ms, {:.0f} million springs a second\n",
             1e3 * evaluate_s, springs / evaluate_s * 1e-6);
  fmt::print("  second derivative times  {:.3f} ms, {:.0f} million springs a second\n\n",
             1e3 * multiply_s, springs / multiply_s * 1e-6);
}

void time_methods(int vertices_per_side, double size_m, Start start) {
  const Sheet on = sheet(vertices_per_side, size_m, start);
  fmt::print("{0} x {0}, {1} m, {2}:\n", vertices_per_side, size_m,
             start == Start::lying ? "lying" : "hung");
  double reference_s = 0, reference_cpu_s = 0;
  const auto report = [&](const char* name, EquilibriumMethod method, int times) {
    EquilibriumResult result;
    double cpu_s = 1e300;
    const double seconds = best_seconds_of(times, [&] {
      cpu_s = std::min(cpu_s, processor_seconds_of([&] {
                         result = find_equilibrium(on.cloth, on.set, {.method = method});
                       }));
    });
    if (method == EquilibriumMethod::conjugate_gradient)
      reference_s = seconds, reference_cpu_s = cpu_s;
    fmt::print("  {:<20} {:8.3f} s ({:8.3f} s of processor)  {:5.1f} ({:5.1f}) times as fast\n",
               name, seconds, cpu_s, reference_s / seconds, reference_cpu_s / cpu_s);
    fmt::print(
        "  {:<20} {} steps, {} evaluations, {} products on the finest; E {:.6f} J, imbalance "
        "{:.1e}; {}\n",
        "", result.iterations, result.evaluations, result.products, result.energy_j,
        result.imbalance, describe(result.reason));
    std::fflush(stdout);
  };
  report("conjugate gradients", EquilibriumMethod::conjugate_gradient, 1);
  report("cascade", EquilibriumMethod::cascade, 1);
  report("multigrid Newton", EquilibriumMethod::multigrid_newton, 3);
  fmt::print("\n");
}

/// Returns the exponent of a power law through (particles, seconds), by least squares of the
/// logarithms.
double fitted_exponent(const std::vector<double>& particles, const std::vector<double>& seconds) {
  const auto count = static_cast<Eigen::Index>(particles.size());
  const Eigen::ArrayXd x = Eigen::Map<const Eigen::ArrayXd>(particles.data(), count).log();
  const Eigen::ArrayXd y = Eigen::Map<const Eigen::ArrayXd>(seconds.data(), count).log();
  return ((x - x.mean()) * (y - y.mean())).sum() / (x - x.mean()).square().sum();
}

void time_growth() {
  fmt::print("growth of multigrid Newton, 1 m, lying:\n");
  std::vector<double> particles, seconds, cpu_seconds;
  for (const int side : {32, 45, 63, 89, 126, 173, 245, 347}) {
    const Sheet on = sheet(side, 1, Start::lying);
    EquilibriumResult result;
    double cpu_s = 1e300;
    seconds.push_back(best_seconds_of(5, [&] {
      cpu_s = std::min(cpu_s,
                       processor_seconds_of([&] { result = find_equilibrium(on.cloth, on.set); }));
    }));
    cpu_seconds.push_back(cpu_s);
    particles.push_back(static_cast<double>(side) * side);
    fmt::print(
        "  {:7.0f} particles {:7.3f} s ({:7.3f} s of processor)  {:5.1f} us per particle  {} "
        "products  {}\n",
        particles.back(), seconds.back(), cpu_s, 1e6 * seconds.back() / particles.back(),
        result.products, describe(result.reason));
    std::fflush(stdout);
  }
  fmt::print("  time ~ particles^{:.2f}, of the processor particles^{:.2f}\n\n",
             fitted_exponent(particles, seconds), fitted_exponent(particles, cpu_seconds));
}

void time_rest_shapes() {
  fmt::print("shapes at rest, 17 x 17, 0.4 m, 16 parameter sets:\n");
  for (const int corners : {2, 1}) {
    const Sheet on = sheet(17, 0.4, Start::lying, corners);
    std::vector<ParameterSet> sets(16, on.set);
    for (size_t n = 0; n < sets.size(); ++n)
      for (double& k : sets[n].springs.stiffness_n_per_m) k *= 1 + 1e-3 * static_cast<double>(n);
    const double step_s = 0.8 * stable_time_step_s(on.cloth, sets.back());
    std::vector<RelaxedCloth> relaxed;
    std::vector<Eigen::Matrix3Xd> rest;
    const double relax_s =
        best_seconds_of(3, [&] { relaxed = relax(on.cloth, sets, 9.81, 0, step_s); });
    const double rest_s = best_seconds_of(3, [&] { rest = rest_shapes(on.cloth, sets, 0); });
    const auto imbalance = [&](const Eigen::Matrix3Xd& shape) {
      HangingEnergy energy(HangingCloth::of(on.cloth, sets[0]));
      const HeldProjection held(on.cloth.mesh, on.cloth.held);
      MeshField gradient(energy.layout());
      HeldEnergy(energy, held).energy_and_gradient(MeshField::of(energy.layout(), shape), gradient);
      return norm(gradient) / energy.cloth().weight_n();
    };
    fmt::print(
        "  held at {}: relax() {:.1f} ms a set, imbalance {:.1e}; rest_shapes() {:.1f} ms, "
        "{:.1e}; apart by up to {:.2f} mm\n",
        corners == 2 ? "two corners" : "one corner", 1e3 * relax_s / 16,
        imbalance(relaxed[0].position_m), 1e3 * rest_s / 16, imbalance(rest[0]),
        1e3 * (relaxed[0].position_m - rest[0]).colwise().norm().maxCoeff());
  }
}

}  // namespace
}  // namespace clothfit

int main() {
  using namespace clothfit;
  time_kernels();
  for (const int side : {45, 81, 173}) time_methods(side, 1, Start::lying);
  time_methods(173, 1, Start::hung);
  time_growth();
  time_rest_shapes();
}
