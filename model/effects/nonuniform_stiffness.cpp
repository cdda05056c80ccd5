#include <algorithm>

#include "model/cloth/network_bound.h"
#include "model/cloth/wording.h"
#include "model/effects/spring_law.h"

/// Varies the stiffness over the cloth by a relative change of every spring and its dashpot:
///
///   tension += (f - 1) (k (l - l0) + c dl/dt)
///   f = (1 + patch b(|(s, t) - centre| / radius)) (1 + edge b(d / edge_width))
///       (1 + gradient_s (2 s - 1)) (1 + gradient_t (2 t - 1))
///       (1 + rectangle w(|s - rectangle_s|, rectangle_half_s)
///                      w(|t - rectangle_t|, rectangle_half_t))
///   b(x) = (1 - x^2)^3 where x < 1, else 0
///   w(d, h) = S((h - d) / (1/16) + 1/2),  S(u) = 3 u^2 - 2 u^3, u held between 0 and 1
///
/// (s, t) is the spring's middle and d its distance from the border, all in shares of the cloth's
/// width and height. As a product of positive factors f stays positive within the bounds.
/// Amplitudes (patch, edge, gradient_s, gradient_t, rectangle; ratios) are neutral at 0; all others
/// are places and sizes. A piece sewn or printed on is a rectangle. Ours; b is a bump of plain
/// arithmetic that is twice differentiable, so that its place can be fitted.
namespace clothfit::nonuniform_stiffness {
namespace {

enum Parameter : size_t {
  patch,
  patch_s,
  patch_t,
  patch_radius,
  edge,
  edge_width,
  gradient_s,
  gradient_t,
  rectangle,
  rectangle_s,
  rectangle_t,
  rectangle_half_s,
  rectangle_half_t,
  kCount
};

/// A rectangle's edge is as wide as the springs of a mesh of 17 vertices a side, in shares of the
/// cloth: a sharper one could not be placed between them.
constexpr double kRectangleEdge = 1.0 / 16;

template <class Real>
Real bump(const Real& square) {
  const Real rest = select(square < Real(1.0), Real(1.0) - square, Real(0.0));
  return rest * rest * rest;
}

/// Returns 1 well within `half` of the middle, 0 well beyond, and a half there.
template <class Real>
Real within(double at, const Real& middle, const Real& half) {
  const Real none(0.0), one(1.0);
  const Real off = Real(at) - middle;
  const Real distance = select(off < none, none - off, off);
  const Real inside = (half - distance) / Real(kRectangleEdge) + Real(0.5);
  const Real begun = select(inside > none, inside, none);
  const Real u = select(begun < one, begun, one);
  return u * u * (Real(3.0) - Real(2.0) * u);
}

/// Returns the factor on the stiffness of a spring whose middle is at (s, t).
template <class Real>
Real factor(double s, double t, const std::array<Real, kCount>& p) {
  const Real from_s = (Real(s) - p[patch_s]) / p[patch_radius],
             from_t = (Real(t) - p[patch_t]) / p[patch_radius];
  const Real from_border = Real(std::min({s, 1 - s, t, 1 - t})) / p[edge_width];
  return (Real(1.0) + p[patch] * bump(from_s * from_s + from_t * from_t)) *
         (Real(1.0) + p[edge] * bump(from_border * from_border)) *
         (Real(1.0) + p[gradient_s] * Real(2 * s - 1)) *
         (Real(1.0) + p[gradient_t] * Real(2 * t - 1)) *
         (Real(1.0) + p[rectangle] * within(s, p[rectangle_s], p[rectangle_half_s]) *
                          within(t, p[rectangle_t], p[rectangle_half_t]));
}

struct Law {
  static constexpr int kParameters = kCount, kMemory = 0;
  static constexpr bool kThroughPlace = true;

  template <class Real>
  static Real of_place(double s, double t, const std::array<Real, kCount>& p) {
    return factor(s, t, p);
  }

  template <class Real>
  static Real tension(const SpringSight<Real>& at, const std::array<Real, kCount>&,
                      std::array<Real, 0>&) {
    return (at.of_place - Real(1.0)) * (at.stiffness_n_per_m * (at.length_m - at.natural_length_m) +
                                        at.damping_ns_per_m * at.stretching_m_per_s);
  }

