#pragma once

#include <ceres/jet.h>

#include <array>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/effects/law_effect.h"
#include "model/effects/linearisation.h"
#include "model/effects/number.h"

namespace clothfit {

/// Some vertices on which a law acts together.
template <int vertices>
struct Stencil {
  std::array<int, vertices> vertex;
  std::array<double, 4> constants;  ///< whatever the law needs to know of this place
};

/// Makes an effect between a few vertices each, such as bending. A Law has
///   static constexpr int kParameters, kVertices;
///   // calls visit(Stencil<kVertices>) where it acts; a vertex may stand in it twice
///
///   template <class Visit> static void for_stencils(const Cloth&, const Visit&);
///
///   template <class Real> static std::array<Vector3<Real>, kVertices> forces(
///       const std::array<Vector3<Real>, kVertices>& position_m,
///       const std::array<double, 4>& constants, const std::array<Real, kParameters>&);  // N
///   static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&);
/// Lanes, tangents and the adjoint follow from these.
template <class Law>
class StencilLawEffect final : public LawEffect<StencilLawEffect<Law>, Law> {
 public:
  template <class L>
  static void add(const EffectScene<L>& scene, const EffectValues<L>& parameters, EffectMemory<L>&,
                  LaneVectors<L>& force_n) {
    const auto p = reals_of<L, Law::kParameters>(parameters);
    Law::for_stencils(scene.cloth, [&](const Stencil<Law::kVertices>& stencil) {
      std::array<Vector3<RealOf<L>>, Law::kVertices> position;
      for (size_t v = 0; v < Law::kVertices; ++v)
        position[v] = vector_at<L>(scene.position_m, stencil.vertex[v]);
      const auto forces = Law::forces(position, stencil.constants, p);
      for (size_t v = 0; v < Law::kVertices; ++v) add_at<L>(force_n, stencil.vertex[v], forces[v]);
    });
  }

  void linearise_force(const EffectScene<SingleLane>& scene,
                       const EffectValues<SingleLane>& parameters, const EffectMemory<SingleLane>&,
                       EffectLinearisation& derivatives) const override {
    constexpr int kOwn = 3 * Law::kVertices, kCount = kOwn + Law::kParameters;
    using Dual = ceres::Jet<double, kCount>;
    std::array<Dual, Law::kParameters> p;
    for (int n = 0; n < Law::kParameters; ++n)
      p[static_cast<size_t>(n)] = Dual(parameters[static_cast<size_t>(n)][0], kOwn + n);
    Law::for_stencils(scene.cloth, [&](const Stencil<Law::kVertices>& stencil) {
      std::array<Vector3<Dual>, Law::kVertices> position;
      for (int v = 0; v < Law::kVertices; ++v) {
        const auto n = static_cast<size_t>(v);
        const Vector3<double> x = vector_at<SingleLane>(scene.position_m, stencil.vertex[n]);
        position[n] = {Dual(x.x, 3 * v), Dual(x.y, 3 * v + 1), Dual(x.z, 3 * v + 2)};
      }
      const auto forces = Law::forces(position, stencil.constants, p);
      for (size_t on = 0; on < Law::kVertices; ++on) {
        Eigen::Matrix<double, 3, kCount> j;
        j << forces[on].x.v.transpose(), forces[on].y.v.transpose(), forces[on].z.v.transpose();
        for (int of = 0; of < Law::kVertices; ++of)
          if (const Eigen::Matrix3d block = j.template middleCols<3>(3 * of); !block.isZero(0))
            derivatives.by_motion.push_back({stencil.vertex[on],
                                             stencil.vertex[static_cast<size_t>(of)], block,
                                             Eigen::Matrix3d::Zero()});
        for (int n = 0; n < Law::kParameters; ++n)
          if (!j.col(kOwn + n).isZero(0))
            derivatives.by_parameter.push_back(
                {stencil.vertex[on], ParameterNumber::own(n), j.col(kOwn + n)});
      }
    });
  }
};

}  // namespace clothfit
