#pragma once

#include <vector>

#include "model/cloth/effect.h"

namespace clothfit {

/// Overrides an effect's functions in lanes of each of the kinds L. `Adapter` states them once for
/// all kinds, in the templates that LawEffect names.
template <class Adapter, class... L>
class AdapterInLanes : public Effect {};

template <class Adapter, class L, class... More>
class AdapterInLanes<Adapter, L, More...> : public AdapterInLanes<Adapter, More...> {
  using Rest = AdapterInLanes<Adapter, More...>;

 public:
  using Rest::add_force;
  using Rest::change_force;
  using Rest::shift_supports;

  void add_force(const EffectScene<L>& scene, const EffectValues<L>& parameters,
                 EffectMemory<L>& memory, LaneVectors<L>& force_n) const override {
    Adapter::add(scene, parameters, memory, force_n);
  }
  void change_force(const EffectScene<L>& scene, const EffectValues<L>& parameters,
                    LaneVectors<L>& force_n) const override {
    Adapter::change(scene, parameters, force_n);
  }
  void shift_supports(const EffectScene<L>& scene, const EffectValues<L>& parameters,
                      const LaneVectors<L>& support_force_n, EffectMemory<L>& memory,
                      LaneVectors<L>& target_m) const override {
    Adapter::shift(scene, parameters, support_force_n, memory, target_m);
  }
};

/// Base of the adapters, which make an effect of a Law: VertexLawEffect<Law> and its like. Virtual
/// functions cannot be templates over the kind of lanes. An adapter therefore writes the templates,
/// each of which hides the one below, which does nothing.
template <class Adapter, class Law>
class LawEffect : public AdapterInLanes<Adapter, ExactLanes, FastLanes, SingleLane> {
 public:
  /// LaneEffect::add_force
  template <class L>
  static void add(const EffectScene<L>&, const EffectValues<L>&, EffectMemory<L>&,
                  LaneVectors<L>& /*force_n*/) {}

  /// LaneEffect::change_force
  template <class L>
  static void change(const EffectScene<L>&, const EffectValues<L>&, LaneVectors<L>& /*force_n*/) {}

  /// LaneEffect::shift_supports
  template <class L>
  static void shift(const EffectScene<L>&, const EffectValues<L>&,
                    const LaneVectors<L>& /*support_force_n*/, EffectMemory<L>&,
                    LaneVectors<L>& /*target_m*/) {}

  EffectRates rates(const Cloth& cloth, const SpringParameters& springs,
                    const std::vector<double>& parameters) const override {
    return Law::rates(cloth, springs, parameters);
  }
};

}  // namespace clothfit
