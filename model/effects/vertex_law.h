#pragma once

#include <ceres/jet.h>

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/effects/law_effect.h"
#include "model/effects/linearisation.h"
#include "model/effects/number.h"

namespace clothfit {

/// A vertex as a law sees it.
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

/// The vector area at vertex [i, j], from differences to the neighbours on both sides, or to the
/// one at an edge. In a flat cloth it is a cell's area inside, half of one at an edge, a quarter at
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

/// Returns the area that belongs to vertex [i, j] in the flat cloth.
inline double flat_area_m2(const Mesh& mesh, int i, int j) {
  return mesh.spacing_s_m() * mesh.spacing_t_m() * (i % (mesh.rows - 1) == 0 ? 0.5 : 1.0) *
         (j % (mesh.columns - 1) == 0 ? 0.5 : 1.0);
}

/// Returns the largest area per mass of any vertex, stretched as far as cloth stretches (m2/kg).
inline double largest_area_per_mass(const Cloth& cloth) {
  constexpr double kStretched = 1.5;  // of the flat area
  const Eigen::VectorXd area_m2 =
      masses_by_area(cloth.mesh, cloth.mesh.width_m * cloth.mesh.height_m);
  return kStretched * area_m2.cwiseQuotient(cloth.mass_kg).maxCoeff();
}

/// Calls `visit(vertex, stencil, sight)` for every vertex, with its sight for a law.
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

/// The parts of a sight that a law looks at: derivatives by others are not taken.
struct LooksAt {
  bool position = false, velocity = false, area = false, gravity = false, mass = false;
};

/// Returns a law's own kLooksAt, or everything.
template <class Law>
constexpr LooksAt looks_at() {
  if constexpr (requires { Law::kLooksAt; })
    return Law::kLooksAt;
  else
    return {.position = true, .velocity = true, .area = true, .gravity = true, .mass = true};
}

/// Returns a sight in another kind of number, with these vectors.
template <class Number>
VertexSight<Number> with_vectors(const VertexSight<double>& at, const Vector3<Number>& position_m,
                                 const Vector3<Number>& velocity_m_per_s,
                                 const Vector3<Number>& area_m2,
                                 const Vector3<Number>& gravity_m_per_s2) {
  return {.position_m = position_m,
          .velocity_m_per_s = velocity_m_per_s,
          .area_m2 = area_m2,
          .gravity_m_per_s2 = gravity_m_per_s2,
          .mass_kg = Number(at.mass_kg),
          .flat_area_m2 = at.flat_area_m2,
          .s = at.s,
          .t = at.t,
          .mesh = at.mesh,
          .time_s = at.time_s};
}

/// Returns a sight, and parameters, as numbers that derivatives are not taken by.
template <class Number>
Vector3<Number> constant(const Vector3<double>& v) {
  return {Number(v.x), Number(v.y), Number(v.z)};
}
template <class Number>
VertexSight<Number> constant(const VertexSight<double>& at) {
  return with_vectors(at, constant<Number>(at.position_m), constant<Number>(at.velocity_m_per_s),
                      constant<Number>(at.area_m2), constant<Number>(at.gravity_m_per_s2));
}
template <class Number, size_t count>
std::array<Number, count> constants(const EffectValues<SingleLane>& values) {
  std::array<Number, count> result;
  for (size_t p = 0; p < count; ++p) result[p] = Number(values[p][0]);
  return result;
}

/// Dual numbers over the inputs of a vertex law: position, velocity, area, gravity, then `more`
/// numbers, then the effect's parameters. The mass stands apart (MassDual).
template <LooksAt at, int more, int parameters>
struct VertexDual {
  static constexpr int kPosition = 0, kVelocity = kPosition + (at.position ? 3 : 0),
                       kArea = kVelocity + (at.velocity ? 3 : 0),
                       kGravity = kArea + (at.area ? 3 : 0),
                       kMore = kGravity + (at.gravity ? 3 : 0), kParameters = kMore + more,
                       kCount = kParameters + parameters;
  using Number = ceres::Jet<double, kCount>;

