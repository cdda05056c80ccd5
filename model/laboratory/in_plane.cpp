#include "model/laboratory/in_plane.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <numbers>

#include "model/laboratory/check_option.h"
#include "model/sheet/settle.h"
#include "model/sheet/sheet_energy.h"

namespace clothfit {
namespace {

/// A flat rectangle of cloth, some of it held, that a machine deforms in its plane.
class Machine {
 public:
  Machine(const MeasuredFabric& fabric, double width_m, double length_m, double spacing_m,
          const std::function<bool(const Eigen::Vector2d&)>& is_held)
      : mesh_(mesh_cloth(
            {.border_m = {sampled_m(rectangle_m(width_m, length_m), spacing_m)}, .line_m = {}},
            spacing_m)),
        energy_(mesh_, fabric),
        position_m_(Eigen::Matrix3Xd::Zero(3, mesh_.vertex_count())),
        gradient_n_(3, mesh_.vertex_count()) {
    energy_.set_gravity(Eigen::Vector3d::Zero());
    for (const auto& vertex : mesh_.material_m.colwise()) held_.push_back(is_held(vertex));
    position_m_.topRows<2>() = mesh_.material_m;
  }

  /// Deforms all vertices by the same `strain_more` of the plane, then lets the free ones go.
  MinimiseReason deform(const Eigen::Matrix2d& by, double load_n,
                        const std::function<bool()>& go_on) {
    position_m_.topRows<2>() = (by * position_m_.topRows<2>()).eval();
    SettleRule rule;
    rule.stop.gradient_n = 1e-7 * load_n;
    rule.stop.most_iterations = 500;
    rule.stop.lowest_energy_j = -1;
    rule.load_n = load_n;
    rule.first_shift_per_s2 = 1e-3;
    if (go_on) rule.stop.go_on = [&](int, double) { return go_on(); };
    const MinimiseReason reason = settle(energy_, held_, rule, position_m_).reason;
    energy_.energy_and_gradient(position_m_, gradient_n_);
    return reason;
  }

  const ClothMesh& mesh() const { return mesh_; }
  const Eigen::Matrix3Xd& position_m() const { return position_m_; }
  const Eigen::Matrix3Xd& gradient_n() const { return gradient_n_; }

 private:
  static Eigen::Matrix2Xd rectangle_m(double width_m, double length_m) {
    Eigen::Matrix2Xd corners(2, 4);
    corners << 0, width_m, width_m, 0, 0, 0, length_m, length_m;
    return corners;
  }

