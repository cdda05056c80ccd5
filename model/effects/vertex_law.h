#pragma once

#include <ceres/jet.h>

#include <algorithm>
#include <array>

#include "model/cloth.h"
#include "model/effects/law_effect.h"
#include "model/effects/linearisation.h"
#include "model/effects/number.h"

namespace clothfit {

/// What a law sees at a vertex.
template <class Real>
struct VertexSight {
  Vector3<Real> position_m, velocity_m_per_s;
  /// Vector area of the surface that belongs to the vertex: normal to it, on the printed side's
  /// back (s x t), as long as the area is large.
  Vector3<Real> area_m2;
  Vector3<Real> gravity_m_per_s2;
  Real mass_kg;
  double flat_area_m2 = 0;  ///< that belongs to the vertex in the flat cloth
  double s = 0, t = 0;      ///< place on the cloth, shares of its width and height
  const Mesh* mesh = nullptr;
  double time_s = 0;  ///< the recording's, at the beginning of the step
};

/// The vector area at vertex [i, j], from differences to the neighbours on both sides, or the one
/// there is at an edge; in a flat cloth a cell's area inside, half of one at an edge, a quarter at
/// a corner.
struct AreaStencil {
  int right, left, below, above;  ///< area = (x_right - x_left) x (x_below - x_above) / 4

  AreaStencil(const Mesh& mesh, int i, int j)
      : right(mesh.vertex(i, std::min(j + 1, mesh.columns - 1))),
        left(mesh.vertex(i, std::max(j - 1, 0))),
        below(mesh.vertex(std::min(i + 1, mesh.rows - 1), j)),
        above(mesh.vertex(std::max(i - 1, 0), j)) {}
};

template <class L>
Vector3<RealOf<L>> vector_area(const LaneVectors<L>& position_m, const AreaStencil& at) {
  const auto along_s = vector_at<L>(position_m, at.right) - vector_at<L>(position_m, at.left);
  const auto along_t = vector_at<L>(position_m, at.below) - vector_at<L>(position_m, at.above);
  return RealOf<L>(0.25) * cross(along_s, along_t);
}

/// The area that belongs to vertex [i, j] in the flat cloth.
inline double flat_area_m2(const Mesh& mesh, int i, int j) {
  return mesh.spacing_s_m() * mesh.spacing_t_m() * (i % (mesh.rows - 1) == 0 ? 0.5 : 1.0) *
         (j % (mesh.columns - 1) == 0 ? 0.5 : 1.0);
}

/// The largest area per mass of any vertex, stretched as far as cloth stretches (m2/kg).
inline double largest_area_per_mass(const Cloth& cloth) {
  constexpr double kStretched = 1.5;  // of the flat area
  const Eigen::VectorXd area_m2 =
      masses_by_area(cloth.mesh, cloth.mesh.width_m * cloth.mesh.height_m);
  return kStretched * area_m2.cwiseQuotient(cloth.mass_kg).maxCoeff();
}

/// Calls `visit(vertex, stencil, sight)` for every vertex, with what a law sees there.
template <class L, class Visit>
void for_vertices(const EffectScene<L>& scene, const Visit& visit) {
  const Cloth& cloth = scene.cloth;
  const Mesh& mesh = cloth.mesh;
  VertexSight<RealOf<L>> sight;
  sight.gravity_m_per_s2 = real_of<L>(scene.gravity_m_per_s2);
  sight.mesh = &mesh;
  sight.time_s = scene.time_s;
  for (int i = 0; i < mesh.rows; ++i) {
    for (int j = 0; j < mesh.columns; ++j) {
      const int k = mesh.vertex(i, j);
      const AreaStencil stencil(mesh, i, j);
      sight.position_m = vector_at<L>(scene.position_m, k);
      sight.velocity_m_per_s = vector_at<L>(scene.velocity_m_per_s, k);
      sight.area_m2 = vector_area<L>(scene.position_m, stencil);
      sight.mass_kg = RealOf<L>(static_cast<typename L::Number>(cloth.mass_kg[k]));
      sight.flat_area_m2 = flat_area_m2(mesh, i, j);
      sight.s = static_cast<double>(j) / (mesh.columns - 1);
      sight.t = static_cast<double>(i) / (mesh.rows - 1);
      visit(k, stencil, sight);
    }
  }
}

/// Dual numbers over what a vertex law depends on: position, velocity, area, gravity, then
/// `more` numbers, then the effect's parameters. The mass stands apart (MassDual): many laws do not
/// look at it, and a vector of derivatives of odd length costs a third more.
template <int more, int parameters>
struct VertexDual {
  static constexpr int kMore = 12, kParameters = 12 + more, kCount = kParameters + parameters;
  using Number = ceres::Jet<double, kCount>;

