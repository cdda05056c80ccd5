#include <ceres/jet.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/cloth/wording.h"
#include "model/effects/law_effect.h"
#include "model/effects/linearisation.h"
#include "model/effects/number.h"
#include "model/effects/remembered.h"

/// Spreads the mass otherwise than stated. At a vertex that carries r times its stated mass the sum
/// F of all forces but the weight becomes F / r, so that it moves by g + F / (r m), with
///
///   r = (1 + h) (1 + gradient_s (s - 1/2)) (1 + gradient_t (t - 1/2)) (1 + patch B)
///   h = hem H + hem_left H_l + hem_right H_r + hem_top H_t + hem_bottom H_b
///
/// H is the share of the vertex's part of the flat cloth (its hat function's) that lies within
/// hem_width of the border, so that the hem's mass and its moment are the same on every mesh. H_l
/// to H_b are the shares of one edge (left: s = 0, top: t = 0). s, t: place on the cloth as shares
/// of its width and height. B = (1 - u^2)^3 for u < 1, else 0, with u the distance from (patch_s,
/// patch_t) over patch_radius in the flat cloth. Ours.
///
/// The total is not kept: a hem or a patch weighs on top of the stated mass; gradients leave it
/// alone. Forces that other effects state per mass belong to the stated mass. Parameters: hem,
/// hem_left, hem_right, hem_top, hem_bottom, gradient_s, gradient_t, patch (ratios), neutral at 0;
/// hem_width (m), patch_s, patch_t (shares) and patch_radius (m), which matter only where a hem or
/// patch does.
namespace clothfit::nonuniform_mass {
namespace {
enum Parameter {
  hem,
  hem_width,
  hem_left,
  hem_right,
  hem_top,
  hem_bottom,
  gradient_s,
  gradient_t,
  patch,
  patch_s,
  patch_t,
  patch_radius,
  kCount
};

template <class Real>
using Parameters = std::array<Real, kCount>;

/// Shares of a side's vertices that lie within a band at the side's beginning, at its end, and at
/// either. A vertex carries its hat function's part of the cloth. A band therefore weighs the same,
/// with its middle at the same place, on every mesh.
template <class Real>
struct BandShares {
  Real at_begin, at_end, at_either;

  BandShares(double x_m, double side_m, double spacing_m, const Real& band_m) {
    at_begin = within(x_m, side_m, spacing_m, band_m);
    at_end = within(side_m - x_m, side_m, spacing_m, band_m);
    const Real both = at_begin + at_end;
    at_either = select(both < Real(1.0), both, Real(1.0));
  }

 private:
  static Real clipped(const Real& u, double least, double most) {
    const Real some = select(u > Real(least), u, Real(least));
    return select(some < Real(most), some, Real(most));
  }
  /// Returns the part of the hat function of the vertex at `x_m` that lies below `band_m`.
  static Real within(double x_m, double side_m, double spacing_m, const Real& band_m) {
    const bool first = x_m < 0.5 * spacing_m, last = side_m - x_m < 0.5 * spacing_m;
    const Real reach = (band_m - Real(x_m)) / Real(spacing_m);
    const Real up = clipped(reach, -1.0, 0.0) + Real(1.0), down = clipped(reach, 0.0, 1.0);
    const Real rising = first ? Real(0.0) : Real(0.5) * up * up;
    const Real falling = last ? Real(0.0) : down - Real(0.5) * down * down;
    return (rising + falling) / Real(first || last ? 0.5 : 1.0);
  }
};

/// Returns the mass at a vertex over its stated mass.
template <class Real>
Real relative_mass(const Mesh& mesh, int i, int j, const Parameters<Real>& p) {
  const Real one(1.0);
  const double s = static_cast<double>(j) / (mesh.columns - 1);
  const double t = static_cast<double>(i) / (mesh.rows - 1);
  const BandShares<Real> across(s * mesh.width_m, mesh.width_m, mesh.spacing_s_m(), p[hem_width]);
  const BandShares<Real> down(t * mesh.height_m, mesh.height_m, mesh.spacing_t_m(), p[hem_width]);
  const Real all_round = one - (one - across.at_either) * (one - down.at_either);
  const Real in_hem = p[hem] * all_round + p[hem_left] * across.at_begin +
                      p[hem_right] * across.at_end + p[hem_top] * down.at_begin +
                      p[hem_bottom] * down.at_end;

  const Real right_m = Real(mesh.width_m) * (Real(s) - p[patch_s]);
  const Real down_m = Real(mesh.height_m) * (Real(t) - p[patch_t]);
  const Real radius_m = p[patch_radius];
  const Real inside = one - (right_m * right_m + down_m * down_m) / (radius_m * radius_m);
  const Real bump = select(inside > Real(0.0), inside * inside * inside, Real(0.0));

  return (one + in_hem) * (one + p[gradient_s] * Real(s - 0.5)) *
         (one + p[gradient_t] * Real(t - 0.5)) * (one + p[patch] * bump);
}

/// Returns stated over relative mass of every vertex.
template <class Real>
std::vector<Real> inverse_ratios(const Mesh& mesh, const Parameters<Real>& p) {
  std::vector<Real> ratios;
  for (int i = 0; i < mesh.rows; ++i)
    for (int j = 0; j < mesh.columns; ++j)
      ratios.push_back(Real(1.0) / relative_mass(mesh, i, j, p));
  return ratios;
}

struct Law {
  static EffectRates rates(const Cloth& cloth, const SpringParameters&,
                           const std::vector<double>& parameters) {
    Parameters<double> p;
    std::ranges::copy(parameters, p.begin());
    double lightest = 1;
    for (int i = 0; i < cloth.mesh.rows; ++i)
      for (int j = 0; j < cloth.mesh.columns; ++j)
        lightest = std::min(lightest, relative_mass(cloth.mesh, i, j, p));
    return {.acceleration_ratio = 1 / lightest};
  }
};

class NonuniformMass final : public LawEffect<NonuniformMass, Law> {
 public:
  bool changes_force() const override { return true; }

