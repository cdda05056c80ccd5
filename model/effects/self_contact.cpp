#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/cloth/wording.h"
#include "model/effects/lane_by_lane.h"
#include "model/effects/near_pairs.h"
#include "model/effects/vertex_law.h"

/// Keeps the cloth from passing through itself. Between every two vertices that are not neighbours,
/// closer than the thickness d,
///
///   F = stiffness A_a A_b (d - r) / d^2  along their connection, apart
///
/// r is their distance. A_a, A_b are the areas that belong to them in the flat cloth, so that the
/// sum over vertices stands for an integral over both sheets and survives a change of mesh.
/// Parallel sheets at the distance z press each other apart by
///
///   p = pi stiffness z (d - z)^2 / d^2.
///
/// Vertices are not neighbours if they are apart by 2 d or more in the flat cloth, and by more than
/// two columns or rows, so that no spring joins them. (Sheets that a fold brings together at
/// distance d are at least pi d / 2 of cloth apart.) Where d is less than the mesh's spacing,
/// sheets slip through between the vertices. Ours.
///
/// Parameters: stiffness (Pa/m), neutral at 0; thickness d (m), which matters only where stiffness
/// does.
namespace clothfit::self_contact {
namespace {

struct Law {
  static constexpr int kParameters = 2;

  static bool neighbours(const Mesh& mesh, int a, int b, double thickness_m) {
    const int columns = std::abs(a % mesh.columns - b % mesh.columns);
    const int rows = std::abs(a / mesh.columns - b / mesh.columns);
    const double apart_s_m = columns * mesh.spacing_s_m(), apart_t_m = rows * mesh.spacing_t_m();
    return (columns <= 2 && rows <= 2) ||
           apart_s_m * apart_s_m + apart_t_m * apart_t_m < 4 * thickness_m * thickness_m;
  }

  /// Calls `visit(a, b, A_a A_b)` for every two vertices that touch.
  template <class Vectors, class Visit>
  static void for_contacts(const Cloth& cloth, const Vectors& position_m, double thickness_m,
                           const Visit& visit) {
    // Only its memory is kept: nothing in it is meant to last from one call to the next.
    thread_local NearPairs search;
    const Mesh& mesh = cloth.mesh;
    const auto area_m2 = [&](int k) {
      return flat_area_m2(mesh, k / mesh.columns, k % mesh.columns);
    };
    search.for_pairs(
        mesh.vertex_count(), [&](int k) { return value_of(position_m(k)); }, thickness_m,
        [&](int a, int b, const Vector3<double>&, double distance_m2) {
          // Two vertices in the same place have no direction.
          if (distance_m2 > 0 && !neighbours(mesh, a, b, thickness_m))
            visit(a, b, area_m2(a) * area_m2(b));
        });
  }

  template <class Real, class Vectors, class Add>
  static void forces(const Cloth& cloth, const Vectors& position_m, const Vectors&,
                     const std::array<Real, kParameters>& p, const Add& add) {
    using std::sqrt;
    const auto& [stiffness, d] = p;
    // At neutral there is no force to search for, but there are derivatives.
    if (std::is_same_v<Real, double> && stiffness == Real(0.0)) return;
    for_contacts(cloth, position_m, value_of(d), [&](int a, int b, double areas_m4) {
      const Vector3<Real> connection = position_m(b) - position_m(a);
      const Real r = sqrt(dot(connection, connection));
      const Real push = stiffness * Real(areas_m4) * (d - r) / (d * d * r);
      add(b, push * connection);
      add(a, -push * connection);
    });
  }

