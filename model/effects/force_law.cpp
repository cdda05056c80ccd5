#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "model/effects/vector_parameter.h"
#include "model/effects/vertex_law.h"

/// Adds an empirical force on every vertex. One part goes with its mass m, the other with its area
/// A along the surface's normal n; each is a sum of terms with a coefficient of its own,
///
///   F = m sum_k c_k a_k(v, place, height, time) + A sum_k c_k p_k(v, n, place)
///
/// a_k: drag -v, -|v| v, the same of the velocity v_t in the surface, and -v over the cloth's width
/// and height; the unit vectors x, y, z, alone, times the height above the world's origin and times
/// the recording's time. p_k: drag -v_n and -|v_n| v_n with v_n = (n . v) n; n, alone and over the
/// cloth; (n . x) n and its like of y and z, the pressure of air that blows along them. "Over the
/// cloth" means times 2 s / w - 1 or 2 t / h - 1, from -1 at one edge to 1 at the other.
///
/// The effect describes a force and names no cause. It is the dictionary of a sparse regression in
/// the manner of [brunton2016], from which a diagnosis proposes a law
/// (fit/diagnosis/proposed_law.h). Every coefficient is neutral at 0; those of the uniform drags
/// are never negative, for still air takes energy and gives none. Ours; see docs/effects.
namespace clothfit::force_law {
namespace {

/// Places of the coefficients in the description.
enum Coefficient : size_t {
  drag,
  drag_squared,
  normal_drag,
  normal_drag_squared,
  tangential_drag,
  tangential_drag_squared,
  drag_by_s,
  drag_by_t,
  push,  // a vector, as the others without a direction of their own
  normal_push = push + 3,
  normal_push_by_s,
  normal_push_by_t,
  pressure,
  push_by_height = pressure + 3,
  push_by_time = push_by_height + 3,
  coefficients = push_by_time + 3
};

struct Law {
  static constexpr int kParameters = coefficients;

  template <class Real>
  static Real length(const Vector3<Real>& v) {
    using std::sqrt;
    // Where the root's derivative is infinite it must not be taken.
    const Real square = dot(v, v);
    const auto some = square > Real(1e-30);
    return select(some, sqrt(select(some, square, Real(1.0))), Real(0.0));
  }

  template <class Real>
  static Vector3<Real> force(const VertexSight<Real>& at, const std::array<Real, coefficients>& c) {
    const auto vector = [&](size_t first) {
      return Vector3<Real>{c[first], c[first + 1], c[first + 2]};
    };
    const Real along_s(2 * at.s - 1), along_t(2 * at.t - 1);
    const Vector3<Real> n = direction(at.area_m2);
    const Vector3<Real>& v = at.velocity_m_per_s;
    const Real normal_speed = dot(n, v);
    const Vector3<Real> v_n = normal_speed * n, v_t = v - v_n;
    const Real height = -dot(direction(at.gravity_m_per_s2), at.position_m);

    const Real any =
        c[drag] + c[drag_squared] * length(v) + along_s * c[drag_by_s] + along_t * c[drag_by_t];
    const Real normal =
        c[normal_drag] +
        c[normal_drag_squared] * select(normal_speed > Real(0.0), normal_speed, -normal_speed);
    const Real tangential = c[tangential_drag] + c[tangential_drag_squared] * length(v_t);
    const Real blowing = dot(n, vector(pressure)) + c[normal_push] + along_s * c[normal_push_by_s] +
                         along_t * c[normal_push_by_t];
    return at.mass_kg * (vector(push) + height * vector(push_by_height) +
                         Real(at.time_s) * vector(push_by_time) - any * v - tangential * v_t) +
           dot(at.area_m2, n) * (blowing * n - normal * v_n);
  }

