#include "model/garment/mannequin.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "data/input_error.h"
#include "model/garment/surface_nets.h"

namespace clothfit {
namespace {

/// The body whose parts stand below: others are scaled from it.
constexpr MannequinSize kDrawn;

/// A horizontal section of the torso: an ellipse, and the girth with which it grows.
struct Section {
  double height_m = 0, half_width_m = 0, half_depth_m = 0, forward_m = 0;
  enum Girth { waist, hips, bust, none } girth = none;
};
constexpr std::array kTorso{
    Section{0.765, 0.060, 0.035, -0.010, Section::hips},
    Section{0.795, 0.130, 0.098, -0.014, Section::hips},
    Section{0.835, 0.172, 0.134, -0.016, Section::hips},
    Section{0.875, 0.181, 0.143, -0.014, Section::hips},
    Section{0.960, 0.168, 0.126, -0.006, Section::hips},
    Section{1.085, 0.148, 0.115, 0.002, Section::waist},
    Section{1.150, 0.152, 0.117, 0.004, Section::waist},
    Section{1.210, 0.162, 0.120, 0.004, Section::bust},
    Section{1.290, 0.170, 0.115, 0.000, Section::bust},
    Section{1.350, 0.165, 0.095, -0.006, Section::none},
    Section{1.395, 0.135, 0.072, -0.012, Section::none},
    Section{1.430, 0.092, 0.058, -0.014, Section::none},
    Section{1.470, 0.060, 0.054, -0.010, Section::none},
};
using Sections = std::array<Section, kTorso.size()>;

/// Returns the torso's section at a height, between those of the table along a smooth curve.
Section section_at(double height_m, const Sections& sections) {
  int k = 1;
  const int last = static_cast<int>(sections.size()) - 1;
  const auto at = [&](int n) { return sections[static_cast<size_t>(std::clamp(n, 0, last))]; };
  while (k < last && at(k).height_m < height_m) ++k;
  const double step_m = at(k).height_m - at(k - 1).height_m;
  const double t = std::clamp((height_m - at(k - 1).height_m) / step_m, 0.0, 1.0), u = 1 - t;
  // Hermite's cubic with the slopes between a section's neighbours.
  const auto between = [&](double Section::*member) {
    const auto slope = [&](int of) {
      return (at(of + 1).*member - at(of - 1).*member) /
             (at(of + 1).height_m - at(of - 1).height_m);
    };
    return (1 + 2 * t) * u * u * (at(k - 1).*member) + t * t * (3 - 2 * t) * (at(k).*member) +
           step_m * t * u * (u * slope(k - 1) - t * slope(k));
  };
  return {height_m, between(&Section::half_width_m), between(&Section::half_depth_m),
          between(&Section::forward_m), Section::none};
}

/// About the distance to the cone between two spheres.
double round_cone_m(const Eigen::Vector3d& point_m, const Eigen::Vector3d& from_m, double from_r_m,
                    const Eigen::Vector3d& to_m, double to_r_m) {
  const Eigen::Vector3d along = to_m - from_m;
  const double share = std::clamp((point_m - from_m).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (point_m - from_m - share * along).norm() - from_r_m - share * (to_r_m - from_r_m);
}

/// About the distance to an ellipsoid.
double ellipsoid_m(const Eigen::Vector3d& point_m, const Eigen::Vector3d& centre_m,
                   const Eigen::Vector3d& radius_m) {
  const Eigen::Vector3d offset = point_m - centre_m;
  const double scaled = offset.cwiseQuotient(radius_m).norm();
  const double slope = offset.cwiseQuotient(radius_m.cwiseAbs2()).norm();
  return slope > 0 ? scaled * (scaled - 1) / slope : -radius_m.minCoeff();
}

/// The smaller of two distances; edges where both are alike are melted over this width.
double melted(double a, double b, double width_m) {
  const double share = std::max(width_m - std::abs(a - b), 0.0) / width_m;
  return std::min(a, b) - 0.25 * width_m * share * share;
}

class MannequinShape {
 public:
  explicit MannequinShape(const MannequinSize& size)
      : scale_(size.height_m / kDrawn.height_m),
        bust_grown_(size.bust_m / kDrawn.bust_m / scale_),
        arm_rad_(size.arm_rad),
        sections_(kTorso) {
    for (Section& section : sections_) {
      const double grown = section.girth == Section::waist  ? size.waist_m / kDrawn.waist_m
                           : section.girth == Section::hips ? size.hips_m / kDrawn.hips_m
                           : section.girth == Section::bust ? size.bust_m / kDrawn.bust_m
                                                            : scale_;
      section.half_width_m *= grown / scale_;
      section.half_depth_m *= grown / scale_;
    }
  }

  /// About the distance to the body's surface, < 0 inside.
  double operator()(const Eigen::Vector3d& world_m) const {
    Eigen::Vector3d p = world_m / scale_;
    p.x() = std::abs(p.x());
    double body_m = melted(torso_m(p), legs_m(p), 0.05);
    body_m = melted(body_m, breasts_m(p), 0.05);
    body_m = melted(body_m, arms_m(p), 0.05);
    return scale_ * melted(body_m, head_m(p), 0.04);
  }

 private:
  double torso_m(const Eigen::Vector3d& p) const {
    const Section section = section_at(p.z(), sections_);
    const double x = p.x() / section.half_width_m,
                 y = (p.y() + section.forward_m) / section.half_depth_m;
    const double scaled = std::hypot(x, y);
    const double slope = std::hypot(x / section.half_width_m, y / section.half_depth_m);
    const double aside_m = slope > 0 ? scaled * (scaled - 1) / slope : -section.half_depth_m;
    const double beyond_m =
        std::max(p.z() - sections_.back().height_m, sections_.front().height_m - p.z());
    return beyond_m > 0 ? std::hypot(std::max(aside_m, 0.0), beyond_m)
                        : std::max(aside_m, beyond_m);
  }
  double breasts_m(const Eigen::Vector3d& p) const {
    return ellipsoid_m(p, {0.082, -0.080 * bust_grown_, 1.205},
                       Eigen::Vector3d(0.066, 0.066, 0.070) * bust_grown_);
  }
  static double legs_m(const Eigen::Vector3d& p) {
    const Eigen::Vector3d hip{0.088, 0.005, 0.80}, knee{0.095, 0.0, 0.46}, ankle{0.097, 0.02, 0.09};
    const double thigh_m = round_cone_m(p, hip, 0.092, knee, 0.060);
    const double calf_m = round_cone_m(p, knee, 0.060, ankle, 0.038);
    const double foot_m = ellipsoid_m(p, {0.105, -0.05, 0.038}, {0.045, 0.125, 0.038});
    return melted(melted(thigh_m, calf_m, 0.03), foot_m, 0.03);
  }
  double arms_m(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d shoulder{0.160, 0.012, 1.362},
        along{std::cos(arm_rad_), 0, -std::sin(arm_rad_)};
    const Eigen::Vector3d elbow = shoulder + 0.28 * along, wrist = shoulder + 0.54 * along;
    const double upper_m = round_cone_m(p, shoulder, 0.052, elbow, 0.041);
    const double lower_m = round_cone_m(p, elbow, 0.042, wrist, 0.027);
    const double hand_m = round_cone_m(p, wrist + 0.03 * along, 0.026, wrist + 0.13 * along, 0.022);
    return melted(melted(upper_m, lower_m, 0.02), hand_m, 0.02);
  }
  static double head_m(const Eigen::Vector3d& p) {
    const double neck_m = round_cone_m(p, {0, 0.012, 1.42}, 0.056, {0, 0.002, 1.52}, 0.053);
    return melted(neck_m, ellipsoid_m(p, {0, -0.012, 1.60}, {0.076, 0.096, 0.12}), 0.03);
  }

  double scale_, bust_grown_, arm_rad_;
  Sections sections_;
};

}  // namespace

void MannequinSize::validate() const {
  const auto check = [](const char* name, double value, double least, double most) {
    if (!(value >= least && value <= most))
      throw InputError(std::string("MannequinSize::") + name, fmt::format("it is {:g}", value),
                       fmt::format("{:g} to {:g}", least, most));
  };
  check("height_m", height_m, 0.5, 2.5);
  check("bust_m", bust_m, 0.4, 2);
  check("waist_m", waist_m, 0.3, 2);
  check("hips_m", hips_m, 0.4, 2);
  check("arm_rad", arm_rad, 0, 0.5 * std::numbers::pi);
}

TriangleMesh make_mannequin(const MannequinSize& size, double spacing_m) {
  size.validate();
  if (!(spacing_m >= 2e-3 && spacing_m <= 0.05))
    throw InputError("spacing_m", fmt::format("it is {:g}", spacing_m), "0.002 to 0.05");
  // A girth's ellipse is less than half of it wide; arms reach farther than that.
  const double h = std::max(size.height_m, std::max({size.bust_m, size.waist_m, size.hips_m}));
  return zero_surface(MannequinShape(size), {-0.6 * h, -0.3 * h, -0.05 * h},
                      {0.6 * h, 0.3 * h, 1.05 * h}, spacing_m);
}

}  // namespace clothfit
