#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "model/cloth/wording.h"
#include "model/effects/harmonic.h"
#include "model/effects/vertex_law.h"

/// Lets a wind press on the surface that differs from place to place and from time to time. At
/// every vertex
///
///   F = A [P + n . q (1 + w) / 2] n,   w = sin(2 pi (f t + phase))
///   P = p + p_s a + p_t b + slope . x + w (h + h_s a + h_t b)
///
/// A is the area that belongs to the vertex, n its unit normal (along s x t), x its place in the
/// world, t the recording's time (s). a and b run from -1 at one edge of the flat cloth to 1 at the
/// other, a from left to right along s, b from top to bottom along t.
///
/// Ours. The cloth takes a plane of pressure along: p, p_s and p_t, and h, h_s and h_t, which swing
/// between both signs. Another plane, p and slope, stands in the world, with p at its origin. A
/// wind of pulses comes and goes between nothing and q, the pressure on a sheet that faces it: half
/// of it is steady, half a harmonic. It presses as the founding paper's fluid force on a sheet at
/// rest, A (n . q) n [louchet1995, section 2.2].
///
/// Parameters: p, p_s, p_t, h, h_s, h_t and q_x, q_y, q_z (Pa), slope_x, slope_y, slope_z (Pa/m),
/// all neutral at 0; frequency f (Hz) and phase (turns), which matter only where an h or q does.
namespace clothfit::wind_field {
namespace {

/// Places of the parameters in the description.
enum Parameter : size_t {
  steady,
  steady_s,
  steady_t,
  slope,  // a vector
  swinging = slope + 3,
  swinging_s,
  swinging_t,
  pulsing,  // a vector
  frequency = pulsing + 3,
  phase,
  kCount
};

/// The field at one moment.
template <class Real>
struct Field {
  Real pressure_pa, by_s_pa, by_t_pa;  ///< over the cloth
  Vector3<Real> slope_pa_per_m;        ///< in the world
  Vector3<Real> wind_pa;
};

struct Law {
  static constexpr int kParameters = kCount;
  static constexpr LooksAt kLooksAt{.position = true, .area = true};

  template <class Real>
  static Field<Real> at_moment(const std::array<Real, kCount>& p, double time_s) {
    const Real wave = sine_of_turns(p[frequency] * Real(time_s) + p[phase]);
    const Real share = Real(0.5) * (Real(1.0) + wave);
    return {.pressure_pa = p[steady] + wave * p[swinging],
            .by_s_pa = p[steady_s] + wave * p[swinging_s],
            .by_t_pa = p[steady_t] + wave * p[swinging_t],
            .slope_pa_per_m = {p[slope], p[slope + 1], p[slope + 2]},
            .wind_pa = share * Vector3<Real>{p[pulsing], p[pulsing + 1], p[pulsing + 2]}};
  }

  template <class Real>
  static Vector3<Real> force(const VertexSight<Real>& at, const Field<Real>& field) {
    const Real plane = field.pressure_pa + Real(2 * at.s - 1) * field.by_s_pa +
                       Real(2 * at.t - 1) * field.by_t_pa +
                       dot(field.slope_pa_per_m, at.position_m);
    // A vertex whose surface is folded to nothing catches no wind.
    return plane * at.area_m2 + dot(at.area_m2, field.wind_pa) * direction(at.area_m2);
  }

