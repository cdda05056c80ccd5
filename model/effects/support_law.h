#pragma once

#include <ceres/jet.h>

#include <array>

#include "model/cloth/cloth.h"
#include "model/effects/law_effect.h"
#include "model/effects/linearisation.h"
#include "model/effects/number.h"

namespace clothfit {

/// A held point as a law sees it.
template <class Real>
struct SupportSight {
  Vector3<Real> pull_n;  ///< of the cloth, its weight included
  int number = 0;        ///< which held point
  bool driven = false;   ///< follows a motion of its own; else rests where it started
  /// Vector to the only other driven point, where there is just one (world, m), and its length over
  /// the flat cloth. Their motions give it; it is set for laws that ask for it, nothing for others.
  Eigen::Vector3d to_partner_m = Eigen::Vector3d::Zero();
  double partner_over_cloth_m = 0;
  double end_time_s = 0;  ///< when it will be where the law places it
  double time_step_s = 0;
};

/// Makes an effect on the places of the held points. A Law has
///   static constexpr int kParameters, kMemory;   // kMemory numbers are remembered per held point
///   static constexpr bool kAtRest;               // whether it shifts before anything moves, too
///   static constexpr bool kOfTwo;                // whether it asks for the partner
///   template <class Real> static Vector3<Real> shift(const SupportSight<Real>&,
///       const std::array<Real, kParameters>&, std::array<Real, kMemory>& memory);  // m
///   static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&);
/// Lanes, tangents and the adjoint follow from these.
template <class Law>
class SupportLawEffect final : public LawEffect<SupportLawEffect<Law>, Law> {
  static bool is_driven(const Cloth& cloth, int held) {
    const HeldVertexWeights& point = cloth.held[static_cast<size_t>(held)];
    return point.motion && !point.rests;
  }

  /// Returns the only other driven point; -1 where there is none, or more than one.
  static int partner_of(const Cloth& cloth, int held) {
    int partner = -1;
    for (int h = 0; h < static_cast<int>(cloth.held.size()); ++h) {
      if (h == held || !is_driven(cloth, h)) continue;
      if (partner >= 0) return -1;
      partner = h;
    }
    return partner;
  }

  static Eigen::Vector2d over_cloth_m(const Cloth& cloth, int held) {
    Eigen::Vector2d at = Eigen::Vector2d::Zero();
    for (const auto& [vertex, weight] : cloth.held[static_cast<size_t>(held)].weights)
      at += weight * Eigen::Vector2d(vertex % cloth.mesh.columns * cloth.mesh.spacing_s_m(),
                                     vertex / cloth.mesh.columns * cloth.mesh.spacing_t_m());
    return at;
  }

  template <class L, class Real>
  static SupportSight<Real> sight(const EffectScene<L>& scene, int held,
                                  const Vector3<Real>& pull_n) {
    const Cloth& cloth = scene.cloth;
    SupportSight<Real> sight{.pull_n = pull_n,
                             .number = held,
                             .driven = is_driven(cloth, held),
                             .end_time_s = scene.time_s + scene.time_step_s,
                             .time_step_s = scene.time_step_s};
    if constexpr (Law::kOfTwo) {
      const int partner = partner_of(cloth, held);
      if (!sight.driven || partner < 0) return sight;
      const auto place_m = [&](int h) {
        return cloth.held[static_cast<size_t>(h)].motion(sight.end_time_s);
      };
      sight.to_partner_m = place_m(partner) - place_m(held);
      sight.partner_over_cloth_m =
          (over_cloth_m(cloth, partner) - over_cloth_m(cloth, held)).norm();
    }
    return sight;
  }

 public:
  bool shifts_supports() const override { return true; }
  bool shifts_supports_at_rest() const override { return Law::kAtRest; }
  int memory_size(const Cloth& cloth) const override {
    return Law::kMemory * static_cast<int>(cloth.held.size());
  }

  template <class L>
  static void shift(const EffectScene<L>& scene, const EffectValues<L>& parameters,
                    const LaneVectors<L>& support_force_n, EffectMemory<L>& memory,
                    LaneVectors<L>& target_m) {
    using Real = RealOf<L>;
    const auto p = reals_of<L, Law::kParameters>(parameters);
    for (int h = 0; h < static_cast<int>(scene.cloth.held.size()); ++h) {
      std::array<Real, Law::kMemory> remembered;
      for (int m = 0; m < Law::kMemory; ++m)
        remembered[static_cast<size_t>(m)] =
            real_of<L>(LaneValue<L>(memory.col(h * Law::kMemory + m)));
      add_at<L>(target_m, h,
                Law::shift(sight(scene, h, vector_at<L>(support_force_n, h)), p, remembered));
      for (int m = 0; m < Law::kMemory; ++m)
        set_real<L>(memory, h * Law::kMemory + m, remembered[static_cast<size_t>(m)]);
    }
  }

  void linearise_supports(const EffectScene<SingleLane>& scene,
                          const EffectValues<SingleLane>& parameters,
                          const LaneVectors<SingleLane>& support_force_n,
                          const EffectMemory<SingleLane>& memory,
                          EffectLinearisation& derivatives) const override {
    constexpr int kOwn = 3, kMemory = kOwn + Law::kParameters, kCount = kMemory + Law::kMemory;
    using Dual = ceres::Jet<double, kCount>;
    std::array<Dual, Law::kParameters> p;
    for (int n = 0; n < Law::kParameters; ++n)
      p[static_cast<size_t>(n)] = Dual(parameters[static_cast<size_t>(n)][0], kOwn + n);
    for (int h = 0; h < static_cast<int>(scene.cloth.held.size()); ++h) {
      const Vector3<double> pull = vector_at<SingleLane>(support_force_n, h);
      std::array<Dual, Law::kMemory> remembered;
      const int first = h * Law::kMemory;
      for (int m = 0; m < Law::kMemory; ++m)
        remembered[static_cast<size_t>(m)] = Dual(memory(0, first + m), kMemory + m);
      const Vector3<Dual> shift = Law::shift(
          sight(scene, h, Vector3<Dual>{Dual(pull.x, 0), Dual(pull.y, 1), Dual(pull.z, 2)}), p,
          remembered);
      Eigen::Matrix<double, 3, kCount> j;
      j << shift.x.v.transpose(), shift.y.v.transpose(), shift.z.v.transpose();
      derivatives.by_force.push_back({h, j.template leftCols<3>()});
      for (int n = 0; n < Law::kParameters; ++n)
        derivatives.by_parameter.push_back({h, ParameterNumber::own(n), j.col(kOwn + n)});
      for (int m = 0; m < Law::kMemory; ++m) {
        derivatives.by_memory.push_back({h, first + m, j.col(kMemory + m)});
        const Dual& next = remembered[static_cast<size_t>(m)];
        derivatives.memory_by_force.push_back(
            {first + m, h, next.v.template head<3>().transpose()});
        for (int n = 0; n < Law::kParameters; ++n)
          derivatives.memory_by_parameter.push_back(
              {first + m, ParameterNumber::own(n), next.v[kOwn + n]});
        for (int of = 0; of < Law::kMemory; ++of)
          derivatives.memory_by_memory.push_back({first + m, first + of, next.v[kMemory + of]});
      }
    }
  }
};

}  // namespace clothfit
