#include "model/laboratory/cantilever.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "model/laboratory/check_option.h"
#include "model/sheet/settle.h"
#include "model/sheet/sheet_energy.h"

namespace clothfit {
namespace {

struct Hanging {
  MinimiseReason reason = MinimiseReason::iterations_used_up;
  double angle_rad = 0;  ///< of the line from the edge to the strip's end, below the horizontal
};

/// Lets a strip hang over an edge at t = 0.
Hanging hang(const MeasuredFabric& fabric, double overhang_m, const CantileverOptions& options) {
  const double spacing_m = overhang_m / options.cells;
  const double width_m = spacing_m * std::max(2.0, std::round(options.width_m / spacing_m));
  Eigen::Matrix2Xd corners(2, 4);
  corners << 0, width_m, width_m, 0, 0, 0, overhang_m, overhang_m;
  const ClothMesh mesh =
      mesh_cloth({.border_m = {sampled_m(corners, spacing_m)}, .line_m = {}}, spacing_m);
  // The strip leaves the edge level.
  std::vector<bool> held;
  Eigen::Matrix3Xd position_m(3, mesh.vertex_count());
  for (int v = 0; v < mesh.vertex_count(); ++v) {
    held.push_back(mesh.material_m(1, v) == 0);
    position_m.col(v) << mesh.material_m.col(v), 0;
  }
  SheetEnergy energy(mesh, fabric, held);
  SettleRule rule;
  rule.stop.gradient_n = 1e-6 * energy.weight_n();
  rule.stop.most_iterations = 2000;
  rule.stop.lowest_energy_j = -std::numeric_limits<double>::infinity();
  rule.load_n = energy.weight_n();
  rule.first_shift_per_s2 = 10 * kGravity_m_per_s2 / overhang_m;
  if (options.go_on) rule.stop.go_on = [&](int, double) { return options.go_on(); };
  Hanging result;
  result.reason = settle(energy, held, rule, position_m).reason;
  double t_m = 0, z_m = 0;
  int ends = 0;
  for (int v = 0; v < mesh.vertex_count(); ++v)
    if (mesh.material_m(1, v) > overhang_m - 0.5 * spacing_m) {
      t_m += position_m(1, v);
      z_m += position_m(2, v);
      ++ends;
    }
  result.angle_rad = std::atan2(-z_m, t_m);
  return result;
}

}  // namespace

void CantileverOptions::validate() const {
  check_option(width_m >= 0.005 && width_m <= 0.2, "CantileverOptions::width_m", width_m,
               "metres, 0.005 to 0.2");
  check_option(angle_deg >= 5 && angle_deg <= 80, "CantileverOptions::angle_deg", angle_deg,
               "degrees, 5 to 80; 41.5");
  check_option(cells >= 8 && cells <= 200, "CantileverOptions::cells", cells, "8 to 200");
}

CantileverResult bend_cantilever(const MeasuredFabric& fabric, ThreadDirection direction,
                                 const CantileverOptions& options) {
  options.validate();
  const MeasuredFabric along = direction == ThreadDirection::warp ? fabric : turned(fabric);
  along.validate();
  const double wanted_rad = options.angle_deg * std::numbers::pi / 180;
  CantileverResult result;
  // The angle grows with the overhang. Peirce's formula gives the first guess; then the secant goes
  // on inside bounds.
  const double peirce = std::cbrt(std::cos(wanted_rad / 2) / (8 * std::tan(wanted_rad)));
  double guess_m = along.bending_length_warp_m() / peirce;
  double low_m = 0, low_rad = 0, high_m = std::numeric_limits<double>::infinity(), high_rad = 0;
  constexpr int kMostGuesses = 30;
  constexpr double kEnough_rad = 1e-5;
  for (int n = 0; n < kMostGuesses; ++n) {
    const Hanging hanging = hang(along, guess_m, options);
    result.reason = hanging.reason;
    if (hanging.reason != MinimiseReason::converged) return result;
    if (std::abs(hanging.angle_rad - wanted_rad) < kEnough_rad) {
      result.overhang_m = guess_m;
      result.bending_length_m = 0.5 * guess_m;
      result.bending_n_m =
          fabric.areal_density_kg_per_m2 * kGravity_m_per_s2 * std::pow(result.bending_length_m, 3);
      return result;
    }
    if (hanging.angle_rad < wanted_rad)
      low_m = guess_m, low_rad = hanging.angle_rad;
    else
      high_m = guess_m, high_rad = hanging.angle_rad;
    guess_m = std::isinf(high_m)
                  ? 1.3 * guess_m
                  : low_m + (wanted_rad - low_rad) / (high_rad - low_rad) * (high_m - low_m);
  }
  result.reason = MinimiseReason::iterations_used_up;
  return result;
}

}  // namespace clothfit