  template <class Vectors>
  static void linearise(const Cloth& cloth, const Vectors& position_m, const Vectors&,
                        const std::array<double, kParameters>& p,
                        EffectLinearisation& derivatives) {
    const double stiffness = p[0], d = p[1];
    // Contacts are visited at neutral too, for the derivative by the stiffness.
    for_contacts(cloth, position_m, d, [&](int a, int b, double areas) {
      const Vector3<double> connection = position_m(b) - position_m(a);
      const double r = std::sqrt(dot(connection, connection));
      const Eigen::Vector3d u = Eigen::Vector3d(connection.x, connection.y, connection.z) / r;
      const Eigen::Matrix3d along = u * u.transpose();
      const Eigen::Matrix3d by_connection =
          stiffness * areas / (d * d) *
          ((d - r) / r * (Eigen::Matrix3d::Identity() - along) - along);
      const Eigen::Vector3d by_stiffness = areas * (d - r) / (d * d) * u;
      const Eigen::Vector3d by_thickness = stiffness * areas * (2 * r - d) / (d * d * d) * u;
      for (const auto& [on, sign] : {std::pair{b, 1.0}, {a, -1.0}}) {
        const Eigen::Matrix3d none = Eigen::Matrix3d::Zero();
        derivatives.by_motion.push_back({on, b, sign * by_connection, none});
        derivatives.by_motion.push_back({on, a, -sign * by_connection, none});
        derivatives.by_parameter.push_back({on, ParameterNumber::own(0), sign * by_stiffness});
        derivatives.by_parameter.push_back({on, ParameterNumber::own(1), sign * by_thickness});
      }
    });
  }

  /// Bounds the frequency by twice the stiffness against all vertices that may be near, over the
  /// mass. They are those of two other layers within a disc of the thickness, widened by the
  /// surplus that a lattice may have.
  static EffectRates rates(const Cloth& cloth, const SpringParameters&,
                           const std::vector<double>& parameters) {
    constexpr double kLayers = 2;
    const Mesh& mesh = cloth.mesh;
    const double thickness_m = parameters[1];
    const double reach_m = thickness_m + 0.5 * std::hypot(mesh.spacing_s_m(), mesh.spacing_t_m());
    const double near_m2 = kLayers * std::numbers::pi * reach_m * reach_m;
    return {.frequency2_per_s2 = 2 * parameters[0] * largest_area_per_mass(cloth) * near_m2 /
                                 (thickness_m * thickness_m)};
  }
};

/// Two layers press each other apart by pi stiffness z (d - z)^2 / d^2, which falls with their
/// distance z from d / 3 on. Tells at which z that carries a layer's weight.
std::string in_words(const FittedEffect& found) {
  const double stiffness = found.value("stiffness"), d_m = found.value("thickness");
  const double weight_pa = found.weight_pa();
  if (!(stiffness > 0)) return {};
  const auto carries = [&](double z_m) {
    const double gap = (d_m - z_m) / d_m;
    return std::numbers::pi * stiffness * z_m * gap * gap >= weight_pa;
  };
  double near_m = d_m / 3, far_m = d_m;
  if (!carries(near_m)) return "too soft for one layer to carry another";
  for (int n = 0; n < 50; ++n) {
    const double middle_m = (near_m + far_m) / 2;
    (carries(middle_m) ? near_m : far_m) = middle_m;
  }
  return "one layer rests on another " + millimetres(near_m) + " away";
}

}  // namespace

EffectDescription describe() {
  return {.name = "self_contact",
          .summary = "the cloth does not pass through itself, F = k A_a A_b (d - r) / d^2",
          .parameters = {{.name = "stiffness",
                          .unit = "Pa/m",
                          .neutral = 0,
                          .lower = 0,
                          .upper = 1e5,
                          .typical = 500},
                         {.name = "thickness",
                          .unit = "m",
                          .neutral = 0.03,
                          .lower = 0.005,
                          .upper = 0.1,
                          .typical = 0.002}},
          .test = EffectTest::finite,
          .modes = {{.name = "",
                     .amplitudes = {"stiffness"},
                     .shapes = {{.parameter = "thickness", .values = {0.01, 0.03}}}}},
          .in_words = in_words};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<LaneByLaneEffect<Law>>();
}

}  // namespace clothfit::self_contact