  /// A push along the normal turns with the surface: stiffness of the order of itself by a spacing.
  static EffectRates rates(const Cloth& cloth, const SpringParameters&,
                           const std::vector<double>& p) {
    constexpr double kReach_m = 2;  // of cloth from the world's origin
    const auto size_of_vector = [&](size_t k) { return std::hypot(p[k], p[k + 1], p[k + 2]); };
    double along_normal_pa = size_of_vector(slope) * kReach_m + size_of_vector(pulsing);
    for (const Parameter k : {steady, steady_s, steady_t, swinging, swinging_s, swinging_t})
      along_normal_pa += std::abs(p[k]);
    const double spacing_m = std::min(cloth.mesh.spacing_s_m(), cloth.mesh.spacing_t_m());
    return {.frequency2_per_s2 = (along_normal_pa / spacing_m + size_of_vector(slope)) *
                                 largest_area_per_mass(cloth)};
  }
};

EffectParameter amplitude(const char* name, const char* unit, double reach, double typical) {
  return {.name = name,
          .unit = unit,
          .neutral = 0,
          .lower = -reach,
          .upper = reach,
          .typical = typical};
}

std::vector<EffectParameter> parameters() {
  std::vector<EffectParameter> all{amplitude("p", "Pa", 10, 0.05), amplitude("p_s", "Pa", 5, 0.05),
                                   amplitude("p_t", "Pa", 5, 0.05)};
  std::ranges::copy(vector_parameter(amplitude("slope", "Pa/m", 10, 0.2)), std::back_inserter(all));
  for (const char* name : {"h", "h_s", "h_t"}) all.push_back(amplitude(name, "Pa", 5, 0.05));
  std::ranges::copy(Harmonic::parameters(amplitude("q", "Pa", 5, 0.05)), std::back_inserter(all));
  return all;
}

std::vector<EffectMode> modes() {
  EffectMode harmonic = Harmonic::modes("q").front(), pulse = harmonic;
  harmonic.name = "harmonic";
  harmonic.beside = {"wind", "gust", "wind_field"};
  harmonic.amplitudes = {"h", "h_s", "h_t"};
  // A pulse at any phase is no sum of those at two. Its phase stands first, so that none is taken
  // for a harmonic (Harmonic::is_followed_by). Half a turn more is not the other sign, so phases go
  // all round. Of more than four pulses a cloth feels little but their mean.
  pulse.name = "pulse";
  pulse.shapes = {
      {.parameter = "phase", .values = {-0.375, -0.125, 0.125, 0.375}},
      {.parameter = "frequency", .values = {0.5, 1, 1.5, 2, 3, 4}, .per_duration = true}};
  return {{.name = "cloth",
           .amplitudes = {"p", "p_s", "p_t"},
           .shapes = {},
           .beside = {"wind", "gust", "wind_field"}},
          {.name = "world",
           .amplitudes = {"p", "slope_x", "slope_y", "slope_z"},
           .shapes = {},
           .beside = {"wind", "gust", "wind_field"}},
          std::move(harmonic),
          std::move(pulse)};
}

/// Tells the pressure: its largest over the cloth or in time, and which way it grows in the world.
std::string in_words(const FittedEffect& found) {
  const auto of = [&](const char* name) { return found.value(name); };
  if (found.mode == "pulse") {
    const Eigen::Vector3d q = found.vector("q");
    if (q.isZero(0)) return {};
    return "pulses of " + rounded(q.norm()) + " Pa towards " + unit_vector(q) + ", " +
           rounded(of("frequency")) + " a second";
  }
  if (found.mode == "harmonic") {
    const double most = std::abs(of("h")) + std::abs(of("h_s")) + std::abs(of("h_t"));
    if (most == 0) return {};
    return "to and fro by up to " + rounded(most) + " Pa, " + rounded(of("frequency")) +
           " times a second";
  }
  if (found.mode == "cloth") {
    const double changes = std::abs(of("p_s")) + std::abs(of("p_t"));
    if (of("p") == 0 && changes == 0) return {};
    return "from " + rounded(of("p") - changes) + " to " + rounded(of("p") + changes) +
           " Pa over the cloth";
  }
  const Eigen::Vector3d slope = found.vector("slope");
  if (of("p") == 0 && slope.isZero(0)) return {};
  std::string text = rounded(of("p")) + " Pa at the world's origin";
  if (!slope.isZero(0))
    text += ", " + rounded(slope.norm()) + " Pa more a metre towards " + unit_vector(slope);
  return text;
}

}  // namespace

EffectDescription describe() {
  return {.name = "wind_field",
          .summary = "wind that varies over place and time, F = A [P + n . q (1 + w) / 2] n",
          .parameters = parameters(),
          .test = EffectTest::profiled,
          .modes = modes(),
          .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<VertexLawEffect<Law>>();
}

}  // namespace clothfit::wind_field