  static Vector3<Number> vector(const Vector3<double>& v, int first) {
    return {Number(v.x, first), Number(v.y, first + 1), Number(v.z, first + 2)};
  }
  static VertexSight<Number> sight(const VertexSight<double>& at) {
    return {.position_m = vector(at.position_m, 0),
            .velocity_m_per_s = vector(at.velocity_m_per_s, 3),
            .area_m2 = vector(at.area_m2, 6),
            .gravity_m_per_s2 = vector(at.gravity_m_per_s2, 9),
            .mass_kg = Number(at.mass_kg),
            .flat_area_m2 = at.flat_area_m2,
            .s = at.s,
            .t = at.t,
            .mesh = at.mesh,
            .time_s = at.time_s};
  }
  static std::array<Number, parameters> parameters_of(const EffectValues<SingleLane>& values) {
    std::array<Number, parameters> result;
    for (size_t p = 0; p < parameters; ++p)
      result[p] = Number(values[p][0], kParameters + static_cast<int>(p));
    return result;
  }

  using Jacobian = Eigen::Matrix<double, 3, kCount>;
  static Jacobian jacobian(const Vector3<Number>& v) {
    Jacobian j;
    j << v.x.v.transpose(), v.y.v.transpose(), v.z.v.transpose();
    return j;
  }

  /// Splits the derivative at vertex `k` into blocks by vertex and columns by parameter.
  static void add_blocks(int k, const AreaStencil& area, const LaneVectors<SingleLane>& position_m,
                         const Jacobian& j, EffectLinearisation& derivatives) {
    derivatives.by_motion.push_back(
        {k, k, j.template middleCols<3>(0), j.template middleCols<3>(3)});
    const Eigen::Matrix3d by_area = 0.25 * j.template middleCols<3>(6);
    if (!by_area.isZero(0)) {
      // d(s x t) = ds x t + s x dt
      const auto along = [&](int to, int from) {
        const Vector3<double> d =
            vector_at<SingleLane>(position_m, to) - vector_at<SingleLane>(position_m, from);
        return Eigen::Vector3d(d.x, d.y, d.z);
      };
      const auto cross_matrix = [](const Eigen::Vector3d& v) {
        Eigen::Matrix3d m;
        m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
        return m;
      };
      const Eigen::Matrix3d by_s = -by_area * cross_matrix(along(area.below, area.above));
      const Eigen::Matrix3d by_t = by_area * cross_matrix(along(area.right, area.left));
      const Eigen::Matrix3d none = Eigen::Matrix3d::Zero();
      derivatives.by_motion.push_back({k, area.right, by_s, none});
      derivatives.by_motion.push_back({k, area.left, -by_s, none});
      derivatives.by_motion.push_back({k, area.below, by_t, none});
      derivatives.by_motion.push_back({k, area.above, -by_t, none});
    }
    const auto add_column = [&](int parameter, int column) {
      if (derivatives.asks_for(parameter) && !j.col(column).isZero(0))
        derivatives.by_parameter.push_back({k, parameter, j.col(column)});
    };
    for (int axis = 0; axis < 3; ++axis) add_column(ParameterNumber::gravity(axis), 9 + axis);
    for (int p = 0; p < parameters; ++p) add_column(ParameterNumber::own(p), kParameters + p);
  }
};

/// Dual numbers over a vertex's mass.
struct MassDual {
  using Number = ceres::Jet<double, 1>;