  ClothMesh mesh_;
  SheetEnergy energy_;
  std::vector<bool> held_;
  Eigen::Matrix3Xd position_m_, gradient_n_;
};

}  // namespace

void StripTensionOptions::validate() const {
  check_option(width_m >= 0.01 && width_m <= 1, "StripTensionOptions::width_m", width_m,
               "metres, 0.01 to 1");
  check_option(length_m >= 0.02 && length_m <= 2, "StripTensionOptions::length_m", length_m,
               "metres, 0.02 to 2");
  check_option(spacing_m >= 1e-3 && spacing_m <= 0.25 * std::min(width_m, length_m),
               "StripTensionOptions::spacing_m", spacing_m,
               "metres, from 0.001 to a quarter of the shorter side");
  check_option(largest_strain > 0 && largest_strain <= 0.5, "StripTensionOptions::largest_strain",
               largest_strain, "a share of the length, 0 to 0.5");
  check_option(points >= 1 && points <= 1000, "StripTensionOptions::points", points, "1 to 1000");
}

void PictureFrameOptions::validate() const {
  check_option(side_m >= 0.02 && side_m <= 1, "PictureFrameOptions::side_m", side_m,
               "metres, 0.02 to 1");
  check_option(spacing_m >= 1e-3 && spacing_m <= 0.25 * side_m, "PictureFrameOptions::spacing_m",
               spacing_m, "metres, from 0.001 to a quarter of the side");
  check_option(largest_angle_deg > 0 && largest_angle_deg <= 45,
               "PictureFrameOptions::largest_angle_deg", largest_angle_deg, "degrees, 0 to 45");
  check_option(points >= 1 && points <= 1000, "PictureFrameOptions::points", points, "1 to 1000");
}

LoadCurve stretch_strip(const MeasuredFabric& fabric, ThreadDirection direction,
                        const StripTensionOptions& options) {
  options.validate();
  const MeasuredFabric along = direction == ThreadDirection::warp ? fabric : turned(fabric);
  Machine machine(
      along, options.width_m, options.length_m, options.spacing_m,
      [&](const Eigen::Vector2d& at) { return at.y() < 1e-9 || at.y() > options.length_m - 1e-9; });
  const auto at_end = [&](int v, double t_m) {
    return std::abs(machine.mesh().material_m(1, v) - t_m) < 1e-9;
  };
  LoadCurve curve{.reason = MinimiseReason::converged, .deformation = {0}, .force_n_per_m = {0}};
  double before = 1;
  for (int n = 1; n <= options.points && curve.usable(); ++n) {
    const double strain = options.largest_strain * n / options.points;
    const Eigen::Matrix2d by = Eigen::Vector2d(1, (1 + strain) / before).asDiagonal();
    before = 1 + strain;
    curve.reason =
        machine.deform(by, along.tension_warp_n_per_m * strain * options.width_m, options.go_on);
    double force_n = 0, least_m = options.width_m, most_m = 0;
    for (int v = 0; v < machine.mesh().vertex_count(); ++v) {
      if (at_end(v, options.length_m)) force_n += machine.gradient_n()(1, v);
      if (std::abs(machine.mesh().material_m(1, v) - 0.5 * options.length_m) > options.spacing_m)
        continue;
      least_m = std::min(least_m, machine.position_m()(0, v));
      most_m = std::max(most_m, machine.position_m()(0, v));
    }
    curve.deformation.push_back(strain);
    curve.force_n_per_m.push_back(force_n / options.width_m);
    if (n > 1) continue;
    curve.stiffness_n_per_m = curve.force_n_per_m.back() / strain;
    curve.lateral_contraction = (1 - (most_m - least_m) / options.width_m) / strain;
  }
  return curve;
}

LoadCurve shear_frame(const MeasuredFabric& fabric, const PictureFrameOptions& options) {
  options.validate();
  const double side_m = options.side_m;
  Machine machine(fabric, side_m, side_m, options.spacing_m, [&](const Eigen::Vector2d& at) {
    return at.minCoeff() < 1e-9 || at.maxCoeff() > side_m - 1e-9;
  });
  LoadCurve curve{.reason = MinimiseReason::converged, .deformation = {0}, .force_n_per_m = {0}};
  Eigen::Matrix2d before = Eigen::Matrix2d::Identity();
  for (int n = 1; n <= options.points && curve.usable(); ++n) {
    const double angle = options.largest_angle_deg * std::numbers::pi / 180 * n / options.points;
    // The bar along s stays, that along t leans by the angle and keeps its length.
    Eigen::Matrix2d now;
    now << 1, std::sin(angle), 0, std::cos(angle);
    const Eigen::Matrix2d by = now * before.inverse();
    before = now;
    curve.reason = machine.deform(by, fabric.shear_n_per_m * angle * side_m, options.go_on);
    // The work of leaning on: a vertex at height t moves by t (cos, -sin) per radian.
    double moment_n_m = 0;
    for (int v = 0; v < machine.mesh().vertex_count(); ++v) {
      const double t_m = machine.mesh().material_m(1, v);
      moment_n_m += t_m * (std::cos(angle) * machine.gradient_n()(0, v) -
                           std::sin(angle) * machine.gradient_n()(1, v));
    }
    curve.deformation.push_back(angle);
    curve.force_n_per_m.push_back(moment_n_m / (side_m * side_m));
    if (n == 1) curve.stiffness_n_per_m = curve.force_n_per_m.back() / angle;
  }
  return curve;
}

}  // namespace clothfit
