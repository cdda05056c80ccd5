#include <ceres/jet.h>

#include "model/effects/contact_law.h"
#include "model/effects/lane_by_lane.h"
#include "model/topology/obstacle.h"

/// Keeps the cloth out of an obstacle of triangles: the cloth's `obstacle`
/// (model/topology/obstacle.h). A vertex below its surface feels the force of contact_law.h towards
/// the nearest point of the surface; a cloth without an obstacle feels nothing.
///
/// Parameters: stiffness (Pa/m), damping (Pa s/m), friction (ratio), neutral at 0.
namespace clothfit::contact_mesh {
namespace {

using Nearest = Obstacle::Nearest;

template <class Real>
Vector3<Real> vector(const Eigen::Vector3d& v) {
  return {Real(v.x()), Real(v.y()), Real(v.z())};
}

struct Law {
  static constexpr int kParameters = Contact::kParameters;
  /// Numbers that a force is differentiated by: position, velocity, mass, own parameters.
  static constexpr int kMass = 6, kOwn = 7;

  /// Returns the force on a vertex below the part `surface` of the obstacle.
  template <class Real>
  static Vector3<Real> force(const Nearest& surface, const Vector3<Real>& position_m,
                             const Vector3<Real>& velocity_m_per_s, double area_m2,
                             const Real& mass_kg, const std::array<Real, kParameters>& p) {
    Vector3<Real> outwards = vector<Real>(surface.place_m) - position_m;
    const Vector3<Real> along = vector<Real>(surface.direction);
    if (surface.kind == Nearest::edge) outwards = outwards - dot(along, outwards) * along;
    const Vector3<Real> n = surface.kind == Nearest::face ? along : direction(outwards);
    return Contact::force(dot(n, outwards), n, velocity_m_per_s, area_m2, mass_kg, p[0], p[1],
                          p[2]);
  }

  /// Calls `visit(vertex, part of the surface, position, area)` for every vertex below the surface.
  template <class Vectors, class Visit>
  static void for_contacts(const Cloth& cloth, const Vectors& position_m, const Visit& visit) {
    if (!cloth.obstacle) return;
    const Mesh& mesh = cloth.mesh;
    for (int k = 0; k < mesh.vertex_count(); ++k) {
      const auto x = position_m(k);
      const auto [x_m, y_m, z_m] = value_of(x);
      const auto surface = cloth.obstacle->beneath({x_m, y_m, z_m});
      if (surface) visit(k, *surface, x, flat_area_m2(mesh, k / mesh.columns, k % mesh.columns));
    }
  }

  template <class Real, class Vectors, class Add>
  static void forces(const Cloth& cloth, const Vectors& position_m, const Vectors& velocity_m_per_s,
                     const std::array<Real, kParameters>& p, const Add& add) {
    // At neutral there is no force to search for, but there are derivatives.
    if (std::is_same_v<Real, double> && p[0] == Real(0.0) && p[1] == Real(0.0)) return;
    for_contacts(cloth, position_m,
                 [&](int k, const Nearest& surface, const Vector3<Real>& x, double area_m2) {
                   add(k,
                       force(surface, x, velocity_m_per_s(k), area_m2, Real(cloth.mass_kg[k]), p));
                 });
  }

  template <class Vectors>
  static void linearise(const Cloth& cloth, const Vectors& position_m,
                        const Vectors& velocity_m_per_s, const std::array<double, kParameters>& p,
                        EffectLinearisation& derivatives) {
    using Dual = ceres::Jet<double, kOwn + kParameters>;
    const auto dual = [](const Vector3<double>& v, int first) -> Vector3<Dual> {
      return {Dual(v.x, first), Dual(v.y, first + 1), Dual(v.z, first + 2)};
    };
    const std::array<Dual, kParameters> parameters{Dual(p[0], kOwn), Dual(p[1], kOwn + 1),
                                                   Dual(p[2], kOwn + 2)};
    for_contacts(
        cloth, position_m,
        [&](int k, const Nearest& surface, const Vector3<double>& x, double area_m2) {
          const Vector3<Dual> f = force(surface, dual(x, 0), dual(velocity_m_per_s(k), 3), area_m2,
                                        Dual(cloth.mass_kg[k], kMass), parameters);
          Eigen::Matrix<double, 3, kOwn + kParameters> j;
          j << f.x.v.transpose(), f.y.v.transpose(), f.z.v.transpose();
          derivatives.by_motion.push_back({k, k, j.middleCols<3>(0), j.middleCols<3>(3)});
          derivatives.by_mass.push_back({k, j.col(kMass)});
          for (int n = 0; n < kParameters; ++n)
            derivatives.by_parameter.push_back({k, ParameterNumber::own(n), j.col(kOwn + n)});
        });
  }

  static EffectRates rates(const Cloth& cloth, const SpringParameters&,
                           const std::vector<double>& parameters) {
    return Contact::rates(cloth, parameters);
  }
};

}  // namespace

EffectDescription describe() {
  return {.name = "contact_mesh",
          .summary = "an obstacle of triangles that the cloth cannot pass",
          .parameters = Contact::parameters(),
          .test = EffectTest::finite,
          .touches = true};
}

std::unique_ptr<Effect> make() {
  return std::make_unique<LaneByLaneEffect<Law>>();
}

}  // namespace clothfit::contact_mesh