  static Vector3<Number> constant(const Vector3<double>& v) {
    return {Number(v.x), Number(v.y), Number(v.z)};
  }
  static VertexSight<Number> sight(const VertexSight<double>& at) {
    return {.position_m = constant(at.position_m),
            .velocity_m_per_s = constant(at.velocity_m_per_s),
            .area_m2 = constant(at.area_m2),
            .gravity_m_per_s2 = constant(at.gravity_m_per_s2),
            .mass_kg = Number(at.mass_kg, 0),
            .flat_area_m2 = at.flat_area_m2,
            .s = at.s,
            .t = at.t,
            .mesh = at.mesh,
            .time_s = at.time_s};
  }
  template <int parameters>
  static std::array<Number, parameters> parameters_of(const EffectValues<SingleLane>& values) {
    std::array<Number, parameters> result;
    for (size_t p = 0; p < parameters; ++p) result[p] = Number(values[p][0]);
    return result;
  }
  static void add_block(int k, const Vector3<Number>& v, EffectLinearisation& derivatives) {
    const Eigen::Vector3d derivative(v.x.v[0], v.y.v[0], v.z.v[0]);
    if (!derivative.isZero(0)) derivatives.by_mass.push_back({k, derivative});
  }
};

/// What a law's parameters come to at a moment, the same for all vertices: what the law makes of
/// them, or themselves.
template <class Law, class Real, size_t count>
auto at_moment(const std::array<Real, count>& parameters, double time_s) {
  if constexpr (requires { Law::at_moment(parameters, time_s); })
    return Law::at_moment(parameters, time_s);
  else
    return parameters;
}

/// An effect whose force on a vertex follows from what is seen there. A Law has
///   static constexpr int kParameters;
///   template <class Real> static Vector3<Real> force(const VertexSight<Real>&,
///                                                    const std::array<Real, kParameters>&);  // N
///   static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&);
/// Where the parameters act through something that changes with time alone, it may have that too,
/// which `force` is then given in their place:
///   template <class Real> static T at_moment(const std::array<Real, kParameters>&, double time_s);
/// Lanes, tangents and the adjoint follow from these.
template <class Law>
class VertexLawEffect final : public LawEffect<VertexLawEffect<Law>, Law> {
 public:
  template <class L>
  static void add(const EffectScene<L>& scene, const EffectValues<L>& parameters, EffectMemory<L>&,
                  LaneVectors<L>& force_n) {
    const auto p = at_moment<Law>(reals_of<L, Law::kParameters>(parameters), scene.time_s);
    for_vertices<L>(scene, [&](int k, const AreaStencil&, const VertexSight<RealOf<L>>& sight) {
      add_at<L>(force_n, k, Law::force(sight, p));
    });
  }

  void linearise_force(const EffectScene<SingleLane>& scene,
                       const EffectValues<SingleLane>& parameters, const EffectMemory<SingleLane>&,
                       EffectLinearisation& derivatives) const override {
    using Dual = VertexDual<0, Law::kParameters>;
    const auto p = at_moment<Law>(Dual::parameters_of(parameters), scene.time_s);
    const auto fixed =
        at_moment<Law>(MassDual::parameters_of<Law::kParameters>(parameters), scene.time_s);
    for_vertices<SingleLane>(
        scene, [&](int k, const AreaStencil& area, const VertexSight<double>& sight) {
          Dual::add_blocks(k, area, scene.position_m,
                           Dual::jacobian(Law::force(Dual::sight(sight), p)), derivatives);
          MassDual::add_block(k, Law::force(MassDual::sight(sight), fixed), derivatives);
        });
  }
};

/// An effect of inertia beyond the vertices' mass, which changes the sum of forces. A Law has
///   static constexpr int kParameters;
///   template <class Real> static Vector3<Real> change(const VertexSight<Real>&,
///       const Vector3<Real>& force_n, const std::array<Real, kParameters>&);  // N
///   static EffectRates rates(...);  // as above
template <class Law>
class InertiaLawEffect final : public LawEffect<InertiaLawEffect<Law>, Law> {
 public:
  bool changes_force() const override { return true; }

  template <class L>
  static void change(const EffectScene<L>& scene, const EffectValues<L>& parameters,
                     LaneVectors<L>& force_n) {
    const auto p = reals_of<L, Law::kParameters>(parameters);
    for_vertices<L>(scene, [&](int k, const AreaStencil&, const VertexSight<RealOf<L>>& sight) {
      set_at<L>(force_n, k, Law::change(sight, vector_at<L>(force_n, k), p));
    });
  }

  void linearise_change(const EffectScene<SingleLane>& scene,
                        const EffectValues<SingleLane>& parameters,
                        const LaneVectors<SingleLane>& force_n,
                        EffectLinearisation& derivatives) const override {
    using Dual = VertexDual<3, Law::kParameters>;
    const auto p = Dual::parameters_of(parameters);
    const auto fixed = MassDual::parameters_of<Law::kParameters>(parameters);
    for_vertices<SingleLane>(scene, [&](int k, const AreaStencil& area,
                                        const VertexSight<double>& sight) {
      const Vector3<double> force_at = vector_at<SingleLane>(force_n, k);
      const auto force = Dual::vector(force_at, Dual::kMore);
      const auto j = Dual::jacobian(Law::change(Dual::sight(sight), force, p));
      MassDual::add_block(
          k, Law::change(MassDual::sight(sight), MassDual::constant(force_at), fixed), derivatives);
      Dual::add_blocks(k, area, scene.position_m, j, derivatives);
      derivatives.by_force.push_back({k, j.template middleCols<3>(Dual::kMore)});
    });
  }
};

}  // namespace clothfit