  static Vector3<Number> vector(const Vector3<double>& v, int first) {
    return {Number(v.x, first), Number(v.y, first + 1), Number(v.z, first + 2)};
  }
  static VertexSight<Number> sight(const VertexSight<double>& of) {
    const auto dual = [](bool looked_at, const Vector3<double>& v, int first) {
      return looked_at ? vector(v, first) : constant<Number>(v);
    };
    return with_vectors(of, dual(at.position, of.position_m, kPosition),
                        dual(at.velocity, of.velocity_m_per_s, kVelocity),
                        dual(at.area, of.area_m2, kArea),
                        dual(at.gravity, of.gravity_m_per_s2, kGravity));
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
    const Eigen::Matrix3d none = Eigen::Matrix3d::Zero();
    const auto by = [&](bool looked_at, int first) {
      return looked_at ? Eigen::Matrix3d(j.middleCols(first, 3)) : none;
    };
    if (at.position || at.velocity)
      derivatives.by_motion.push_back(
          {k, k, by(at.position, kPosition), by(at.velocity, kVelocity)});
    const Eigen::Matrix3d by_area = 0.25 * by(at.area, kArea);
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
      derivatives.by_motion.push_back({k, area.right, by_s, none});
      derivatives.by_motion.push_back({k, area.left, -by_s, none});
      derivatives.by_motion.push_back({k, area.below, by_t, none});
      derivatives.by_motion.push_back({k, area.above, -by_t, none});
    }
    const auto add_column = [&](int parameter, int column) {
      if (derivatives.asks_for(parameter) && !j.col(column).isZero(0))
        derivatives.by_parameter.push_back({k, parameter, j.col(column)});
    };
    for (int axis = 0; at.gravity && axis < 3; ++axis)
      add_column(ParameterNumber::gravity(axis), kGravity + axis);
    for (int p = 0; p < parameters; ++p) add_column(ParameterNumber::own(p), kParameters + p);
  }
};

/// Dual numbers over a vertex's mass.
struct MassDual {
  using Number = ceres::Jet<double, 1>;

  static VertexSight<Number> sight(const VertexSight<double>& at) {
    VertexSight<Number> sight = constant<Number>(at);
    sight.mass_kg = Number(at.mass_kg, 0);
    return sight;
  }
  static void add_block(int k, const Vector3<Number>& v, EffectLinearisation& derivatives) {
    const Eigen::Vector3d derivative(v.x.v[0], v.y.v[0], v.z.v[0]);
    if (!derivative.isZero(0)) derivatives.by_mass.push_back({k, derivative});
  }
};

/// Returns a law's parameters at a moment, the same for all vertices. They are the law's at_moment,
/// or the parameters themselves.
template <class Law, class Real, size_t count>
auto at_moment(const std::array<Real, count>& parameters, double time_s) {
  if constexpr (requires { Law::at_moment(parameters, time_s); })
    return Law::at_moment(parameters, time_s);
  else
    return parameters;
}

/// Tells whether a law does anything at a vertex, or would after a small change. A law may say so
/// in its acts; derivatives are nothing elsewhere, and are not taken.
template <class Law, size_t count>
bool acts(const VertexSight<double>& at, const std::array<double, count>& parameters) {
  if constexpr (requires { Law::acts(at, parameters); })
    return Law::acts(at, parameters);
  else
    return true;
}

