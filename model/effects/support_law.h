#pragma once

#include <ceres/jet.h>

#include <array>
#include <utility>
#include <vector>

#include "model/cloth/cloth.h"
#include "model/effects/law_effect.h"
#include "model/effects/linearisation.h"
#include "model/effects/number.h"
#include "model/effects/vector_parameter.h"

namespace clothfit {

/// A held point as a law sees it.
template <class Real>
struct SupportSight {
  Vector3<Real> pull_n;  ///< of the cloth, its weight included
  /// Says which held point of the cloth it is, from 0 on. That is the place in a recording's list
  /// of held points as long as no edge comes before, which stands for a point at each vertex.
  int number = 0;
  bool driven = false;  ///< follows a motion of its own; else rests where it started
  /// Vector to the only other driven point, where there is just one (world, m), and its length over
  /// the flat cloth. Their motions give it; it is set for laws that ask for it, nothing for others.
  Eigen::Vector3d to_partner_m = Eigen::Vector3d::Zero();
  double partner_over_cloth_m = 0;
  double end_time_s = 0;  ///< when it will be where the law places it
  double time_step_s = 0;

  /// Returns 1 where a law acts on this held point, else 0. It acts on all for `point` 0, and on
  /// the one of that number, from 1 on, for others.
  Real is_asked(const Real& point) const {
    const Real none(0.0), all(1.0);
    const Real own(number + 1.0);
    const Real not_below = select(point > own - Real(0.5), all, none);
    const Real same = select(point < own + Real(0.5), not_below, none);
    return select(point < Real(0.5), all, same);
  }
};

/// Returns the parameter by which a law acts on one held point alone (SupportSight::is_asked).
inline EffectParameter point_parameter() {
  return {.name = "point",
          .unit = "index",
          .neutral = 0,
          .lower = 0,
          .upper = 64,
          .typical = 1,
          .picks = true};
}

/// Returns a vector's parameters, and the one that picks a held point.
inline std::vector<EffectParameter> vector_at_point(const EffectParameter& of_each) {
  std::vector<EffectParameter> all = vector_parameter(of_each);
  all.push_back(point_parameter());
  return all;
}

/// Returns a mode of all held points alike, and the same mode of single ones.
inline std::vector<EffectMode> alike_and_single(EffectMode alike) {
  EffectMode single = alike;
  single.name = "single";
  single.shapes.push_back({.parameter = "point", .values = {}, .per_held_point = true});
  return {std::move(alike), std::move(single)};
}

/// Says what to do about held points that move otherwise than a recording has them.
inline constexpr const char* kDeclareMotion =
    "declare its motion: tracked (with tracks of a marker there) or path";

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
