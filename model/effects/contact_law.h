#pragma once

#include <array>
#include <cmath>

#include "model/cloth/effect.h"
#include "model/effects/number.h"
#include "model/effects/vertex_law.h"

namespace clothfit {

/// The force of an obstacle on a vertex.
///
///   F = N n - friction N v_t / sqrt(v_t^2 + (friction N / (rate m))^2)
///   N = A max(stiffness depth - damping v_n depth / (depth + soft), 0) where depth > 0, else 0
///
/// soft = 1 mm: over such a depth the dashpot sets in, so that a touch has no jump and the motion
/// after it has a derivative by the obstacle's place. depth (m): how far the vertex is inside the
/// obstacle; n: the obstacle's outward unit normal there; v_n = n . v and v_t = v - v_n n: velocity
/// of the vertex against the obstacle, which rests; A: the area that belongs to the vertex in the
/// flat cloth; m its mass. The obstacle pushes, never pulls.
///
/// Source: penalty of the depth with a dashpot, Coulomb's friction. Friction is smoothed where
/// sliding changes its sign, at the speed below which it would damp faster than `rate`: there it is
/// viscous, -rate m v_t. So steps stay stable whatever presses. Cloth that should stick creeps, on
/// a slope of angle a at g sin(a) / rate times 1 / sqrt(1 - (tan(a) / friction)^2).
struct Contact {
  static constexpr int kParameters = 3;  ///< stiffness, damping, friction come first
  static constexpr double kFrictionRate_per_s = 2000;
  static constexpr double kSoft_m = 1e-3;
  /// At this speed the dashpot that sets in stiffens the contact as much as steps allow for.
  static constexpr double kFast_m_per_s = 1;

  template <class Real>
  static Vector3<Real> force(const Real& depth_m, const Vector3<Real>& normal,
                             const Vector3<Real>& velocity_m_per_s, double area_m2,
                             const Real& mass_kg, const Real& stiffness_pa_per_m,
                             const Real& damping_pa_s_per_m, const Real& friction) {
    using std::sqrt;
    const Real none(0.0);
    const Real leaving = dot(normal, velocity_m_per_s);
    const Real inside = select(depth_m > none, depth_m, none);
    Real pressure = stiffness_pa_per_m * depth_m -
                    damping_pa_s_per_m * leaving * (inside / (inside + Real(kSoft_m)));
    // At neutral the force is exactly nothing; its derivative by the stiffness is that of a push.
    pressure = select(pressure < none, none, pressure);
    const Real press_n = Real(area_m2) * select(depth_m > none, pressure, none);

    const Vector3<Real> sliding = velocity_m_per_s - leaving * normal;
    const Real most_n = friction * press_n;
    const Real viscous_speed = Real(1.0) / (Real(kFrictionRate_per_s) * mass_kg) * most_n;
    const Real square = dot(sliding, sliding) + viscous_speed * viscous_speed;
    // Where the root's derivative is infinite it must not be taken.
    const auto some = square > Real(1e-30);
    const Real drag = select(some, most_n / sqrt(select(some, square, Real(1.0))), none);
    return press_n * normal - drag * sliding;
  }

  /// `parameters` are stiffness, damping, friction, and whatever follows.
  static EffectRates rates(const Cloth& cloth, const std::vector<double>& parameters) {
    const auto [stiffness, damping, friction] =
        std::array{parameters[0], parameters[1], parameters[2]};
    // Friction grows with the pressure, so it adds to the force that answers motion along the
    // normal.
    const double most = (1 + friction) * largest_area_per_mass(cloth);
    const bool rubs = friction > 0 && (stiffness > 0 || damping > 0);
    return {.damping_per_s = most * damping + (rubs ? kFrictionRate_per_s : 0),
            .frequency2_per_s2 = most * (stiffness + damping * kFast_m_per_s / kSoft_m)};
  }

  /// An obstacle in an unknown place, which the parameters named say. It does not rub.
  static std::vector<EffectMode> modes(const std::vector<std::string>& place) {
    EffectMode mode{.name = "", .amplitudes = {"stiffness", "damping"}, .shapes = {}};
    for (const std::string& parameter : place)
      mode.shapes.push_back({.parameter = parameter, .values = {}, .from_pushes = true});
    return {mode};
  }

  static std::vector<EffectParameter> parameters() {
    return {
        {.name = "stiffness",
         .unit = "Pa/m",
         .neutral = 0,
         .lower = 0,
         .upper = 1e5,
         .typical = 1000},
        {.name = "damping", .unit = "Pa s/m", .neutral = 0, .lower = 0, .upper = 250, .typical = 1},
        {.name = "friction",
         .unit = "ratio",
         .neutral = 0,
         .lower = 0,
         .upper = 2,
         .typical = 0.1}};
  }
};

}  // namespace clothfit