/// Makes an effect whose force on a vertex follows from its sight. A Law has
///   static constexpr int kParameters;
///   template <class Real> static Vector3<Real> force(const VertexSight<Real>&,
///                                                    const std::array<Real, kParameters>&);  // N
///   static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&);
/// Where the parameters act through something that changes with time alone, it may have that too.
/// `force` then gets its result in their place:
///   template <class Real> static T at_moment(const std::array<Real, kParameters>&, double time_s);
/// It may say what it looks at, so that derivatives are taken only by that, and where it acts:
///   static constexpr LooksAt kLooksAt;
///   static bool acts(const VertexSight<double>&, const std::array<double, kParameters>&);
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
    constexpr int kFew = 10;  // parameters in one pass; a second look at the law costs as much
    const auto values = constants<double, size_t{Law::kParameters}>(parameters);
    if constexpr (Law::kParameters > kFew) {
      linearise_by_many(scene, parameters, derivatives);
    } else {
      using Dual = VertexDual<kAt, 0, Law::kParameters>;
      const auto p = at_moment<Law>(Dual::parameters_of(parameters), scene.time_s);
      for_vertices<SingleLane>(
          scene, [&](int k, const AreaStencil& area, const VertexSight<double>& sight) {
            if (!acts<Law>(sight, values)) return;
            Dual::add_blocks(k, area, scene.position_m,
                             Dual::jacobian(Law::force(Dual::sight(sight), p)), derivatives);
          });
    }
    if (!kAt.mass) return;
    const auto fixed = at_moment<Law>(
        constants<MassDual::Number, size_t{Law::kParameters}>(parameters), scene.time_s);
    for_vertices<SingleLane>(
        scene, [&](int k, const AreaStencil&, const VertexSight<double>& sight) {
          if (!acts<Law>(sight, values)) return;
          MassDual::add_block(k, Law::force(MassDual::sight(sight), fixed), derivatives);
        });
  }

 private:
  static constexpr LooksAt kAt = looks_at<Law>();

  /// Takes derivatives by the sight, then by a few of the requested parameters at a time: of many,
  /// hardly any are requested.
  static void linearise_by_many(const EffectScene<SingleLane>& scene,
                                const EffectValues<SingleLane>& parameters,
                                EffectLinearisation& derivatives) {
    constexpr size_t kCount = Law::kParameters;
    using Seen = VertexDual<kAt, 0, 0>;
    const auto fixed =
        at_moment<Law>(constants<typename Seen::Number, kCount>(parameters), scene.time_s);
    for_vertices<SingleLane>(
        scene, [&](int k, const AreaStencil& area, const VertexSight<double>& sight) {
          Seen::add_blocks(k, area, scene.position_m,
                           Seen::jacobian(Law::force(Seen::sight(sight), fixed)), derivatives);
        });
    constexpr int kAtOnce = 4;
    using Some = ceres::Jet<double, kAtOnce>;
    std::vector<int> asked;
    for (int p = 0; p < Law::kParameters; ++p)
      if (derivatives.asks_for(ParameterNumber::own(p))) asked.push_back(p);
    for (size_t first = 0; first < asked.size(); first += kAtOnce) {
      const std::span<const int> some =
          std::span(asked).subspan(first, std::min<size_t>(kAtOnce, asked.size() - first));
      std::array<Some, kCount> of = constants<Some, kCount>(parameters);
      for (size_t c = 0; c < some.size(); ++c)
        of[static_cast<size_t>(some[c])].v[static_cast<Eigen::Index>(c)] = 1;
      const auto p = at_moment<Law>(of, scene.time_s);
      for_vertices<SingleLane>(
          scene, [&](int k, const AreaStencil&, const VertexSight<double>& sight) {
            const Vector3<Some> force = Law::force(constant<Some>(sight), p);
            for (size_t c = 0; c < some.size(); ++c) {
              const auto n = static_cast<Eigen::Index>(c);
              const Eigen::Vector3d derivative(force.x.v[n], force.y.v[n], force.z.v[n]);
              if (!derivative.isZero(0))
                derivatives.by_parameter.push_back({k, ParameterNumber::own(some[c]), derivative});
            }
          });
    }
  }
};

/// Makes an effect of inertia beyond the vertices' mass, which changes the sum of forces. A Law has
///   static constexpr int kParameters;
///   template <class Real> static Vector3<Real> change(const VertexSight<Real>&,
///       const Vector3<Real>& force_n, const std::array<Real, kParameters>&);  // N
///   static EffectRates rates(...);      // as above
///   static constexpr LooksAt kLooksAt;  // may be left out
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
    constexpr LooksAt kAt = looks_at<Law>();
    using Dual = VertexDual<kAt, 3, Law::kParameters>;
    const auto p = Dual::parameters_of(parameters);
    const auto fixed = constants<MassDual::Number, size_t{Law::kParameters}>(parameters);
    for_vertices<SingleLane>(
        scene, [&](int k, const AreaStencil& area, const VertexSight<double>& sight) {
          const Vector3<double> force_at = vector_at<SingleLane>(force_n, k);
          const auto force = Dual::vector(force_at, Dual::kMore);
          const auto j = Dual::jacobian(Law::change(Dual::sight(sight), force, p));
          if (kAt.mass)
            MassDual::add_block(
                k, Law::change(MassDual::sight(sight), constant<MassDual::Number>(force_at), fixed),
                derivatives);
          Dual::add_blocks(k, area, scene.position_m, j, derivatives);
          derivatives.by_force.push_back({k, j.template middleCols<3>(Dual::kMore)});
        });
  }
};

}  // namespace clothfit