  static EffectRates rates(const Cloth& cloth, const SpringParameters& springs,
                           const std::vector<double>& parameters) {
    std::array<double, kCount> p;
    std::ranges::copy(parameters, p.begin());
    const auto bound = [&](const std::array<double, kSpringTypes>& constant) {
      return network_bound(cloth, [&](SpringType type, const Spring& spring) {
        const auto [s, t] = middle_of(cloth.mesh, spring);
        return std::max(0.0, factor(s, t, p) - 1) * constant[static_cast<size_t>(type)];
      });
    };
    return {.damping_per_s = bound(springs.damping_ns_per_m),
            .frequency2_per_s2 = bound(springs.stiffness_n_per_m)};
  }
};

/// Tells from where to where on the cloth the rectangle reaches.
std::string extent_of(const FittedEffect& found) {
  const auto side = [&](const std::string& axis, double length_m) {
    const double middle = found.value("rectangle_" + axis);
    const double half = found.value("rectangle_half_" + axis);
    return millimetres(std::max(0.0, middle - half) * length_m) + " to " +
           millimetres(std::min(1.0, middle + half) * length_m);
  };
  return "from " + side("s", found.mesh.width_m) + " off the left and " +
         side("t", found.mesh.height_m) + " off the top edge";
}

/// Tells the factor in the middle of the patch, on the border, or at opposite edges.
std::string in_words(const FittedEffect& found) {
  const auto times = [](double excess) { return rounded(1 + excess) + " times as stiff "; };
  if (found.mode == "gradient") {
    const auto ends = [&](double gradient, const std::string& first, const std::string& last) {
      if (gradient == 0) return std::string();
      return times(-gradient) + first + " and " + rounded(1 + gradient) + " times " + last;
    };
    return listed({ends(found.value("gradient_s"), "on the left", "on the right"),
                   ends(found.value("gradient_t"), "at the top", "at the bottom")});
  }
  if (found.mode == "edge")
    return found.value("edge") == 0 ? "" : times(found.value("edge")) + "on the border";
  if (found.value(found.mode) == 0) return {};
  if (found.mode == "rectangle") return times(found.value("rectangle")) + extent_of(found);
  return times(found.value("patch")) + "at " +
         place_on_cloth({found.value("patch_s") * found.mesh.width_m,
                         found.value("patch_t") * found.mesh.height_m});
}

}  // namespace

EffectDescription describe() {
  const auto amplitude = [](const char* name, double upper) {
    return EffectParameter{
        .name = name, .unit = "1", .neutral = 0, .lower = -0.9, .upper = upper, .typical = 0.1};
  };
  const auto place = [](const char* name, double neutral, double lower, double upper) {
    return EffectParameter{.name = name,
                           .unit = "1",
                           .neutral = neutral,
                           .lower = lower,
                           .upper = upper,
                           .typical = 0.05};
  };
  return {
      .name = "nonuniform_stiffness",
      .summary = "stiffness that varies over the cloth, T = (f(s, t) - 1) (k (l - l0) + c dl/dt)",
      .parameters = {amplitude("patch", 5), place("patch_s", 0.5, 0, 1),
                     place("patch_t", 0.5, 0, 1), place("patch_radius", 0.3, 0.1, 1),
                     amplitude("edge", 5), place("edge_width", 0.15, 0.05, 0.5),
                     amplitude("gradient_s", 0.9), amplitude("gradient_t", 0.9),
                     amplitude("rectangle", 5), place("rectangle_s", 0.5, 0, 1),
                     place("rectangle_t", 0.5, 0, 1), place("rectangle_half_s", 0.25, 0.05, 1),
                     place("rectangle_half_t", 0.25, 0.05, 1)},
      .test = EffectTest::profiled,
      .modes =
          {{.name = "patch",
            .amplitudes = {"patch"},
            .shapes = {{.parameter = "patch_s", .values = {0.2, 0.5, 0.8}, .over_cloth = true},
                       {.parameter = "patch_t", .values = {0.2, 0.5, 0.8}, .over_cloth = true},
                       {.parameter = "patch_radius", .values = {0.2, 0.4}, .over_cloth = true}}},
           {.name = "edge",
            .amplitudes = {"edge"},
            .shapes = {{.parameter = "edge_width", .values = {0.1, 0.25}, .over_cloth = true}}},
           {.name = "gradient", .amplitudes = {"gradient_s", "gradient_t"}, .shapes = {}},
           {.name = "rectangle",
            .amplitudes = {"rectangle"},
            .shapes = {{.parameter = "rectangle_s", .values = {0.2, 0.5, 0.8}, .over_cloth = true},
                       {.parameter = "rectangle_t", .values = {0.2, 0.5, 0.8}, .over_cloth = true},
                       {.parameter = "rectangle_half_s", .values = {0.25}, .over_cloth = true},
                       {.parameter = "rectangle_half_t", .values = {0.25}, .over_cloth = true}}}},
      .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<SpringLawEffect<Law>>();
}

}  // namespace clothfit::nonuniform_stiffness