  template <class L>
  static void change(const EffectScene<L>& scene, const EffectValues<L>& parameters,
                     LaneVectors<L>& force_n) {
    const Mesh& mesh = scene.cloth.mesh;
    const auto p = reals_of<L, kCount>(parameters);
    if constexpr (L::kCount == 1) {
      constexpr size_t kKept = 64;  // shapes that are scored together
      thread_local Remembered<double, kCount, kKept> remembered;
      const std::vector<double>& ratios =
          remembered.at(mesh, p, [&] { return inverse_ratios<double>(mesh, p); });
      for (int k = 0; k < mesh.vertex_count(); ++k)
        set_at<L>(force_n, k, ratios[static_cast<size_t>(k)] * vector_at<L>(force_n, k));
    } else {
      thread_local Remembered<RealOf<L>, size_t{kCount} * L::kCount, 2> remembered;
      std::array<double, size_t{kCount} * L::kCount> of_lanes;
      for (size_t n = 0; n < kCount; ++n)
        for (size_t lane = 0; lane < L::kCount; ++lane)
          of_lanes[n * L::kCount + lane] =
              static_cast<double>(parameters[n][static_cast<Eigen::Index>(lane)]);
      const std::vector<RealOf<L>>& ratios =
          remembered.at(mesh, of_lanes, [&] { return inverse_ratios<RealOf<L>>(mesh, p); });
      for (int k = 0; k < mesh.vertex_count(); ++k)
        set_at<L>(force_n, k, ratios[static_cast<size_t>(k)] * vector_at<L>(force_n, k));
    }
  }

