#pragma once

#include <array>

#include "model/effects/law_effect.h"
#include "model/effects/linearisation.h"
#include "model/effects/number.h"

namespace clothfit {

/// The vectors of one simulation among those in lanes, in double precision.
template <class L>
struct OneLane {
  const LaneVectors<L>& vectors;
  int lane;

  Vector3<double> operator()(int k) const {
    return {static_cast<double>(vectors.x(lane, k)), static_cast<double>(vectors.y(lane, k)),
            static_cast<double>(vectors.z(lane, k))};
  }
};

/// Returns the number that a search compares: without its derivatives.
inline double value_of(double x) {
  return x;
}
template <class Dual>
requires requires(Dual x) {
  x.a;
}
double value_of(const Dual& x) {
  return x.a;
}
template <class Real>
Vector3<double> value_of(const Vector3<Real>& v) {
  return {value_of(v.x), value_of(v.y), value_of(v.z)};
}

/// An effect that has to search for contacts, so that each simulation takes its own path. Lanes are
/// taken one after the other. A Law has
///   static constexpr int kParameters;
///   // `position_m` and `velocity_m_per_s` give a vertex's Vector3<Real> (Real is double or a dual
///   // number); calls add(vertex, Vector3<Real>) with forces (N)
///
///   template <class Vectors, class Parameters, class Add> static void forces(
///       const Cloth&, const Vectors& position_m, const Vectors& velocity_m_per_s,
///       const Parameters&, const Add& add);
///
///   template <class Vectors, class Parameters> static void linearise(
///       const Cloth&, const Vectors& position_m, const Vectors& velocity_m_per_s,
///       const Parameters&, EffectLinearisation&);
///
///   static EffectRates rates(const Cloth&, const SpringParameters&, const std::vector<double>&);
template <class Law>
class LaneByLaneEffect final : public LawEffect<LaneByLaneEffect<Law>, Law> {
 public:
  template <class L>
  static void add(const EffectScene<L>& scene, const EffectValues<L>& parameters, EffectMemory<L>&,
                  LaneVectors<L>& force_n) {
    using Number = typename L::Number;
    for (int l = 0; l < L::kCount; ++l)
      Law::forces(scene.cloth, OneLane<L>{scene.position_m, l},
                  OneLane<L>{scene.velocity_m_per_s, l}, parameters_of<L>(parameters, l),
                  [&](int k, const Vector3<double>& f) {
                    force_n.x(l, k) += static_cast<Number>(f.x);
                    force_n.y(l, k) += static_cast<Number>(f.y);
                    force_n.z(l, k) += static_cast<Number>(f.z);
                  });
  }

  void linearise_force(const EffectScene<SingleLane>& scene,
                       const EffectValues<SingleLane>& parameters, const EffectMemory<SingleLane>&,
                       EffectLinearisation& derivatives) const override {
    Law::linearise(scene.cloth, OneLane<SingleLane>{scene.position_m, 0},
                   OneLane<SingleLane>{scene.velocity_m_per_s, 0},
                   parameters_of<SingleLane>(parameters, 0), derivatives);
  }

 private:
  template <class L>
  static auto parameters_of(const EffectValues<L>& values, int lane) {
    std::array<double, Law::kParameters> p;
    for (size_t n = 0; n < p.size(); ++n) p[n] = static_cast<double>(values[n][lane]);
    return p;
  }
};

}  // namespace clothfit