  /// A push along the normal turns with the surface: stiffness of the order of itself by a spacing.
  static EffectRates rates(const Cloth& cloth, const SpringParameters&,
                           const std::vector<double>& c) {
    constexpr double kFastest_m_per_s = 20;  // of the tip of a cracking cloth
    const auto size = [&](size_t k) { return std::abs(c[k]); };
    const auto size_of_vector = [&](size_t k) { return std::hypot(c[k], c[k + 1], c[k + 2]); };
    const double per_mass = size(drag) + size(drag_by_s) + size(drag_by_t) + size(tangential_drag) +
                            (size(drag_squared) + size(tangential_drag_squared)) * kFastest_m_per_s;
    const double per_area = size(normal_drag) + size(normal_drag_squared) * kFastest_m_per_s;
    const double along_normal = size(normal_push) + size(normal_push_by_s) +
                                size(normal_push_by_t) + size_of_vector(pressure);
    const double spacing_m = std::min(cloth.mesh.spacing_s_m(), cloth.mesh.spacing_t_m());
    const double area_per_mass = largest_area_per_mass(cloth);
    return {.damping_per_s = per_mass + per_area * area_per_mass,
            .frequency2_per_s2 =
                along_normal * area_per_mass / spacing_m + size_of_vector(push_by_height)};
  }
};

/// Returns the coefficients. Their factors are of a force per mass, a, or per area, p.
std::vector<EffectParameter> parameters() {
  const auto of = [](const char* name, const char* unit, double lower, double upper, double typical,
                     const char* side, const char* factor) {
    return EffectParameter{.name = name,
                           .unit = unit,
                           .lower = lower,
                           .upper = upper,
                           .typical = typical,
                           .law_side = side,
                           .law_factor = factor};
  };
  std::vector<EffectParameter> all{
      of("drag", "1/s", 0, 30, 0.1, "a", "-v"),
      of("drag_squared", "1/m", 0, 30, 0.1, "a", "-|v| v"),
      of("normal_drag", "Pa s/m", 0, 5, 0.02, "p", "-(n.v) n"),
      of("normal_drag_squared", "kg/m3", 0, 5, 0.05, "p", "-|n.v| (n.v) n"),
      of("tangential_drag", "1/s", 0, 30, 0.1, "a", "-v_t"),
      of("tangential_drag_squared", "1/m", 0, 30, 0.1, "a", "-|v_t| v_t"),
      of("drag_by_s", "1/s", -5, 5, 0.1, "a", "-(2s/w - 1) v"),
      of("drag_by_t", "1/s", -5, 5, 0.1, "a", "-(2t/h - 1) v"),
  };
  const auto add_vector = [&](const EffectParameter& each,
                              const std::array<const char*, 3>& factors) {
    std::vector<EffectParameter> three = vector_parameter(each);
    for (size_t axis = 0; axis < 3; ++axis) {
      three[axis].law_factor = factors[axis];
      all.push_back(std::move(three[axis]));
    }
  };
  add_vector(of("push", "m/s2", -5, 5, 0.05, "a", ""), {"x", "y", "z"});
  all.push_back(of("normal_push", "Pa", -3, 3, 0.02, "p", "n"));
  all.push_back(of("normal_push_by_s", "Pa", -3, 3, 0.02, "p", "(2s/w - 1) n"));
  all.push_back(of("normal_push_by_t", "Pa", -3, 3, 0.02, "p", "(2t/h - 1) n"));
  add_vector(of("pressure", "Pa", -3, 3, 0.05, "p", ""), {"(n.x) n", "(n.y) n", "(n.z) n"});
  add_vector(of("push_by_height", "1/s2", -10, 10, 0.1, "a", ""),
             {"height x", "height y", "height z"});
  add_vector(of("push_by_time", "m/s3", -5, 5, 0.1, "a", ""), {"time x", "time y", "time z"});
  assert(all.size() == coefficients);
  return all;
}

}  // namespace

EffectDescription describe() {
  EffectDescription effect{
      .name = "force_law",
      .summary =
          "an empirical force, F = m sum c_k a_k + A sum c_k p_k of velocity, normal, place, "
          "height and time",
      .parameters = parameters(),
      .empirical = true};
  // A vector is one mode, any other coefficient one by itself.
  for (size_t k = 0; k < coefficients;) {
    const std::string& name = effect.parameters[k].name;
    if (name.ends_with("_x")) {
      effect.modes.push_back(
          {.name = name.substr(0, name.size() - 2),
           .amplitudes = {name, effect.parameters[k + 1].name, effect.parameters[k + 2].name},
           .shapes = {}});
      k += 3;
    } else {
      effect.modes.push_back({.name = name, .amplitudes = {name}, .shapes = {}});
      ++k;
    }
  }
  return effect;
}

std::unique_ptr<Effect> make() {
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::force_law