  void linearise_change(const EffectScene<SingleLane>& scene,
                        const EffectValues<SingleLane>& parameters,
                        const LaneVectors<SingleLane>& force_n,
                        EffectLinearisation& derivatives) const override {
    using Dual = ceres::Jet<double, kCount>;
    thread_local Remembered<Dual, kCount, 1> remembered;
    const Mesh& mesh = scene.cloth.mesh;
    const auto p = reals_of<SingleLane, kCount>(parameters);
    const std::vector<Dual>& ratios = remembered.at(mesh, p, [&] {
      Parameters<Dual> dual;
      for (size_t n = 0; n < kCount; ++n) dual[n] = Dual(p[n], static_cast<int>(n));
      return inverse_ratios<Dual>(mesh, dual);
    });
    for (int k = 0; k < mesh.vertex_count(); ++k) {
      const Dual& ratio = ratios[static_cast<size_t>(k)];
      derivatives.by_force.push_back({k, ratio.a * Eigen::Matrix3d::Identity()});
      const Vector3<double> force = vector_at<SingleLane>(force_n, k);
      for (int n = 0; n < kCount; ++n)
        if (ratio.v[n] != 0 && derivatives.asks_for(ParameterNumber::own(n)))
          derivatives.by_parameter.push_back(
              {k, ParameterNumber::own(n),
               ratio.v[n] * Eigen::Vector3d(force.x, force.y, force.z)});
    }
  }
};

constexpr std::array<const char*, kCount> kNames{
    "hem",        "hem_width",  "hem_left", "hem_right", "hem_top", "hem_bottom",
    "gradient_s", "gradient_t", "patch",    "patch_s",   "patch_t", "patch_radius"};

/// The cloth's mass and its centre (s, t).
struct Weighed {
  double mass_kg = 0;
  Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();
};

/// Weighs the cloth with the amplitudes of `absent` at nothing.
Weighed weigh(const FittedEffect& found, const std::vector<Parameter>& absent) {
  Parameters<double> p;
  for (size_t n = 0; n < kCount; ++n) p[n] = found.value(kNames[n]);
  for (const Parameter one : absent) p[one] = 0;
  const Mesh& mesh = found.mesh;
  Weighed all;
  for (int i = 0; i < mesh.rows; ++i)
    for (int j = 0; j < mesh.columns; ++j) {
      const double mass_kg = found.mass_kg[mesh.vertex(i, j)] * relative_mass(mesh, i, j, p);
      all.mass_kg += mass_kg;
      all.centre_m += mass_kg * Eigen::Vector2d(j * mesh.spacing_s_m(), i * mesh.spacing_t_m());
    }
  all.centre_m /= all.mass_kg;
  return all;
}

/// Tells the mass that each edge adds, the largest first; none below a hundredth of that.
std::string edges_in_words(const FittedEffect& found) {
  constexpr double kSmall = 0.01;
  std::vector<std::pair<double, std::string>> edges;
  for (const auto& [edge, name] : {std::pair{hem_left, "left"},
                                   {hem_right, "right"},
                                   {hem_top, "top"},
                                   {hem_bottom, "bottom"}})
    edges.emplace_back(1e3 * (weigh(found, {}).mass_kg - weigh(found, {edge}).mass_kg), name);
  std::ranges::stable_sort(edges, std::greater<>(),
                           [](const auto& edge) { return std::abs(edge.first); });
  std::vector<std::string> texts;
  for (const auto& [grams, name] : edges)
    if (std::abs(grams) > kSmall * std::abs(edges.front().first))
      texts.push_back(rounded(grams) + " g along the " + name + " edge");
  return listed(texts);
}

/// Masses are those of the vertices on the mesh of the fit, with what the other modes make of them.
std::string in_words(const FittedEffect& found) {
  const auto grams = [&](Parameter amplitude) {
    return 1e3 * (weigh(found, {}).mass_kg - weigh(found, {amplitude}).mass_kg);
  };
  if (found.mode == "edges") return edges_in_words(found);
  if (found.mode == "gradient") {
    const std::string way =
        way_over_cloth(weigh(found, {}).centre_m - weigh(found, {gradient_s, gradient_t}).centre_m);
    return way.empty() ? way : "centre of mass " + way;
  }
  if (found.mode == "patch") {
    if (found.value("patch") == 0) return {};
    return rounded(grams(patch)) + " g within " + millimetres(found.value("patch_radius")) +
           " of a place " +
           place_on_cloth({found.value("patch_s") * found.mesh.width_m,
                           found.value("patch_t") * found.mesh.height_m});
  }
  if (found.value("hem") == 0) return {};
  return rounded(grams(hem)) + " g in a hem of " + millimetres(found.value("hem_width")) +
         " all round";
}

}  // namespace

EffectDescription describe() {
  const auto number = [](const char* name, const char* unit, double neutral, double lower,
                         double upper, double typical) {
    return EffectParameter{.name = name,
                           .unit = unit,
                           .neutral = neutral,
                           .lower = lower,
                           .upper = upper,
                           .typical = typical};
  };
  const auto over_cloth = [](const char* parameter, std::vector<double> values) {
    return ShapeGrid{.parameter = parameter, .values = std::move(values), .over_cloth = true};
  };
  return {.name = "nonuniform_mass",
          .summary = "mass that is not spread as stated, F' = F / r(s, t)",
          .parameters = {number("hem", "ratio", 0, -0.2, 40, 0.1),
                         number("hem_width", "m", 0.01, 0.001, 0.1, 0.001),
                         number("hem_left", "ratio", 0, -0.2, 40, 0.1),
                         number("hem_right", "ratio", 0, -0.2, 40, 0.1),
                         number("hem_top", "ratio", 0, -0.2, 40, 0.1),
                         number("hem_bottom", "ratio", 0, -0.2, 40, 0.1),
                         number("gradient_s", "ratio", 0, -1, 1, 0.05),
                         number("gradient_t", "ratio", 0, -1, 1, 0.05),
                         number("patch", "ratio", 0, -0.5, 4, 0.1),
                         number("patch_s", "ratio", 0.5, 0, 1, 0.02),
                         number("patch_t", "ratio", 0.5, 0, 1, 0.02),
                         number("patch_radius", "m", 0.1, 0.02, 1, 0.01)},
          .test = EffectTest::profiled,
          .modes = {{.name = "hem",
                     .amplitudes = {"hem"},
                     .shapes = {over_cloth("hem_width", {0.005, 0.01, 0.02, 0.04})}},
                    {.name = "edges",
                     .amplitudes = {"hem_left", "hem_right", "hem_top", "hem_bottom"},
                     .shapes = {over_cloth("hem_width", {0.005, 0.01, 0.02, 0.04})}},
                    {.name = "gradient", .amplitudes = {"gradient_s", "gradient_t"}, .shapes = {}},
                    {.name = "patch",
                     .amplitudes = {"patch"},
                     .shapes = {over_cloth("patch_s", {0.2, 0.5, 0.8}),
                                over_cloth("patch_t", {0.2, 0.5, 0.8}),
                                over_cloth("patch_radius", {0.05, 0.12})}}},
          .remedy =
              "weigh the hem, or declare it: copy nonuniform_mass from `effects` of model.yaml "
              "to `declared` of recording.yaml",
          .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<NonuniformMass>();
}

}  // namespace clothfit::nonuniform_mass
